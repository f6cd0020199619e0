//! From the end of a path back to the camera: the covectors of every rate that moves its value.
//!
//! The rates are those of theory: with V_k the warp of the direction ω_k sampled at x_k,
//!
//! ```text
//! ψ̇_k = V_k,   ẋ_{k+1} = Π (ẋ_k + t ψ̇_k τ_k) + Q ẋ_material,   Q = ω nᵀ/(n·ω),   Π = I − Q,
//! ```
//!
//! and the derivative of the path's value is that of its integrand along these rates, plus the value
//! times Σ ∇·V_k. Densities and weights are not differentiated. V_k is itself linear in the velocities
//! of what the auxiliary rays see and in ẋ_k.

use glam::DVec2;

use super::fault::Fault;
use super::jumps::{EdgeChoice, jump_radiance};
use super::kernels::Kernels;
use crate::plane::MaterialPoint;
use crate::random::{Stream, open01};
use crate::transport::fields::Construction;
use crate::transport::{
    Camera, CameraTangent, Covector, Light, MaterialTangent, Path, Paths, Scattering, Terms, Vertex, World,
};
use crate::warp::LinearField as _;

/// A number or covector by whether a warp of a direction lies between it and the path's value.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Split<T> {
    pub(super) plain: T,
    pub(super) warped: T,
}

impl<T: Copy + std::ops::Add<Output = T>> Split<T> {
    pub(super) fn total(self) -> T {
        self.plain + self.warped
    }
}

/// The covectors of the rates that a path's value depends on at its first surface: ẋ_1, and the turning
/// of the ray that arrives there.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrival {
    pub(super) position: Split<DVec2>,
    pub(super) angle: Split<f64>,
}

/// Everything the sweep reads and writes.
pub(super) struct Sweep<'a, 'b> {
    pub(super) world: &'a World,
    pub(super) construction: &'a Construction,
    pub(super) kernels: &'a Kernels,
    /// Where jumps over the directions are sampled as such.
    pub(super) edges: Option<EdgePicker>,
    pub(super) fault: Option<Fault>,
    pub(super) geometry: bool,
    pub(super) rng: &'b mut Stream,
    pub(super) covectors: &'b mut Vec<Covector>,
    pub(super) rays: u64,
}

/// How vertices are picked at a surface, and what is seen beside them.
#[derive(Clone, Copy)]
pub(super) struct EdgePicker {
    pub(super) paths: Paths,
    pub(super) choice: EdgeChoice,
}

/// Light that arrives at a surface from one direction, as an integral of its own with a warp field of
/// its own.
struct Incident {
    direction: DVec2,
    /// 1 over the density and whatever else it was drawn by.
    weight: f64,
    /// Radiance times weight, and times what the path is multiplied by before.
    gain: f64,
    kappa: f64,
    /// What the radiance depends on, if it is scattered: the covectors of ẋ_{k+1}, ψ̇_k and the
    /// distance, already divided by the density.
    arrival: Option<(Arrival, f64)>,
}

impl Sweep<'_, '_> {
    /// Sweeps a path of which `scale` times the radiance is differentiated, and returns the covectors
    /// at its first surface.
    pub(super) fn path(&mut self, path: &Path<'_>, scale: f64) -> Arrival {
        // β_k: what the radiance scattered at vertex k is multiplied by.
        let mut throughput = Vec::with_capacity(path.vertices.len());
        let mut beta = scale;
        for vertex in &path.vertices {
            throughput.push(beta);
            if let (Some(s), Some(c)) = (&vertex.scattering, &vertex.continuation) {
                beta *= s.value(c.direction) * c.weight();
            }
        }
        match path.vertices.first() {
            Some(first) => self.emission(first.hit.segment, scale),
            None => self.covectors.push(Covector::Environment(scale)),
        }
        let mut arrival = Arrival::default();
        for (k, vertex) in path.vertices.iter().enumerate().rev() {
            arrival = self.vertex(path, k, vertex, throughput[k], arrival);
        }
        arrival
    }

    /// The covectors at vertex k from those at vertex k + 1, which `scale` is already part of.
    fn vertex(
        &mut self,
        path: &Path<'_>,
        k: usize,
        vertex: &Vertex<'_>,
        scale: f64,
        next: Arrival,
    ) -> Arrival {
        let Some(scattering) = &vertex.scattering else { return Arrival::default() };
        let mut out = Arrival::default();
        if let Some(picker) = self.edges.filter(|_| self.geometry) {
            self.edge(picker, k, vertex, scattering, scale, &mut out);
        }
        if let Some(light) = &vertex.emitter {
            self.light(k, vertex, scattering, light, scale, &mut out);
        }
        if let Some(c) = &vertex.continuation {
            if let Some(light) = &c.light {
                self.light(k, vertex, scattering, light, scale, &mut out);
            }
            let gain = scale * c.weight() * path.arriving(self.world, k);
            let following = path.vertices.get(k + 1);
            if following.is_none() {
                let value = scattering.value(c.direction);
                self.covectors.push(Covector::Environment(scale * c.weight() * value));
            }
            let kappa = self.kernels.surface(scattering.material, None);
            let arrival = following.map(|f| (self.before(f, next), f.hit.distance));
            self.incident(
                k,
                vertex,
                scattering,
                &Incident { direction: c.direction, weight: c.weight(), gain, kappa, arrival },
                &mut out,
            );
        }
        out
    }

    /// Emitted light.
    fn light(
        &mut self,
        k: usize,
        vertex: &Vertex<'_>,
        scattering: &Scattering<'_>,
        light: &Light,
        scale: f64,
        out: &mut Arrival,
    ) {
        let weight = scale * light.weight;
        self.emission(light.segment, weight * scattering.value(light.direction));
        let gain = weight * light.emission(self.world);
        if gain != 0.0 {
            let kappa = self.kernels.surface(scattering.material, Some(light.subtended));
            if self.fault == Some(Fault::AttachedDensity) {
                self.attach_emitter(vertex, scattering, light, gain, out);
            }
            let incident =
                Incident { direction: light.direction, weight: light.weight, gain, kappa, arrival: None };
            self.incident(k, vertex, scattering, &incident, out);
        }
    }

    /// The mistake of differentiating the density 1/Δ of directions towards an emitter, where Δ is the
    /// angle it subtends.
    fn attach_emitter(
        &mut self,
        vertex: &Vertex<'_>,
        scattering: &Scattering<'_>,
        light: &Light,
        gain: f64,
        out: &mut Arrival,
    ) {
        let share = 1.0 - light.weight * scattering.density(light.direction);
        let segment = &self.world.segments()[light.segment];
        let ends = segment.ends().map(|p| p - vertex.origin.point);
        let sign = ends[0].perp_dot(ends[1]).signum();
        let scale = gain * scattering.value(light.direction) * share * sign / light.subtended;
        for ((v, end), side) in segment.vertices.into_iter().zip(ends).zip([-scale, scale]) {
            let interior = end.perp() * (side / end.length_squared());
            out.position.plain -= interior;
            let terms = Terms { interior, ..Terms::default() };
            self.covectors.push(Covector::Point(MaterialPoint::vertex(v), terms));
        }
    }

    /// f cos φ L/p: its slopes, and the warp of its direction.
    fn incident(
        &mut self,
        k: usize,
        vertex: &Vertex<'_>,
        scattering: &Scattering<'_>,
        incident: &Incident,
        out: &mut Arrival,
    ) {
        let Incident { direction, weight, gain, kappa, arrival } = incident;
        let mut slopes = scattering.slopes(*direction);
        if self.fault == Some(Fault::AttachedDensity) {
            slopes =
                slopes.attached(scattering.density_slopes(*direction), *weight, scattering.value(*direction));
        }
        let segment = &self.world.segments()[vertex.hit.segment];
        let mut material = MaterialTangent::default();
        material.add(*gain, &slopes.material);
        self.covectors.push(Covector::Material(segment.shape, material));
        if !self.geometry {
            return;
        }
        for (v, covector) in segment.vertices.into_iter().zip(segment.turning_rate()) {
            let terms = Terms { interior: covector * (gain * slopes.normal), ..Terms::default() };
            self.covectors.push(Covector::Point(MaterialPoint::vertex(v), terms));
        }
        out.angle.plain += gain * slopes.outgoing;
        // The covector of ψ̇ at fixed x_k, to which the warp answers.
        let mut turning = gain * slopes.incoming;
        if let Some((arrival, distance)) = arrival {
            out.position.plain += arrival.position.plain;
            out.position.warped += arrival.position.warped;
            turning += arrival.angle.total() + distance * direction.perp().dot(arrival.position.total());
        }
        let value = gain * scattering.value(*direction);
        if turning == 0.0 && value == 0.0 {
            return;
        }
        let construction = match self.fault {
            Some(Fault::NoWarpFrom { surface }) if k >= surface => &Construction::Still,
            _ => self.construction,
        };
        let field = construction.around(self.world, vertex.origin, *direction, *kappa, self.rng);
        self.rays += field.rays;
        field.scatter(turning, value, |point, secondary| {
            // A velocity relative to that of the origin.
            out.position.warped -= secondary;
            self.covectors.push(Covector::Point(*point, Terms { secondary, ..Terms::default() }));
        });
    }

    /// Takes the covector of the position of a hit back to the ray's start, along the ray: the part
    /// that is the material's is emitted, and the rest is that of ẋ_k + t ψ̇ τ.
    pub(super) fn before(&mut self, vertex: &Vertex<'_>, arrival: Arrival) -> Arrival {
        let segment = &self.world.segments()[vertex.hit.segment];
        let (direction, normal) = (vertex.arriving, segment.normal());
        let material = |a: DVec2| normal * (direction.dot(a) / normal.dot(direction));
        let Split { plain, warped } = arrival.position;
        let (interior, secondary) = (material(plain), material(warped));
        let point = segment.material_point(vertex.hit.s);
        self.covectors.push(Covector::Point(point, Terms { interior, primary: DVec2::ZERO, secondary }));
        let position = Split { plain: plain - interior, warped: warped - secondary };
        Arrival { position, angle: arrival.angle }
    }

    /// f cos φ (L⁻ − L⁺) ψ̇ at one vertex.
    fn edge(
        &mut self,
        picker: EdgePicker,
        k: usize,
        vertex: &Vertex<'_>,
        scattering: &Scattering<'_>,
        scale: f64,
        out: &mut Arrival,
    ) {
        // Where nothing is scattered no random number may be drawn: forward mode does not come here.
        if scale == 0.0 || !scattering.material.scatters() {
            return;
        }
        let Some((corner, probability)) = self.pick(picker.choice, vertex, scattering) else { return };
        let towards = self.world.vertex(corner) - vertex.origin.point;
        let direction = towards.normalize();
        let value = scattering.value(direction);
        if value == 0.0 {
            return;
        }
        // Light was scattered k + 1 times when it left this surface.
        let rest = Paths { bounces: picker.paths.bounces - k - 1, ..picker.paths };
        let seen = jump_radiance(self.world, &rest, vertex.origin, corner, self.rng);
        let Some((difference, rays)) = seen else { return };
        self.rays += rays;
        let secondary =
            towards.perp() * (scale * value * difference / (probability * towards.length_squared()));
        out.position.warped -= secondary;
        let point = MaterialPoint::vertex(corner);
        self.covectors.push(Covector::Point(point, Terms { secondary, ..Terms::default() }));
    }

    /// A vertex and its probability. The ends of the surface itself lie on its horizon, where nothing
    /// is scattered.
    fn pick(
        &mut self,
        choice: EdgeChoice,
        vertex: &Vertex<'_>,
        scattering: &Scattering<'_>,
    ) -> Option<(usize, f64)> {
        let own = self.world.segments()[vertex.hit.segment].vertices;
        let count = self.world.vertex_count();
        if choice == EdgeChoice::Uniform {
            let picked = ((open01(self.rng) * count as f64) as usize).min(count - 1);
            return (!own.contains(&picked)).then_some((picked, 1.0 / count as f64));
        }
        let weight = |(v, p): (usize, DVec2)| {
            let d = p - vertex.origin.point;
            if own.contains(&v) { 0.0 } else { scattering.value(d.normalize()) / d.length() }
        };
        let weights: Vec<f64> = self.world.vertices().enumerate().map(weight).collect();
        let sum: f64 = weights.iter().sum();
        let mut rest = open01(self.rng) * sum;
        let mut picked = None;
        for (v, &weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            picked = Some((v, weight / sum));
            if rest < weight {
                break;
            }
            rest -= weight;
        }
        picked
    }

    fn emission(&mut self, segment: usize, weight: f64) {
        let shape = self.world.segments()[segment].shape;
        let change = MaterialTangent { emission: weight, ..MaterialTangent::default() };
        self.covectors.push(Covector::Material(shape, change));
    }
}

/// What the first ray depends on: emits the camera's covectors at a fixed film coordinate, and returns
/// the covector of u̇.
pub(super) fn first_ray(
    sweep: &mut Sweep<'_, '_>,
    camera: &Camera,
    u: f64,
    vertex: &Vertex<'_>,
    arrival: Arrival,
) -> f64 {
    let before = sweep.before(vertex, arrival);
    let tangent = vertex.arriving.perp();
    let turning = |position: DVec2, angle: f64| angle + vertex.hit.distance * tangent.dot(position);
    let (per_u, rate) = camera.direction_rate(u);
    let covector = |position: DVec2, angle: f64| {
        let mut c = CameraTangent { position, ..CameraTangent::default() };
        c.add(turning(position, angle), &rate);
        c
    };
    let (p, a) = (before.position, before.angle);
    sweep.covectors.push(Covector::Camera(Terms {
        interior: covector(p.plain, a.plain),
        secondary: covector(p.warped, a.warped),
        ..Default::default()
    }));
    per_u * turning(p.total(), a.total())
}
