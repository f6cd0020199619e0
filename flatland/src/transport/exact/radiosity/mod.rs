//! Diffuse interreflection: the radiosity equation, and the derivative of its solution.
//!
//! With R the radiance reflected by a side of a segment and e its emission,
//!
//! ```text
//! R(x) = ρ/2 ∫ (e + R)(y(φ)) cos φ dφ
//! ```
//!
//! R is a polynomial on each panel, solved for at its Gauss–Legendre nodes (Nyström's method by product
//! integration). Panels end where the structure of the view changes and shrink towards corners. The view of a
//! node is the exact partition of its half circle; emission is integrated in closed form and R by quadrature
//! between the ends of panels. A pixel gathers once more.
//!
//! Everything is computed with dual numbers, with nodes fixed in the material: the result is the derivative
//! of the discretised solution itself, and the ends of visible intervals contribute the boundary terms of all
//! bounces.

mod gather;
mod panels;
mod solve;

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::direct::{Surface, SurfaceMotion, may_scatter};
use super::error::ExactError;
use super::partition::{Jump, Partition, Seen, film_rate};
use super::pixels::{Integrated, motion_of_seen};
use crate::calculus::{Dual, Number};
use crate::quadrature::adaptive;
use crate::transport::{Camera, Tangent, World};
use gather::{Gather, Mesh, Row};
use panels::{Fineness, Panels, Rule, Side};
use solve::{Solved, solve};

/// Images and derivatives, to an estimated accuracy, of worlds without gloss for any number of bounces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radiosity {
    /// Largest number of scattering events; `None` for infinitely many.
    pub bounces: Option<usize>,
    /// Number of parts, 1 to 1024, into which panels are cut beyond the geometric subdivision.
    ///
    /// Panels end at the kinks of direct light, so that two bounces converge fast. Multiply scattered light
    /// has weaker kinks elsewhere, which only shorter panels resolve. In a room with a block, a gap and one
    /// bright wall, the relative error of the derivative was 5·10⁻¹⁰ for 2 bounces, 2·10⁻⁷ for 3 and 10⁻⁶ for
    /// infinitely many with 1 part, and 9·10⁻⁹ for infinitely many with 4. For other worlds, use the reported
    /// errors.
    pub parts: usize,
    /// Error of the quadrature over the film, relative to the integral of absolute values.
    pub tolerance: f64,
}

impl Default for Radiosity {
    fn default() -> Self {
        Self { bounces: None, parts: 2, tolerance: 1e-10 }
    }
}

/// Number of gradings of panels towards corners. One more changes a derivative by about 10⁻⁹.
const LEVELS: usize = 3;
/// More parts would exceed available memory.
const MOST_PARTS: usize = 1024;
/// A sum of bounces ends when the last one adds at most this fraction of the largest value.
const CONVERGED: f64 = 1e-15;

impl Radiosity {
    /// Value and derivative of every pixel. The result comes from panels half as long and graded one level
    /// further. Its errors are estimated as the difference between the two solutions, plus the error of the
    /// quadrature over the film and the error due to the residual of the linear system, r ρ/(1 − ρ). They are
    /// not bounds: light that varies over less than 10⁻⁵ of a segment, or near the end of one without a
    /// vertex near its line, may be missed by both solutions. For a lamp of length 10⁻⁶, equally far from a
    /// floor, 3·10⁻⁶ of the light was missed without being reported.
    ///
    /// # Errors
    /// An [`ExactError`] that names the parameter, the glossy shape, or the place where no derivative exists.
    pub fn gradient(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<[Integrated<f64>; 2], ExactError> {
        self.check(world, camera, change)?;
        let partition =
            Partition::new(world, camera, |i| self.bounces != Some(0) && may_scatter(world, change, i))?;
        partition.check_parting(world, camera, change)?;
        let seen = sides_on_film(world, camera, change, &partition);
        let solve = |levels: usize, parts: usize| {
            let solution = Solution::new(world, change, &seen, self.bounces, Fineness { levels, parts })?;
            let (bounces, known) = (self.bounces, Mutex::default());
            FilmIntegral { world, camera, change, partition: &partition, solution, bounces, known }
                .pixels(self.tolerance)
        };
        let (coarse, fine) = (solve(LEVELS, self.parts)?, solve(LEVELS + 1, 2 * self.parts)?);
        Ok([0, 1].map(|k| {
            let mut result = Integrated { pixels: vec![], errors: vec![], scales: vec![] };
            for (coarse, fine) in coarse.iter().zip(&fine) {
                result.pixels.push(fine.value[k]);
                result.errors.push((fine.value[k] - coarse.value[k]).abs() + fine.errors[k]);
                result.scales.push(fine.scale);
            }
            result
        }))
    }

    /// The image alone.
    ///
    /// # Errors
    /// As for [`gradient`](Self::gradient).
    pub fn image(&self, world: &World, camera: &Camera) -> Result<Integrated<f64>, ExactError> {
        let [image, _] = self.gradient(world, camera, &Tangent::none(world))?;
        Ok(image)
    }

    fn check(&self, world: &World, camera: &Camera, change: &Tangent) -> Result<(), ExactError> {
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

/// The sides from which light reaches directly visible surfaces.
fn sides_on_film(world: &World, camera: &Camera, change: &Tangent, partition: &Partition) -> Vec<Side> {
    let mut sides = vec![];
    for stretch in &partition.stretches {
        let Some(segment) = stretch.seen.filter(|i| may_scatter(world, change, *i)) else { continue };
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
    values: Vec<Dual<1>>,
    /// Estimated distance of any value from the discrete equation's solution.
    error: Dual<1>,
}

impl Solution {
    fn new(
        world: &World,
        change: &Tangent,
        seen: &[Side],
        bounces: Option<usize>,
        fineness: Fineness,
    ) -> Result<Self, ExactError> {
        let rule = Rule::new();
        let mut this = Self { mesh: Mesh::new(), rule, values: vec![], error: Dual::constant(0.0) };
        if bounces.is_some_and(|n| n < 2) {
            return Ok(this);
        }
        let nodes = this.reach(world, change, seen, fineness);
        let direct: Vec<Dual<1>> = nodes.par_iter().map(|node| node.direct() - emission(node)).collect();
        let rows: Vec<Row> = nodes.par_iter().map(|node| node.row(&this.mesh, &this.rule)).collect();
        let Solved { values, residual } = match bounces {
            Some(bounces) => summed(&rows, &direct, bounces - 2),
            None => solve(&rows, &direct).map_err(|residual| ExactError::NotConverged { residual })?,
        };
        // ‖δ‖ ≤ ‖r‖/(1 − ‖K‖) with ‖K‖ ≤ ρ, and the derivative of that.
        let most = world.shapes().iter().map(|shape| shape.material().reflectance).fold(0.0, f64::max);
        let turned = rows.iter().map(|row| magnitude(row).slope()).fold(0.0, f64::max);
        let left = Dual::new(1.0 - most, [-turned]);
        this.values = values;
        // For a finite number of bounces, the omitted part is not a residual but the error itself.
        this.error = if bounces.is_some() { residual } else { residual / left };
        Ok(this)
    }

    /// Adds panels for all sides from which light can reach the given ones, and returns their nodes.
    fn reach<'a>(
        &mut self,
        world: &'a World,
        change: &'a Tangent,
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

    /// L of a surface, and the part of its error that is due to the solution.
    fn radiance(&self, gather: &Gather) -> [Dual<1>; 2] {
        if self.values.is_empty() {
            return [gather.direct(), Dual::constant(0.0)];
        }
        let row = gather.row(&self.mesh, &self.rule);
        [gather.direct() + apply(&row, &self.values), magnitude(&row) * self.error]
    }
}

/// Light scattered `more` times after the first, R_k = K (e + R_{k−1}), and the omitted part. (The last
/// scattering is the gathering for the film.)
fn summed(rows: &[Row], direct: &[Dual<1>], more: usize) -> Solved {
    let mut values = direct.to_vec();
    let mut left = Dual::constant(0.0);
    for k in 0..more {
        let next: Vec<Dual<1>> =
            rows.par_iter().zip(direct).map(|(row, direct)| *direct + apply(row, &values)).collect();
        let largest = |of: &dyn Fn(usize) -> f64| (0..next.len()).map(of).fold(0.0, f64::max);
        let change = Dual::new(
            largest(&|i| (next[i].value - values[i].value).abs()),
            [largest(&|i| (next[i].slope() - values[i].slope()).abs())],
        );
        let size = largest(&|i| next[i].value.abs().max(next[i].slope().abs()));
        values = next;
        if change.value.max(change.slope()) <= CONVERGED * size {
            // No bounce adds more than the one before.
            left = change * (more - 1 - k) as f64;
            break;
        }
    }
    Solved { values, residual: left }
}

fn apply(row: &Row, values: &[Dual<1>]) -> Dual<1> {
    row.iter().fold(Dual::constant(0.0), |sum, (i, weight)| sum + *weight * values[*i])
}

/// Σ |weight| and Σ |its slope|.
fn magnitude(row: &Row) -> Dual<1> {
    row.iter().fold(Dual::constant(0.0), |sum, (_, weight)| {
        sum + Dual::new(weight.value.abs(), [weight.slope().abs()])
    })
}

fn emission(node: &Gather) -> Dual<1> {
    let (value, slope) = node.surface.emission(node.change);
    Dual::new(value, [slope])
}

/// A node, which moves with its material.
fn node<'a>(world: &'a World, change: &'a Tangent, (segment, side): Side, s: f64) -> Gather<'a> {
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
    change: &'a Tangent,
    surface: Surface<'a>,
    segment: usize,
    motion: SurfaceMotion,
) -> Gather<'a> {
    let shape = world.segments()[segment].shape;
    let value = world.material(segment).reflectance;
    let reflectance = Dual::new(value, [change.materials[shape].reflectance]);
    Gather { world, change, surface, segment, motion, reflectance }
}

struct FilmIntegral<'a> {
    world: &'a World,
    camera: &'a Camera,
    change: &'a Tangent,
    partition: &'a Partition,
    solution: Solution,
    bounces: Option<usize>,
    /// L and its error by the bits of u. Filters overlap and their pieces have common ends, so that every
    /// pixel in reach evaluates the same u.
    known: Mutex<HashMap<u64, [Dual<1>; 2]>>,
}

/// A pixel's value and derivative.
struct Pixel {
    value: [f64; 2],
    errors: [f64; 2],
    scale: f64,
}

impl FilmIntegral<'_> {
    fn pixels(&self, tolerance: f64) -> Result<Vec<Pixel>, ExactError> {
        let jumps = &self.partition.jumps;
        let steps: Vec<(f64, Dual<1>)> = jumps.iter().map(|j| (j.u, self.step(j))).collect();
        jumps.iter().zip(&steps).try_for_each(|(jump, step)| jump.check(self.camera, step.1.value))?;
        let film = &self.camera.film;
        let pixel = |pixel: usize| {
            let mut pieces = vec![];
            film.cells(pixel).for_each(|cell| self.partition.pieces(cell, &mut pieces));
            let mut largest = [0.0_f64; 2];
            let integrand = |u: f64| {
                let h = film.filter_value(pixel, u);
                let [l, off] = self.radiance_at(u);
                largest = [largest[0].max(off.value), largest[1].max(off.slope())];
                ([h * l.value, h * l.slope()], h * (l.value.abs() + l.slope().abs()))
            };
            let integral = adaptive(&pieces, integrand, tolerance);
            let weighted = |(u, step): &(f64, Dual<1>)| *step * film.filter_value(pixel, *u);
            let primary = steps.iter().map(weighted).fold(Dual::constant(0.0), |sum, step| sum + step);
            let [value, slope] = integral.value;
            Pixel {
                value: [value, slope + primary.value],
                // ∫ h = 1: no pixel's error exceeds the largest error of its visible points.
                errors: [integral.error + largest[0], integral.error + largest[1] + primary.slope()],
                scale: integral.scale + primary.value.abs(),
            }
        };
        Ok((0..film.pixels).into_par_iter().map(pixel).collect())
    }

    /// L at fixed u, between discontinuities, and its error.
    fn radiance_at(&self, u: f64) -> [Dual<1>; 2] {
        // Values are inserted as a whole: a panic of another thread leaves the map valid.
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(l) = known().get(&u.to_bits()) {
            return *l;
        }
        let seen = self.partition.stretch(u).seen;
        let l = self.radiance(seen.map(|i| Seen::on(self.world, self.camera, i, u)), u);
        known().insert(u.to_bits(), l);
        l
    }

    /// L at fixed u, for the point seen on one side, and its error.
    fn radiance(&self, seen: Option<Seen>, u: f64) -> [Dual<1>; 2] {
        let none = Dual::constant(0.0);
        let Some(seen) = seen else {
            return [Dual::new(self.world.environment(), [self.change.environment]), none];
        };
        if self.bounces == Some(0) || !may_scatter(self.world, self.change, seen.segment) {
            let shape = self.world.segments()[seen.segment].shape;
            let value = self.world.material(seen.segment).emission;
            return [Dual::new(value, [self.change.materials[shape].emission]), none];
        }
        let motion = motion_of_seen(self.world, self.camera, u, &seen, self.change);
        let surface = Surface::new(self.world, seen.segment, seen.s, -seen.direction);
        self.solution.radiance(&gather(self.world, self.change, surface, seen.segment, motion))
    }

    /// (L⁻ − L⁺) u̇ of a discontinuity over the film; its slope is the error estimate.
    fn step(&self, jump: &Jump) -> Dual<1> {
        let rate = film_rate(self.camera, self.change, jump.vertex, jump.u, jump.distance);
        if rate == 0.0 {
            return Dual::constant(0.0);
        }
        let seen = jump.sides.map(|side| side.map(|i| Seen::at_jump(self.world, self.camera, i, jump)));
        let [low, high] = seen.map(|side| self.radiance(side, jump.u).map(|l| l.value));
        Dual::new((low[0] - high[0]) * rate, [(low[1] + high[1]) * rate.abs()])
    }
}
