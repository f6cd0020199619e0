//! Waves: paths of neighbouring cells, traced together.
//!
//! Vertices are shaded in SIMD lanes, with the bits of [`Paths::still_radiance`]. A path that meets an
//! unsupported material leaves the wave and continues alone. Paths with common random numbers sample the same
//! light point and the same direction about their normals: random quantities are computed once for all of
//! them, and their shadow rays are traced as fans.

mod emitted;
mod faces;
mod row;
mod step;
mod tables;

use flatland::calculus::{Rgb, Vec3};
use glam::DVec3;

use self::faces::{Face, Faces, Finish, smooth_normal};
use self::row::{Arrival, ROWS, Shade, Vectors, Vertices, lanes_where};
use self::step::{LaneDraws, Step};
pub(crate) use self::tables::WaveTables;
use super::chain::Trail;
use super::integrator::Paths;
use super::plain::Plain;
use super::scattered::Scattered;
use super::sequence::Draws;
use crate::geometry::{Goal, Shadows, Sheaf};
use crate::lanes::{WIDTH, next};
use crate::scene::{Hit, Surface, traced_by_this_thread};

/// State of eight paths.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Bit mask of active lanes; these have a hit.
    active: u32,
    origin: Vectors,
    direction: Vectors,
    throughput: Vectors,
    total: Vectors,
    hits: [Option<Hit>; WIDTH],
    /// The hit triangles.
    triangles: [u32; WIDTH],
    arrival: Arrival,
    vertices: Vertices,
}

impl Row {
    const EMPTY: Self = Self {
        active: 0,
        origin: Vectors::ZERO,
        direction: Vectors::ZERO,
        throughput: Vectors::ZERO,
        total: Vectors::ZERO,
        hits: [None; WIDTH],
        triangles: [0; WIDTH],
        arrival: Arrival::EMPTY,
        vertices: Vertices::EMPTY,
    };

    /// Adds to the radiance of a path.
    fn add(&mut self, lane: usize, radiance: [f64; 3]) {
        let total = self.total.at(lane);
        self.total.set(lane, [0, 1, 2].map(|c| total[c] + radiance[c]));
    }
}

/// Active paths.
pub(crate) struct Wave<'p> {
    paths: &'p Paths<'p>,
    tables: &'p WaveTables,
    rows: Box<[Row; ROWS]>,
    /// Rays from the vertices towards a light, and in sampled directions.
    towards: Sheaf,
    onwards: Sheaf,
    /// Distances to the light.
    distances: [f64; Sheaf::MOST],
    /// Number of rays traced for each path.
    traced: [u64; Sheaf::MOST],
}

impl<'p> Wave<'p> {
    /// Largest number of paths of a wave.
    pub(crate) const MOST: usize = Sheaf::MOST;

    pub(crate) fn new(paths: &'p Paths<'p>, tables: &'p WaveTables) -> Self {
        let sheaf = Sheaf { near: paths.scene.rounding(), ..Sheaf::EMPTY };
        let rows = Box::new([Row::EMPTY; ROWS]);
        let (distances, traced) = ([0.0; Sheaf::MOST], [0; Sheaf::MOST]);
        Self { paths, tables, rows, towards: sheaf, onwards: sheaf, distances, traced }
    }

    /// Number of rays traced for each of the last paths, without camera rays.
    pub(crate) fn traced(&self) -> &[u64] {
        &self.traced
    }

    fn count_traced(&mut self, members: u32) {
        for (at, traced) in self.traced.iter_mut().enumerate() {
            *traced += u64::from(members >> at & 1);
        }
    }

    /// [`Paths::still_radiance`] of camera rays with one origin and common random numbers.
    pub(crate) fn radiances_alike(
        &mut self,
        origin: DVec3,
        rays: impl Iterator<Item = (DVec3, Option<Hit>)>,
        draws: Draws<'_>,
        radiances: &mut [DVec3],
    ) {
        self.follow(origin, rays, LaneDraws::Alike(draws), radiances);
    }

    /// [`Paths::still_radiance`] of camera rays with separate random numbers; results beyond the rays are
    /// meaningless.
    pub(crate) fn radiances(
        &mut self,
        origin: DVec3,
        rays: impl Iterator<Item = (DVec3, Option<Hit>)>,
        draws: [Draws<'_>; Sheaf::MOST],
        radiances: &mut [DVec3],
    ) {
        self.follow(origin, rays, LaneDraws::Own(draws), radiances);
    }

    fn follow(
        &mut self,
        origin: DVec3,
        rays: impl Iterator<Item = (DVec3, Option<Hit>)>,
        mut draws: LaneDraws<'_>,
        radiances: &mut [DVec3],
    ) {
        self.begin(origin, rays);
        let limit = self.paths.limit();
        for depth in 1..limit {
            if self.rows.iter().all(|row| row.active == 0) {
                break;
            }
            let alone = depth >= self.paths.scene.description.integrator.rr_depth;
            let active = [0, 1].map(|row: usize| self.rows[row].active);
            let step = Step::draw(self.paths, &mut draws, active, (depth, depth + 1 < limit));
            for row in 0..ROWS {
                if alone {
                    self.leave(row, self.rows[row].active, &step);
                } else if self.rows[row].active != 0 {
                    self.shade(row, &step);
                }
            }
            self.leave_vertices();
            self.aim(&step);
            let traced = self.scatter(&step);
            self.light(&step);
            self.arrive_at_hits(traced, step.goes_on);
        }
        for (at, radiance) in radiances.iter_mut().enumerate() {
            *radiance = self.rows[at / WIDTH].total.of(at % WIDTH);
        }
    }

    /// Starts paths at their first hits.
    fn begin(&mut self, origin: DVec3, rays: impl Iterator<Item = (DVec3, Option<Hit>)>) {
        let scene = self.paths.scene;
        let hides = scene.description.hide_emitters;
        self.traced = [0; Self::MOST];
        for row in self.rows.iter_mut() {
            row.active = 0;
        }
        for (at, (direction, hit)) in rays.enumerate() {
            let (row, lane) = (&mut self.rows[at / WIDTH], at % WIDTH);
            row.origin.set(lane, origin.to_array());
            row.direction.set(lane, direction.to_array());
            row.throughput.set(lane, [1.0; 3]);
            row.hits[lane] = hit;
            let seen = match hit {
                _ if hides => None,
                Some(hit) => scene.emitting(&hit, direction).map(|_| self.paths.radiance_of(hit.surface)),
                None => self.tables.environment,
            };
            row.total.set(lane, seen.unwrap_or(DVec3::ZERO).to_array());
            row.active |= u32::from(hit.is_some()) << lane;
        }
    }

    /// Continues paths alone from their current vertices.
    fn leave(&mut self, at: usize, mut lanes: u32, step: &Step<'_>) {
        let row = &mut self.rows[at];
        row.active &= !lanes;
        while lanes != 0 {
            let lane = next(&mut lanes);
            let (origin, direction) =
                (Vec3::constant(row.origin.of(lane)), Vec3::constant(row.direction.of(lane)));
            let throughput = Rgb(row.throughput.at(lane));
            let path = Scattered::underway(origin, direction, throughput, row.hits[lane]);
            let mut total = Rgb(row.total.at(lane));
            let calculus = &mut Plain { scene: self.paths.scene };
            let before = traced_by_this_thread();
            self.paths.follow(
                calculus,
                path,
                step.depth,
                &mut Trail::new(),
                &mut total,
                &mut step.before.of(at * WIDTH + lane).clone(),
            );
            self.traced[at * WIDTH + lane] += traced_by_this_thread() - before;
            row.total.set(lane, total.0);
        }
    }

    /// Shades the next vertices of a row.
    fn shade(&mut self, row: usize, step: &Step<'_>) {
        let others = self.arrive(row);
        self.leave(row, others, step);
        let Row { origin, direction, throughput, arrival, vertices, .. } = &mut self.rows[row];
        self.tables.instructions.run(Shade {
            origin,
            direction,
            throughput,
            arrival,
            lamps: &step.lamps[row],
            local: &step.locals[row],
            vertices,
        });
        let reflects = &self.rows[row].vertices.reflects;
        let (reflecting, odd) = (lanes_where(reflects, |x| x == 1.0), lanes_where(reflects, f64::is_nan));
        self.leave(row, odd & self.rows[row].active, step);
        self.rows[row].active &= reflecting;
    }

    /// Looks up the hits of a row. Paths that end there are removed; returns the paths that must continue
    /// alone.
    fn arrive(&mut self, row: usize) -> u32 {
        let Faces { faces, finishes } = &self.tables.faces;
        let row = &mut self.rows[row];
        let (mut lanes, mut others) = (row.active, 0);
        while lanes != 0 {
            let lane = next(&mut lanes) % WIDTH;
            let Some(hit @ Hit { surface: Surface::Triangle(triangle), .. }) = row.hits[lane] else {
                others |= 1 << lane;
                continue;
            };
            let &Face { corner, cross, normal, shape, is_smooth } = &faces[triangle as usize];
            let (reflectance, two_sided) = match &finishes[shape as usize] {
                Finish::Matt { reflectance, two_sided } => (*reflectance, *two_sided),
                Finish::Black => {
                    row.active &= !(1 << lane);
                    continue;
                }
                Finish::Other => {
                    others |= 1 << lane;
                    continue;
                }
            };
            row.triangles[lane] = triangle;
            row.arrival.corner.set(lane, corner);
            row.arrival.cross.set(lane, cross);
            row.arrival.reflectance.set(lane, reflectance);
            row.arrival.two_sided[lane] = f64::from(u8::from(two_sided));
            let own = if is_smooth {
                smooth_normal(self.paths.scene, row.origin.of(lane), row.direction.of(lane), &hit).to_array()
            } else {
                normal
            };
            row.arrival.own.set(lane, own);
        }
        others
    }

    /// Sets the vertices of all rows as origins of rays.
    fn leave_vertices(&mut self) {
        for (at, row) in self.rows.iter().enumerate() {
            let lanes = at * WIDTH..(at + 1) * WIDTH;
            for sheaf in [&mut self.towards, &mut self.onwards] {
                for (all, own) in sheaf.origins.iter_mut().zip(&row.vertices.position.0) {
                    all[lanes.clone()].copy_from_slice(own);
                }
                sheaf.from[lanes.clone()].copy_from_slice(&row.triangles);
            }
        }
    }

    /// Aims shadow rays at the light.
    fn aim(&mut self, step: &Step<'_>) {
        self.towards.members = 0;
        self.towards.target = step.targets;
        for (at, row) in self.rows.iter().enumerate() {
            let members = row.active & lanes_where(&row.vertices.may_see, |x| x == 1.0);
            self.towards.members |= members << (at * WIDTH);
            let lanes = at * WIDTH..(at + 1) * WIDTH;
            for (all, own) in self.towards.directions.iter_mut().zip(&row.vertices.towards.0) {
                all[lanes.clone()].copy_from_slice(own);
            }
            self.distances[lanes].copy_from_slice(&row.vertices.distance);
        }
        self.towards.far = self.distances.map(|distance| self.paths.scene.short_of(distance));
    }

    /// Aims rays in the sampled directions. Returns those whose first hits matter; for the others, only
    /// whether they reach the environment does.
    fn scatter(&mut self, step: &Step<'_>) -> u32 {
        let (mut traced, mut escaping) = (0, 0);
        let lights = &self.paths.lights;
        for (at, row) in self.rows.iter_mut().enumerate() {
            let mut sampled = row.active & lanes_where(&row.vertices.goes_on, |x| x == 1.0);
            row.active = 0;
            for (all, own) in self.onwards.directions.iter_mut().zip(&row.vertices.sampled.0) {
                all[at * WIDTH..(at + 1) * WIDTH].copy_from_slice(own);
            }
            if step.goes_on {
                traced |= sampled << (at * WIDTH);
                continue;
            }
            while sampled != 0 {
                let lane = next(&mut sampled) % WIDTH;
                let (x, direction) = (row.vertices.position.of(lane), row.vertices.sampled.of(lane));
                let kind = if lights.may_be_hit(x, direction) { &mut traced } else { &mut escaping };
                *kind |= 1 << (at * WIDTH + lane);
            }
        }
        self.onwards.far = [f64::INFINITY; Self::MOST];
        self.onwards.members = if self.tables.environment.is_some() { escaping } else { 0 };
        traced
    }

    /// Adds the reflected light, and the light of the environment for rays of which only the escape matters.
    fn light(&mut self, step: &Step<'_>) {
        let goal = step.common.map(|point| Goal { point, distances: &self.distances });
        let towards = Shadows { sheaf: &self.towards, end: goal.as_ref() };
        let onwards = Shadows { sheaf: &self.onwards, end: None };
        let [dark, hidden] = self.paths.scene.shadowed_sheaves(&[towards, onwards]);
        self.count_traced(self.towards.members);
        self.count_traced(self.onwards.members);
        let mut lit = self.towards.members & !dark;
        while lit != 0 {
            let at = next(&mut lit) % Self::MOST;
            let (row, lane) = (&mut self.rows[at / WIDTH], at % WIDTH);
            row.add(lane, row.vertices.lit.at(lane));
        }
        let mut free = self.onwards.members & !hidden;
        while free != 0 {
            self.escape(next(&mut free) % Self::MOST);
        }
    }

    /// Continues some of the sampled directions to their hits.
    fn arrive_at_hits(&mut self, mut traced: u32, goes_on: bool) {
        let (paths, scene) = (self.paths, self.paths.scene);
        let mut hits = [None; Self::MOST];
        self.onwards.members = traced;
        scene.closest_sheaf(&self.onwards, &mut hits);
        self.count_traced(traced);
        while traced != 0 {
            let at = next(&mut traced) % Self::MOST;
            let Some(hit) = hits[at].map(Hit::from) else {
                self.escape(at);
                continue;
            };
            let (row, lane) = (&mut self.rows[at / WIDTH], at % WIDTH);
            let direction = row.vertices.sampled.of(lane);
            if scene.emitting(&hit, direction).is_some() {
                let found = paths.found(row, lane, &hit);
                row.add(lane, found);
            }
            row.active |= u32::from(goes_on) << lane;
            row.hits[lane] = Some(hit);
            row.origin.set(lane, row.vertices.position.at(lane));
            row.direction.set(lane, row.vertices.sampled.at(lane));
            row.throughput.set(lane, row.vertices.throughput.at(lane));
        }
    }

    /// Adds the environment along the sampled direction.
    fn escape(&mut self, at: usize) {
        let Some(environment) = self.tables.environment else { return };
        let (row, lane) = (&mut self.rows[at / WIDTH], at % WIDTH);
        let behind = row.vertices.throughput.at(lane);
        row.add(lane, [0, 1, 2].map(|c| behind[c] * environment[c]));
    }
}
