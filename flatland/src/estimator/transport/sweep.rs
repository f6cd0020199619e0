//! Reverse sweep of a sample, to everything that moves it.
//!
//! The tape transposes the derivative of the integrand, with fixed densities and weights. The warps of film
//! and directions, and the discontinuities sampled on edges, are not on the tape: V_k of the direction ω_k
//! sampled at x_k is a linear form in the velocities of the objects around ω_k, relative to ẋ_k. When the
//! sweep reaches a warp, the adjoints (a, b) of (V_k, ∇·V_k) are complete, the form is computed and
//! transposed, and the covector of ẋ_k continues along the tape.
//!
//! Adjoints are separated by [`Terms`]: contributions through a warp of the film belong to the primary term,
//! those through a warp of a direction or a sampled discontinuity to the secondary term, and all others to
//! the interior term.

use glam::DVec2;

use super::record::{Input, Job, Recorded, Recorder, Scratch, WarpRecord};
use super::residual::{Left, left_around};
use super::streams::Streams;
use crate::calculus::{Adjoints, Number as _, Vec2};
use crate::plane::MaterialPoint;
use crate::transport::fields::FieldForm;
use crate::transport::{Bounce, CameraTangent, Covector, Parameters, Paths, Terms};
use crate::warp::LinearField as _;

/// All inputs and outputs of the sweep.
pub(super) struct Sweep<'a, 'b> {
    pub(super) job: &'a Job<'a>,
    pub(super) streams: &'b mut Streams,
    covectors: &'b mut Vec<Covector>,
    pub(super) rays: u64,
}

/// A contribution through the warp of the film.
fn primary(primary: f64) -> Terms<f64> {
    Terms { primary, ..Terms::default() }
}

/// A contribution through the warp of a direction.
fn secondary(secondary: f64) -> Terms<f64> {
    Terms { secondary, ..Terms::default() }
}

impl<'a, 'b> Sweep<'a, 'b> {
    /// Records h (L − L₀) J of a film coordinate drawn for a pixel, and emits its covectors.
    pub(super) fn sample(
        job: &'a Job<'a>,
        pixel: usize,
        control: f64,
        streams: &'b mut Streams,
        Scratch { tape, adjoints, covectors }: &'b mut Scratch,
    ) -> Self {
        let at = job.camera.film.sample(pixel, &mut streams.path);
        let mut recorder = Recorder::new(job, tape, at.u);
        let [u, jacobian] = recorder.film_warp();
        let (radiance, rays) = recorder.radiance(u, &mut streams.path);
        let value = u.chain(at.value, at.slope) * (radiance - Recorded::constant(control)) * jacobian;
        let mut this = Self { job, streams, covectors, rays };
        this.run(&recorder, value, adjoints);
        this
    }

    fn run(&mut self, recorder: &Recorder<'_, '_>, value: Recorded<'_>, adjoints: &mut Vec<Terms<f64>>) {
        let interior = Terms { interior: 1.0, ..Terms::default() };
        recorder.tape.sweep(&[(value, interior)], adjoints, |input, a, earlier| {
            // A warp does not depend on the origin of its adjoints.
            let total = |i: usize| a[i].total();
            match input {
                Input::Parameters(first) => self.emit(first, a),
                Input::FilmWarp => self.film_field(recorder.u, total(0), total(1)),
                Input::Warp(record) => {
                    self.warp(&recorder.warps[record], DVec2::new(total(0), total(1)), total(2), earlier);
                }
                Input::Jumps(record) => self.jump(&recorder.jumps[record], total(0), earlier),
            }
        });
    }

    fn emit(&mut self, first: usize, terms: &[Terms<f64>]) {
        let covectors = terms.iter().enumerate();
        self.covectors.extend(covectors.map(|(i, &terms)| Covector { parameter: first + i, terms }));
    }

    /// Emits the covector of a material point's velocity.
    fn emit_point(&mut self, point: &MaterialPoint, covector: DVec2, term: fn(f64) -> Terms<f64>) {
        for (vertex, weight) in point.vertices().into_iter().zip(point.weights()) {
            if weight != 0.0 {
                let first = Parameters::Vertex(vertex).first(self.job.world);
                self.emit(first, &(weight * covector).to_array().map(term));
            }
        }
    }

    /// Emits the covectors of a V + b ∇·V on the film, the primary term.
    pub(super) fn film_field(&mut self, u: f64, a: f64, b: f64) {
        let Job { world, camera, construction, kernels, .. } = *self.job;
        let field = construction.over_film(world, camera, u, kernels.film, &mut self.streams.auxiliary);
        self.rays += field.rays;
        self.film_form(&field, a, b);
    }

    /// Emits the covectors of a V + b ∇·V on the film, for a given form.
    pub(super) fn film_form(&mut self, field: &FieldForm, a: f64, b: f64) {
        let mut by_camera = CameraTangent::default();
        field.scatter(a, b, |point, covector| {
            // Velocities are relative to the camera's.
            by_camera.position -= covector;
            self.primary_of_point(point, covector);
        });
        by_camera.add(a, &field.camera[0]);
        by_camera.add(b, &field.camera[1]);
        self.primary_of_camera(&by_camera);
    }

    /// Emits the covector of a material point's velocity in the primary term.
    pub(super) fn primary_of_point(&mut self, point: &MaterialPoint, covector: DVec2) {
        self.emit_point(point, covector, primary);
    }

    /// Emits the covector of the camera's rates in the primary term.
    pub(super) fn primary_of_camera(&mut self, covector: &CameraTangent) {
        let first = Parameters::Camera.first(self.job.world);
        self.emit(first, &covector.to_array().map(primary));
    }

    /// a·V + b ∇·V of a direction.
    fn warp(&mut self, warp: &WarpRecord<'_>, a: DVec2, b: f64, earlier: &mut Adjoints<'_, Terms<f64>>) {
        let turning = warp.direction.perp().dot(a);
        if turning == 0.0 && b == 0.0 {
            return;
        }
        let Job { world, construction, .. } = *self.job;
        let field =
            construction.around(world, warp.origin, warp.direction, warp.kappa, &mut self.streams.auxiliary);
        self.rays += field.rays;
        field.scatter(turning, b, |point, covector| {
            self.emit_relative(point, warp.position, covector, earlier);
        });
    }

    /// Emits f cos φ [L⁻ (ψ̇ − V⁻) − L⁺ (ψ̇ − V⁺)] at one random vertex, times `scale`.
    fn jump(&mut self, at: &Bounce<Recorded<'_>>, scale: f64, earlier: &mut Adjoints<'_, Terms<f64>>) {
        let Job { world, paths, edges, construction, .. } = *self.job;
        let (job, rng) = (self.job, &mut self.streams.auxiliary);
        let counts = |vertex| job.may_leave_around(at, vertex);
        let Some((corner, probability)) =
            edges.and_then(|choice| choice.pick(world, at.origin, &at.still, counts, rng))
        else {
            return;
        };
        let towards = world.vertex(corner) - at.origin.point;
        let direction = towards.normalize();
        let value = at.still.value(Vec2::constant(direction));
        if value == 0.0 {
            return;
        }
        // Light was scattered depth + 1 times when it left this surface.
        let rest = Paths { bounces: paths.bounces - at.depth - 1, ..paths };
        let Some((left, rays)) = left_around(job, &rest, at, corner, rng) else { return };
        self.rays += rays;
        let factor = scale * value / probability;
        let difference: f64 = left.iter().map(|side| side.light).sum();
        let covector = towards.perp() * (factor * difference / towards.length_squared());
        self.emit_relative(&MaterialPoint::vertex(corner), at.position, covector, earlier);
        for Left { light, seen, kappa } in left {
            let field = construction.beside(world, at.origin, direction, kappa, seen.as_ref());
            field.scatter(-factor * light, 0.0, |point, covector| {
                self.emit_relative(point, at.position, covector, earlier);
            });
        }
    }

    /// Emits the covector of ẏ − ẋ in the secondary term, for a material point y seen from x on the tape.
    fn emit_relative(
        &mut self,
        point: &MaterialPoint,
        x: Vec2<Recorded<'_>>,
        covector: DVec2,
        earlier: &mut Adjoints<'_, Terms<f64>>,
    ) {
        self.emit_point(point, covector, secondary);
        earlier.add(x.x, secondary(-covector.x));
        earlier.add(x.y, secondary(-covector.y));
    }
}
