//! Singly scattered light in closed form: a sum over the visible intervals from the surface.
//!
//! Over an interval of directions [φ₀, φ₁] in which the radiance is L,
//!
//! ```text
//! diffuse   ρ/2 L (sin φ₁ − sin φ₀)
//! glossy    s L ∫ g(α) cos φ dφ,   α = φ + φ_o,   cos φ = cos α cos φ_o + sin α sin φ_o
//! ```
//!
//! where φ_o is the outgoing direction's angle from the normal. With θ the normal rotates by ψ̇_n, the
//! outgoing direction by ψ̇_o, and the point moves by ẋ. At fixed directions, φ̇ = −ψ̇_n and
//! α̇ = ψ̇_o − 2ψ̇_n: the interior term. The ends of the intervals rotate by
//!
//! ```text
//! ψ̇ = τ·(v̇ − ẋ)/r
//! ```
//!
//! with v the vertex there, r its distance, τ its direction rotated by a right angle: the boundary term Σ f
//! cos φ (L⁻ − L⁺) ψ̇.

use glam::DVec2;

use super::lobe::LobeArc;
use super::visible::{End, Interval, View};
use crate::transport::{Material, MaterialTangent, Tangent, World};

/// A point of a surface seen from one side.
#[derive(Clone, Debug)]
pub struct Surface<'a> {
    world: &'a World,
    material: &'a Material,
    shape: usize,
    view: View,
    /// φ_o.
    outgoing: f64,
    intervals: Vec<Interval>,
}

/// Rates of a surface point and of the direction from which it is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceMotion {
    /// ẋ.
    pub velocity: DVec2,
    /// ψ̇_n, in radians.
    pub normal_turn: f64,
    /// ψ̇_o, in radians.
    pub outgoing_turn: f64,
}

/// Derivative of the radiance that leaves a point of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadianceRate {
    /// At fixed directions.
    pub interior: f64,
    /// From the ends of the visible intervals.
    pub boundary: f64,
    /// Sum of the absolute values of all terms, with the velocities of vertex and point taken separately: if
    /// a point moves with everything it sees, the boundary term consists of their rounding alone.
    pub magnitude: f64,
}

/// ∫ f cos φ dφ and its derivatives over an interval, for unit radiance.
#[derive(Clone, Copy, Debug, Default)]
struct Scattered {
    value: f64,
    rate: f64,
    magnitude: f64,
}

impl<'a> Surface<'a> {
    /// The point of a segment at the parameter s, seen from the side to which the unit vector `outgoing`
    /// points.
    ///
    /// # Panics
    /// If the world has no such segment.
    #[must_use]
    pub fn new(world: &'a World, segment: usize, s: f64, outgoing: DVec2) -> Self {
        let side = world.segments()[segment].normal().dot(outgoing);
        let view = View::of_segment(world, segment, s, side);
        let material = world.material(segment);
        let intervals = view.intervals(world);
        let shape = world.segments()[segment].shape;
        Self { world, material, shape, view, outgoing: view.angle(outgoing), intervals }
    }

    /// The point and the half circle above it.
    #[must_use]
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Visible intervals, also for a black surface, which has a derivative by its reflectance.
    #[must_use]
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// L_e and its derivative.
    pub(super) fn emission(&self, change: &Tangent) -> (f64, f64) {
        (self.material.emission, change.materials[self.shape].emission)
    }

    /// ∫ L_e cos φ dφ: irradiance by direct light.
    #[must_use]
    pub fn irradiance(&self) -> f64 {
        self.intervals.iter().map(|i| emitted(self.world, i.seen) * sine_difference(i)).sum()
    }

    /// L_e plus the direct light scattered towards the outgoing direction.
    #[must_use]
    pub fn radiance(&self) -> f64 {
        let scattered = |i: &Interval| emitted(self.world, i.seen) * self.scattered(i, None).value;
        self.material.emission + self.intervals.iter().map(scattered).sum::<f64>()
    }

    /// Derivative of [`radiance`](Self::radiance).
    ///
    /// # Panics
    /// If the tangent belongs to another world.
    #[must_use]
    pub fn rate(&self, change: &Tangent, motion: &SurfaceMotion) -> RadianceRate {
        let own = &change.materials[self.shape];
        let mut rate = RadianceRate { interior: own.emission, boundary: 0.0, magnitude: own.emission.abs() };
        for interval in &self.intervals {
            let (l, l_rate) =
                (emitted(self.world, interval.seen), emitted_rate(self.world, change, interval));
            if l == 0.0 && l_rate == 0.0 {
                continue;
            }
            let scattered = self.scattered(interval, Some((own, motion)));
            rate.interior += l * scattered.rate + l_rate * scattered.value;
            rate.magnitude += l * scattered.magnitude + (l_rate * scattered.value).abs();
        }
        for pair in self.intervals.windows(2) {
            let [low, high] = [&pair[0], &pair[1]].map(|i| emitted(self.world, i.seen));
            if low != high {
                let end = &pair[1].start;
                let step = self.scattering(end) * (low - high);
                rate.boundary += step * turn(&self.view, end, change, motion.velocity);
                rate.magnitude += step.abs() * turn_magnitude(end, change, motion.velocity);
            }
        }
        rate
    }

    /// f cos φ in the direction of an end.
    fn scattering(&self, end: &End) -> f64 {
        let gloss = self.material.gloss.map_or(0.0, |g| g.strength * g.density(end.angle + self.outgoing));
        (0.5 * self.material.reflectance + gloss) * end.cos
    }

    fn scattered(&self, interval: &Interval, rates: Option<(&MaterialTangent, &SurfaceMotion)>) -> Scattered {
        let mut total = self.diffuse(interval, rates);
        if self.material.gloss.is_some() {
            let glossy = self.glossy(interval, rates);
            total.value += glossy.value;
            total.rate += glossy.rate;
            total.magnitude += glossy.magnitude;
        }
        total
    }

    fn diffuse(&self, interval: &Interval, rates: Option<(&MaterialTangent, &SurfaceMotion)>) -> Scattered {
        let half = 0.5 * self.material.reflectance;
        let sine = sine_difference(interval);
        let (mut rate, mut magnitude) = (0.0, 0.0);
        if let Some((own, motion)) = rates {
            // ∫ sin φ dφ.
            let turned = half * motion.normal_turn * -cosine_difference(interval);
            let dimmed = 0.5 * own.reflectance * sine;
            (rate, magnitude) = (turned + dimmed, turned.abs() + dimmed.abs());
        }
        Scattered { value: half * sine, rate, magnitude }
    }

    fn glossy(&self, interval: &Interval, rates: Option<(&MaterialTangent, &SurfaceMotion)>) -> Scattered {
        let Some(gloss) = &self.material.gloss else { return Scattered::default() };
        let arc = LobeArc::new(gloss, interval.start.angle + self.outgoing, interval.width);
        let (sin_o, cos_o) = self.outgoing.sin_cos();
        // ∫ g cos φ and ∫ g sin φ.
        let on_cosine = |[c, s]: [f64; 2]| c * cos_o + s * sin_o;
        let on_sine = |[c, s]: [f64; 2]| s * cos_o - c * sin_o;
        let moments = arc.moments();
        let cosine = on_cosine(moments);
        let value = gloss.strength * cosine;
        let Some((own, motion)) = rates else { return Scattered { value, ..Scattered::default() } };
        let sine = on_sine(moments);
        // ∫ g' cos φ = Δ(g cos φ) + ∫ g sin φ.
        let ([_, g], g_difference) = arc.ends();
        let difference = g * cosine_difference(interval) + interval.start.cos * g_difference;
        let parts = [
            gloss.strength * (motion.outgoing_turn - 2.0 * motion.normal_turn) * (difference + sine),
            gloss.strength * motion.normal_turn * sine,
            gloss.strength * own.gloss_width * on_cosine(arc.moments_by_width()),
            own.gloss_strength * cosine,
        ];
        Scattered { value, rate: parts.iter().sum(), magnitude: parts.iter().map(|p| p.abs()).sum() }
    }
}

/// Whether a segment scatters light, or does so with θ: a black surface with a rate of its reflectance
/// scatters nothing, but has a derivative.
pub(super) fn may_scatter(world: &World, change: &Tangent, segment: usize) -> bool {
    let material = world.material(segment);
    let rate = &change.materials[world.segments()[segment].shape];
    material.scatters() || rate.reflectance != 0.0 || (material.gloss.is_some() && rate.gloss_strength != 0.0)
}

/// Radiance that a segment emits, or the environment's.
pub(super) fn emitted(world: &World, seen: Option<usize>) -> f64 {
    seen.map_or(world.environment(), |i| world.material(i).emission)
}

fn emitted_rate(world: &World, change: &Tangent, interval: &Interval) -> f64 {
    let of = |i: usize| change.materials[world.segments()[i].shape].emission;
    interval.seen.map_or(change.environment, of)
}

/// ψ̇ of an end of an interval: τ·(v̇ − ẋ)/r; 0 at the ends of the half circle, where f cos φ is 0.
pub(super) fn turn(view: &View, end: &End, change: &Tangent, velocity: DVec2) -> f64 {
    let Some(vertex) = end.vertex else { return 0.0 };
    if end.cos == 0.0 {
        return 0.0;
    }
    view.direction(end).perp().dot(change.vertices[vertex] - velocity) / end.distance
}

/// (|v̇| + |ẋ|)/r, to which the rounding of [`turn`] is relative.
fn turn_magnitude(end: &End, change: &Tangent, velocity: DVec2) -> f64 {
    match end.vertex {
        Some(vertex) if end.cos != 0.0 => {
            (change.vertices[vertex].length() + velocity.length()) / end.distance
        }
        _ => 0.0,
    }
}

/// sin φ₁ − sin φ₀ = 2 cos φ̄ sin(Δφ/2), with cos φ̄ = (cos φ₀ + cos φ₁)/(2 cos(Δφ/2)).
pub(super) fn sine_difference(interval: &Interval) -> f64 {
    let Interval { start, end, width, .. } = interval;
    if *width > 1.0 {
        return end.sin - start.sin;
    }
    (start.cos + end.cos) * (0.5 * width).tan()
}

/// cos φ₁ − cos φ₀ = −2 sin φ̄ sin(Δφ/2).
fn cosine_difference(interval: &Interval) -> f64 {
    let Interval { start, end, width, .. } = interval;
    if *width > 1.0 {
        return end.cos - start.cos;
    }
    -(start.sin + end.sin) * (0.5 * width).tan()
}
