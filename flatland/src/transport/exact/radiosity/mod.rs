//! Diffuse interreflection: the radiosity equation, and the derivative of its solution.
//!
//! With R the radiance that a side of a segment reflects and e what it emits,
//!
//! ```text
//! R(x) = ρ/2 ∫ (e + R)(y(φ)) cos φ dφ
//! ```
//!
//! R is a polynomial on each panel, found at its Gauss–Legendre nodes (Nyström's method by product
//! integration). Panels end where the structure of what is seen changes and shrink towards corners.
//! What a node sees is the exact partition of its half circle; emission is integrated in closed form
//! and R by quadrature between the ends of panels. A pixel gathers once more.
//!
//! All of it is computed with dual numbers, the nodes being fixed in the material: what is found is
//! the derivative of the discretised solution itself, and the ends of what is seen carry the
//! boundary terms of all bounces.

mod dual_math;
mod gather;
mod panels;

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::direct::{Surface, SurfaceMotion};
use super::error::ExactError;
use super::partition::{Jump, Partition, Seen, film_rate};
use super::pixels::{Integrated, motion_of_seen};
use super::quadrature::adaptive;
use crate::dual::Dual;
use crate::transport::{Camera, Change, World};
use gather::{Gather, Mesh, Row};
use panels::{Fineness, Panels, Rule, Side};

/// Images and derivatives, to a measured accuracy, of worlds without gloss for any number of bounces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radiosity {
    /// How often light may be scattered; `None` is infinitely often.
    pub bounces: Option<usize>,
    /// Into how many parts panels are cut beyond what geometry asks for; 1 to 1024.
    ///
    /// Panels end at the kinks of direct light, so that two bounces converge fast. Light that is
    /// scattered again has weaker kinks elsewhere, which only shorter panels resolve. Measured errors
    /// of the derivative, relative to the scale, in a room with a block, a gap and one bright wall
    /// (the last step's: the result is better, except where two steps happen to agree):
    ///
    /// | parts | 2 bounces | 3 bounces | infinitely many |
    /// |---|---|---|---|
    /// | 1 | 5·10⁻¹⁰ | 2·10⁻⁷ | 1·10⁻⁶ |
    /// | 2 | 4·10⁻¹¹ | 2·10⁻⁷ | 1·10⁻⁶ |
    /// | 3 | 4·10⁻¹¹ | 3·10⁻⁸ | 3·10⁻⁷ |
    /// | 4 | | | 9·10⁻⁹ |
    pub parts: usize,
    /// The error of the quadrature over the film, relative to the integral of absolute values.
    pub tolerance: f64,
}

impl Default for Radiosity {
    fn default() -> Self {
        Self { bounces: None, parts: 2, tolerance: 1e-10 }
    }
}

/// How many times panels shrink towards corners. One more changes a derivative by some 10⁻⁹.
const LEVELS: usize = 3;
/// More parts than this would need more memory than there is.
const MOST_PARTS: usize = 1024;
/// Iterations end when nothing changes by more than this part of the largest value.
const CONVERGED: f64 = 1e-15;
/// And after this many: 10⁻¹⁵ is reached then at a reflectance of 0.99.
const MOST_ITERATIONS: usize = 4000;

impl Radiosity {
    /// The value and the derivative of every pixel. The errors are measured: the difference from
    /// the solution with panels half as long and graded one level further, which is the one returned.
    ///
    /// # Errors
    /// An [`ExactError`] that names the parameter, the glossy shape, or the place where no derivative
    /// exists.
    pub fn gradient(
        &self,
        world: &World,
        camera: &Camera,
        change: &Change,
    ) -> Result<[Integrated<f64>; 2], ExactError> {
        self.check(world, camera, change)?;
        let partition = Partition::new(world, camera, self.bounces != Some(0))?;
        partition.check_parting(world, camera, change)?;
        let seen = sides_on_film(world, camera, &partition);
        let solve = |levels: usize, parts: usize| {
            let solution = Solution::new(world, change, &seen, self.bounces, Fineness { levels, parts });
            let (bounces, known) = (self.bounces, Mutex::default());
            FilmIntegral { world, camera, change, partition: &partition, solution, bounces, known }
                .pixels(self.tolerance)
        };
        let (coarse, fine) = (solve(LEVELS, self.parts)?, solve(LEVELS + 1, 2 * self.parts)?);
        Ok([0, 1].map(|k| {
            let mut result = Integrated { pixels: vec![], errors: vec![], scales: vec![] };
            for (coarse, fine) in coarse.iter().zip(&fine) {
                result.pixels.push(fine.value[k]);
                result.errors.push((fine.value[k] - coarse.value[k]).abs() + fine.error);
                result.scales.push(fine.scale);
            }
            result
        }))
    }

    /// The image alone.
    ///
    /// # Errors
    /// As of [`gradient`](Self::gradient).
    pub fn image(&self, world: &World, camera: &Camera) -> Result<Integrated<f64>, ExactError> {
        let [image, _] = self.gradient(world, camera, &Change::none(world))?;
        Ok(image)
    }

    fn check(&self, world: &World, camera: &Camera, change: &Change) -> Result<(), ExactError> {
        camera.check()?;
        change.check(world)?;
        let Self { parts, tolerance, .. } = *self;
        if parts == 0 || parts > MOST_PARTS {
            return Err(ExactError::Parts { parts });
        }
        if !(1e-14..1.0).contains(&tolerance) {
            return Err(ExactError::Tolerance { tolerance });
        }
        for (shape, content) in world.shapes().iter().enumerate() {
            if content.material().gloss.is_some() {
                return Err(ExactError::Glossy { shape });
            }
            if self.bounces.is_none() && content.material().reflectance >= 1.0 {
                return Err(ExactError::NoAbsorption { shape });
            }
        }
        Ok(())
    }
}

/// The sides from which light reaches what the camera sees directly.
fn sides_on_film(world: &World, camera: &Camera, partition: &Partition) -> Vec<Side> {
    let mut sides = vec![];
    for stretch in &partition.stretches {
        let Some(segment) = stretch.seen.filter(|i| world.material(*i).reflectance > 0.0) else { continue };
        let own = &world.segments()[segment];
        let side = own.edge.perp_dot(camera.position - own.start) > 0.0;
        sides.push((segment, side));
    }
    sides
}

/// The reflected radiance at all nodes.
struct Solution {
    mesh: Mesh,
    rule: Rule,
    values: Vec<Dual>,
}

impl Solution {
    fn new(
        world: &World,
        change: &Change,
        seen: &[Side],
        bounces: Option<usize>,
        fineness: Fineness,
    ) -> Self {
        let rule = Rule::new();
        let mut this = Self { mesh: Mesh::new(), rule, values: vec![] };
        if bounces.is_some_and(|n| n < 2) {
            return this;
        }
        let nodes = this.reach(world, change, seen, fineness);
        let direct: Vec<Dual> = nodes.par_iter().map(|node| node.direct() - emission(node)).collect();
        let rows: Vec<Row> = nodes.par_iter().map(|node| node.row(&this.mesh, &this.rule)).collect();
        // R_k = K (e + R_{k−1}); the last scattering is the gathering for the film.
        let mut values = direct.clone();
        let most = bounces.map_or(MOST_ITERATIONS, |n| n - 2);
        for _ in 0..most {
            let next: Vec<Dual> =
                rows.par_iter().zip(&direct).map(|(row, direct)| *direct + apply(row, &values)).collect();
            let (change, size) = next.iter().zip(&values).fold((0.0_f64, 0.0_f64), |(c, s), (a, b)| {
                let difference = (a.value - b.value).abs().max((a.slope - b.slope).abs());
                (c.max(difference), s.max(a.value.abs()).max(a.slope.abs()))
            });
            values = next;
            if change <= CONVERGED * size {
                break;
            }
        }
        this.values = values;
        this
    }

    /// Gives panels to all sides from which light can reach the given ones, and returns their nodes.
    fn reach<'a>(
        &mut self,
        world: &'a World,
        change: &'a Change,
        seen: &[Side],
        fineness: Fineness,
    ) -> Vec<Gather<'a>> {
        let mut todo: Vec<Side> = seen.to_vec();
        let mut nodes: Vec<Gather<'a>> = vec![];
        while let Some(side) = todo.pop() {
            if self.mesh.contains_key(&side) {
                continue;
            }
            let panels = Panels::new(world, side, fineness, nodes.len());
            for s in panels.nodes(&self.rule) {
                let node = node(world, change, side, s);
                todo.extend(node.sides().filter(|s| !self.mesh.contains_key(s)));
                nodes.push(node);
            }
            self.mesh.insert(side, panels);
        }
        nodes
    }

    /// L of a surface.
    fn radiance(&self, gather: &Gather) -> Dual {
        if self.values.is_empty() {
            return gather.direct();
        }
        gather.direct() + apply(&gather.row(&self.mesh, &self.rule), &self.values)
    }
}

fn apply(row: &Row, values: &[Dual]) -> Dual {
    row.iter().fold(Dual::constant(0.0), |sum, (i, weight)| sum + *weight * values[*i])
}

fn emission(node: &Gather) -> Dual {
    let (value, slope) = node.surface.emission(node.change);
    Dual { value, slope }
}

/// A node, which moves with its material.
fn node<'a>(world: &'a World, change: &'a Change, (segment, side): Side, s: f64) -> Gather<'a> {
    let own = &world.segments()[segment];
    let normal = if side { own.normal() } else { -own.normal() };
    let ends = own.turning_rate().into_iter().zip(own.vertices);
    let motion = SurfaceMotion {
        velocity: own.material_point(s).velocity(&change.vertices),
        normal_turn: ends.map(|(covector, v)| covector.dot(change.vertices[v])).sum(),
        outgoing_turn: 0.0,
    };
    gather(world, change, Surface::new(world, segment, s, normal), segment, motion)
}

fn gather<'a>(
    world: &'a World,
    change: &'a Change,
    surface: Surface<'a>,
    segment: usize,
    motion: SurfaceMotion,
) -> Gather<'a> {
    let shape = world.segments()[segment].shape;
    let value = world.material(segment).reflectance;
    let reflectance = Dual { value, slope: change.materials[shape].reflectance };
    Gather { world, change, surface, segment, motion, reflectance }
}

struct FilmIntegral<'a> {
    world: &'a World,
    camera: &'a Camera,
    change: &'a Change,
    partition: &'a Partition,
    solution: Solution,
    bounces: Option<usize>,
    /// L at the bits of u. Filters overlap and their pieces end in the same places, so that every
    /// pixel in reach asks for the same u.
    known: Mutex<HashMap<u64, Dual>>,
}

/// A pixel's value and derivative.
struct Pixel {
    value: [f64; 2],
    error: f64,
    scale: f64,
}

impl FilmIntegral<'_> {
    fn pixels(&self, tolerance: f64) -> Result<Vec<Pixel>, ExactError> {
        let jumps = &self.partition.jumps;
        let steps: Vec<(f64, f64)> = jumps.iter().map(|j| (j.u, self.step(j))).collect();
        jumps.iter().zip(&steps).try_for_each(|(jump, step)| jump.check(self.camera, step.1))?;
        let film = &self.camera.film;
        let pixel = |pixel: usize| {
            let mut pieces = vec![];
            film.cells(pixel).for_each(|cell| self.partition.pieces(cell, &mut pieces));
            let integrand = |u: f64| {
                let h = film.filter_value(pixel, u);
                let l = self.radiance_at(u);
                ([h * l.value, h * l.slope], h * (l.value.abs() + l.slope.abs()))
            };
            let integral = adaptive(&pieces, integrand, tolerance);
            let primary: f64 = steps.iter().map(|(u, step)| film.filter_value(pixel, *u) * step).sum();
            let [value, slope] = integral.value;
            Pixel {
                value: [value, slope + primary],
                error: integral.error,
                scale: integral.scale + primary.abs(),
            }
        };
        Ok((0..film.pixels).into_par_iter().map(pixel).collect())
    }

    /// L at fixed u, between jumps.
    fn radiance_at(&self, u: f64) -> Dual {
        // A value is whole or not there: a thread that panicked leaves nothing to be afraid of.
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(l) = known().get(&u.to_bits()) {
            return *l;
        }
        let seen = self.partition.stretch(u).seen;
        let l = self.radiance(seen.map(|i| Seen::on(self.world, self.camera, i, u)), u);
        known().insert(u.to_bits(), l);
        l
    }

    /// L at fixed u, of what is seen there on one side.
    fn radiance(&self, seen: Option<Seen>, u: f64) -> Dual {
        let Some(seen) = seen else {
            return Dual { value: self.world.environment(), slope: self.change.environment };
        };
        if self.bounces == Some(0) {
            let shape = self.world.segments()[seen.segment].shape;
            let value = self.world.material(seen.segment).emission;
            return Dual { value, slope: self.change.materials[shape].emission };
        }
        let motion = motion_of_seen(self.world, self.camera, u, &seen, self.change);
        let surface = Surface::new(self.world, seen.segment, seen.s, -seen.direction);
        self.solution.radiance(&gather(self.world, self.change, surface, seen.segment, motion))
    }

    /// (L⁻ − L⁺) u̇ of a jump over the film.
    fn step(&self, jump: &Jump) -> f64 {
        let rate = film_rate(self.camera, self.change, jump.vertex, jump.u, jump.distance);
        if rate == 0.0 {
            return 0.0;
        }
        let seen = jump.sides.map(|side| side.map(|i| Seen::at_jump(self.world, self.camera, i, jump)));
        let [low, high] = seen.map(|side| self.radiance(side, jump.u).value);
        (low - high) * rate
    }
}
