//! A sample recorded on a tape, for the sweep that computes its derivatives by all parameters at once.

use glam::DVec2;

use super::fault::Fault;
use super::jumps::EdgeChoice;
use super::kernels::Kernels;
use crate::calculus::{Number, Tape, Variable, Vec2};
use crate::random::Stream;
use crate::transport::fields::Construction;
use crate::transport::{
    ActiveParameters, Bounce, Calculus, Camera, Covector, Material, Origin, Parameters, Paths, Terms, Warped,
    World, subtended,
};

/// Data shared by all samples.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(super) world: &'a World,
    pub(super) camera: &'a Camera,
    pub(super) active: ActiveParameters,
    /// Paths per pixel.
    pub(super) samples: usize,
    /// Seed of all streams.
    pub(super) seed: u64,
    pub(super) paths: Paths,
    pub(super) construction: Construction,
    pub(super) kernels: Kernels,
    /// Selection of discontinuities, if the field has a residual.
    pub(super) edges: Option<EdgeChoice>,
    pub(super) fault: Option<Fault>,
}

impl Job<'_> {
    /// κ at a surface, for the light of one emitting segment or for all scattered light.
    pub(super) fn kappa<T>(&self, at: &Bounce<T>, emitter: Option<usize>) -> f64 {
        let subtended = emitter.map(|segment| subtended(self.world, segment, at.origin.point));
        self.kernels.surface(&at.still.material, subtended)
    }
}

/// Inputs of a tape.
#[derive(Clone, Copy, Debug)]
pub(super) enum Input {
    /// Parameters from this index on, in the order of [`Tangent::values`](crate::transport::Tangent::values).
    Parameters(usize),
    /// The film coordinate and the Jacobian of its warp.
    FilmWarp,
    /// A direction and the Jacobian of its warp, by the index of its record.
    Warp(usize),
    /// Light at discontinuities that no warp follows, by the index of its record.
    Jumps(usize),
}

/// A number on the tape.
pub(super) type Recorded<'t> = Variable<'t, Input>;

/// A warped direction. Its field is computed when the sweep reaches it, and only if something depends on it.
pub(super) struct WarpRecord<'t> {
    pub(super) origin: Origin,
    pub(super) position: Vec2<Recorded<'t>>,
    pub(super) direction: DVec2,
    /// Concentration of the field's kernel.
    pub(super) kappa: f64,
}

/// Memory of a sample.
#[derive(Default)]
pub(super) struct Scratch {
    pub(super) tape: Tape<Input>,
    pub(super) adjoints: Vec<Terms<f64>>,
    pub(super) covectors: Vec<Covector>,
}

impl Scratch {
    /// Clears it, keeping the memory.
    pub(super) fn clear(&mut self) {
        self.tape.clear();
        self.covectors.clear();
    }
}

/// The calculus of the tape.
pub(super) struct Recorder<'j, 't> {
    pub(super) job: &'j Job<'j>,
    pub(super) tape: &'t Tape<Input>,
    pub(super) u: f64,
    pub(super) warps: Vec<WarpRecord<'t>>,
    pub(super) jumps: Vec<Bounce<Recorded<'t>>>,
}

impl<'j, 't> Recorder<'j, 't> {
    /// An empty record for a sample at the film coordinate u.
    pub(super) fn new(job: &'j Job<'_>, tape: &'t Tape<Input>, u: f64) -> Self {
        Self { job, tape, u, warps: vec![], jumps: vec![] }
    }

    /// u + ε V(u) and the Jacobian 1 + ε V'(u) of the film's warp.
    pub(super) fn film_warp(&self) -> [Recorded<'t>; 2] {
        let Job { active, construction, .. } = *self.job;
        let is_warped = active.geometry && construction != Construction::Still;
        self.inputs(is_warped, Input::FilmWarp, [self.u, 1.0])
    }

    /// One sample of the radiance at a film coordinate, and the number of rays.
    pub(super) fn radiance(&mut self, at: Recorded<'t>, rng: &mut Stream) -> (Recorded<'t>, u64) {
        let Job { world, camera, active, paths, .. } = *self.job;
        let DVec2 { x, y } = camera.position;
        let values = [x, y, camera.angle, camera.field_of_view];
        let [x, y, angle, field_of_view] = self.parameters(active.geometry, Parameters::Camera, values);
        let direction = camera.film.direction(at, angle, field_of_view);
        let seen = world.trace(Origin::free(camera.position), direction.value());
        paths.radiance(world, self, [Vec2::new(x, y), direction], seen, rng)
    }

    fn inputs<const K: usize>(&self, active: bool, input: Input, values: [f64; K]) -> [Recorded<'t>; K] {
        if active { self.tape.inputs(input, values) } else { values.map(Recorded::constant) }
    }

    fn parameters<const K: usize>(
        &self,
        active: bool,
        of: Parameters,
        values: [f64; K],
    ) -> [Recorded<'t>; K] {
        self.inputs(active, Input::Parameters(of.first(self.job.world)), values)
    }
}

impl<'t> Calculus for Recorder<'_, 't> {
    type Number = Recorded<'t>;

    fn ends(&self, segment: usize) -> [Vec2<Recorded<'t>>; 2] {
        let segment = &self.job.world.segments()[segment];
        [(segment.vertices[0], segment.start), (segment.vertices[1], segment.end)].map(|(vertex, p)| {
            let [x, y] = self.parameters(self.job.active.geometry, Parameters::Vertex(vertex), p.to_array());
            Vec2::new(x, y)
        })
    }

    fn material(&self, segment: usize) -> Material<Recorded<'t>> {
        let Job { world, active, .. } = *self.job;
        let of = Parameters::Material(world.segments()[segment].shape);
        world.material(segment).with(|values| self.parameters(active.materials, of, values))
    }

    fn environment(&self) -> Recorded<'t> {
        self.parameters(true, Parameters::Environment, [self.job.world.environment()])[0]
    }

    fn wants_black(&self) -> bool {
        self.job.active.materials
    }

    fn warp(
        &mut self,
        at: &Bounce<Recorded<'t>>,
        direction: DVec2,
        emitter: Option<usize>,
    ) -> Warped<Recorded<'t>> {
        let Job { active, construction, fault, .. } = *self.job;
        let &Bounce { depth, origin, position, .. } = at;
        let is_skipped = matches!(fault, Some(Fault::NoWarpFrom { surface }) if depth >= surface);
        let is_warped = active.geometry && construction != Construction::Still && !is_skipped;
        let input = Input::Warp(self.warps.len());
        if is_warped {
            let kappa = self.job.kappa(at, emitter);
            self.warps.push(WarpRecord { origin, position, direction, kappa });
        }
        let [x, y, jacobian] = self.inputs(is_warped, input, [direction.x, direction.y, 1.0]);
        Warped { direction: Vec2::new(x, y), jacobian }
    }

    fn jumps(&mut self, at: &Bounce<Recorded<'t>>) -> Recorded<'t> {
        // Without scattering no random number may be drawn, as in forward mode.
        let is_sampled = self.job.active.geometry && self.job.edges.is_some() && at.still.material.scatters();
        let input = Input::Jumps(self.jumps.len());
        if is_sampled {
            self.jumps.push(*at);
        }
        self.inputs(is_sampled, input, [0.0])[0]
    }

    fn weight(&self, density: f64, attached: impl FnOnce() -> Recorded<'t>) -> Recorded<'t> {
        let one = Recorded::constant(1.0);
        match self.job.fault {
            Some(Fault::AttachedDensity) => one / attached(),
            _ => one / Recorded::constant(density),
        }
    }
}
