//! Minimum of an implicit function along a segment of a ray.

use flatland::sdf::shapes::Ball;
use flatland::sdf::{Jet, Sdf};
use glam::DVec3;

use crate::scene::ImplicitShape;

/// Tolerance of a refined minimum, as a fraction of the chord.
const EXACT: f64 = 1e-11;

/// Maximum number of refinement steps: every other one halves the bracket, so that where φ has a kink it is
/// known to 2⁻³⁰ of it.
const REFINEMENTS: usize = 60;

/// A ray and the segment of it that is searched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    origin: DVec3,
    direction: DVec3,
    near: f64,
    far: f64,
}

impl Chord {
    /// The segment of a ray within a ball; for a ray that misses it, the one point nearest to its centre.
    pub(super) fn new(origin: DVec3, direction: DVec3, ball: &Ball<DVec3>) -> Self {
        let way = ball.centre() - origin;
        let middle = way.dot(direction);
        let foot = (way - middle * direction).length();
        let half = ((ball.radius() - foot) * (ball.radius() + foot)).max(0.0).sqrt();
        let (near, far) = ((middle - half).max(0.0), (middle + half).max(0.0));
        Self { origin, direction, near, far }
    }

    /// The points that divide it into `parts` parts, including its ends; one point if it has no length.
    pub(super) fn divided(&self, parts: usize) -> impl Iterator<Item = DVec3> {
        let parts = if self.far > self.near { parts } else { 0 };
        let spacing = (self.far - self.near) / parts.max(1) as f64;
        (0..=parts).map(move |k| self.at(self.near + spacing * k as f64))
    }

    fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}

/// The least value found so far, and its point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Least {
    pub(super) point: DVec3,
    pub(super) jet: Jet<DVec3>,
}

/// A point at which φ or ∇φ is not finite, and φ there.
#[derive(Clone, Copy, Debug)]
pub(super) struct NotFinite {
    pub(super) point: DVec3,
    pub(super) value: f64,
}

/// Settings of the search on one surface.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    shape: &'a ImplicitShape,
    samples: usize,
    /// The bounds on |∇φ| where φ > 0, and everywhere.
    outside: f64,
    everywhere: f64,
}

/// A point along a ray, and the derivative of φ there.
#[derive(Clone, Copy)]
struct Place {
    t: f64,
    slope: f64,
    jet: Jet<DVec3>,
}

impl<'a> Search<'a> {
    pub(super) fn new(shape: &'a ImplicitShape, samples: usize) -> Self {
        let (outside, everywhere) = (shape.slope_bound(), shape.slope_bound_everywhere());
        Self { shape, samples: samples.max(1), outside, everywhere }
    }

    /// The least φ along a chord, or `None` as soon as a value of at most `enough` is found.
    pub(super) fn least(&self, chord: &Chord, enough: f64) -> Result<Option<Least>, NotFinite> {
        let count = if chord.far > chord.near { self.samples } else { 0 };
        let spacing = (chord.far - chord.near) / count.max(1) as f64;
        let place = |k: usize| chord.near + spacing * k as f64;
        let mut best = (count / 2, self.value(chord, place(count / 2))?);
        let mut k = 0;
        while k <= count && best.1 > enough {
            let value = self.value(chord, place(k))?;
            if value < best.1 {
                best = (k, value);
            }
            // The samples up to this distance cannot be less than the best.
            let bound = if best.1 >= 0.0 { self.outside } else { self.everywhere };
            let skipped = ((value - best.1) / (bound * spacing)) as usize;
            k = k.saturating_add(1).saturating_add(skipped);
        }
        if best.1 <= enough {
            return Ok(None);
        }
        let around = (place(best.0.saturating_sub(1)), place((best.0 + 1).min(count)));
        let least = self.refined(chord, place(best.0), around)?;
        Ok((least.jet.value > enough).then_some(least))
    }

    /// Refines the minimum next to the best sample, where ∇φ·ω changes its sign, between the samples around
    /// it.
    fn refined(&self, chord: &Chord, sample: f64, around: (f64, f64)) -> Result<Least, NotFinite> {
        let sample = self.look(chord, sample)?;
        let (mut low, mut high) = if sample.slope > 0.0 {
            (self.look(chord, around.0)?, sample)
        } else {
            (sample, self.look(chord, around.1)?)
        };
        let mut here = sample;
        for step in 0..REFINEMENTS {
            let (width, rise) = (high.t - low.t, high.slope - low.slope);
            let secant = low.t - low.slope * width / rise;
            let between = |t: f64| low.t < t && t < high.t;
            let is_bracket = low.slope < 0.0 && high.slope > 0.0;
            let t =
                if step % 2 == 0 && is_bracket && between(secant) { secant } else { 0.5 * (low.t + high.t) };
            if !between(t) {
                break;
            }
            here = self.look(chord, t)?;
            if here.slope.abs() * width <= EXACT * (chord.far - chord.near) * rise {
                break;
            }
            if here.slope < 0.0 { low = here } else { high = here }
        }
        // The refined point is a minimum, but possibly not the one next to the sample.
        let least = if here.jet.value <= sample.jet.value { here } else { sample };
        Ok(Least { point: chord.at(least.t), jet: least.jet })
    }

    fn value(&self, chord: &Chord, t: f64) -> Result<f64, NotFinite> {
        let point = chord.at(t);
        let value = self.shape.value(point);
        if value.is_finite() { Ok(value) } else { Err(NotFinite { point, value }) }
    }

    fn look(&self, chord: &Chord, t: f64) -> Result<Place, NotFinite> {
        let point = chord.at(t);
        let jet = self.shape.jet(point);
        let is_finite = jet.value.is_finite() && jet.gradient.is_finite();
        let place = Place { t, slope: jet.gradient.dot(chord.direction), jet };
        if is_finite { Ok(place) } else { Err(NotFinite { point, value: jet.value }) }
    }
}
