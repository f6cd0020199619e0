//! Light that a point reflects towards its viewer after a number of scattering events.

use glam::DVec2;
use num_dual::{Dual64, DualNum};

use super::adaptive::{Precision, integrate};
use super::events::{Events, mirrored};
use super::lobe;
use super::place::{Angles, Place};
use super::scene::{Scene, Surface, is_nothing};
use super::term::Term;

/// A scene with the data of the recursion.
#[derive(Debug)]
pub(super) struct Reflection {
    pub(super) scene: Scene,
    pub(super) events: Events,
    /// Precision of the integrals over directions from the second scattering event on.
    pub(super) inner: Precision,
}

/// Width below which lobes have events of their own, where they sweep over vertices; wider ones are smooth
/// enough for the quadrature.
const NARROW: f64 = 0.3;

impl Reflection {
    /// ∫ f(ω, ω_o) cos φ L(ω) dω at a place, where L is the light scattered fewer than `bounces` times.
    pub(super) fn at(&self, place: &Place, bounces: usize) -> Term {
        let scene = &self.scene;
        let surface = &scene.lines[place.line].surface;
        let mut sum = Term::default();
        if bounces == 0 || !surface.scatters() {
            return sum;
        }
        for interval in place.intervals(scene) {
            let angles = place.angles(scene, &interval);
            let emission = scene.emission(interval.seen);
            if !is_nothing(emission) {
                sum += direct(surface, emission, &angles, place.mirror);
            }
            if let Some(seen) = interval.seen.filter(|_| bounces > 1)
                && scene.lines[seen].surface.scatters()
            {
                sum += self.indirect(place, seen, &angles, bounces);
            }
        }
        sum
    }

    /// The light reflected by one line, over an interval of directions whose ends move: a direction is φ₀ +
    /// ξ(φ₁ − φ₀) at fixed ξ.
    fn indirect(&self, place: &Place, seen: usize, angles: &Angles, bounces: usize) -> Term {
        let scene = &self.scene;
        let surface = &scene.lines[place.line].surface;
        let breaks = self.breaks(place, seen, angles);
        let [sum] = integrate(breaks, self.inner, |xi| {
            let phi = angles.ends[0] + angles.width * xi;
            let direction = place.direction(phi);
            let point = scene.meet(seen, place.point, direction);
            let from = Place::new(scene, seen, point, place.point, direction);
            let factor = scattering(surface, phi - place.mirror) * phi.cos() * angles.width;
            [self.at(&from, bounces - 1) * factor]
        });
        sum
    }

    /// Values of ξ where the integrand of [`indirect`](Self::indirect) is not smooth or has a peak.
    fn breaks(&self, place: &Place, seen: usize, angles: &Angles) -> Vec<f64> {
        let scene = &self.scene;
        let reduced = |phi: f64| (phi - angles.ends[0].re) / angles.width.re;
        let viewer = place.point.value();
        let mut breaks: Vec<f64> =
            self.on_line(seen, viewer).into_iter().filter_map(|p| place.angle_of(p)).map(reduced).collect();
        if scene.lines[place.line].surface.gloss.is_some() {
            breaks.push(reduced(place.mirror.re));
        }
        breaks
    }

    /// The events on a line that matter to a viewer.
    pub(super) fn on_line(&self, line: usize, viewer: DVec2) -> Vec<DVec2> {
        let [a, b] = self.scene.ends(line);
        let left = (b - a).perp_dot(viewer - a) > 0.0;
        let mut events: Vec<_> = self.events.of(line, left).collect();
        if self.scene.lines[line].surface.gloss.is_some_and(|[_, width]| width.re < NARROW) {
            events.extend(mirrored(&self.scene, line, viewer));
        }
        events
    }
}

/// f as a function of the angle from the mirror direction.
fn scattering(surface: &Surface, alpha: Dual64) -> Dual64 {
    let gloss = surface.gloss.map_or(0.0.into(), |[s, w]| s * lobe::density(alpha, w));
    surface.reflectance * 0.5 + gloss
}

/// Light of constant radiance from an interval of directions, in closed form.
fn direct(surface: &Surface, emission: Dual64, angles: &Angles, mirror: Dual64) -> Term {
    let diffuse = surface.reflectance * 0.5 * lobe::cosine(angles);
    let gloss = surface.gloss.map_or(0.0.into(), |[s, w]| s * lobe::gloss(angles, mirror, w));
    // The contributions of the ends: the terms that cancel in a narrow interval.
    let ends = angles.ends.iter().zip(&angles.cosines).map(|(phi, cosine)| {
        let f = scattering(surface, *phi - mirror);
        (f.re * cosine.re * phi.eps).abs()
    });
    let value = emission * (diffuse + gloss);
    Term::with_absolute(value, value.eps.abs() + emission.re * ends.sum::<f64>())
}
