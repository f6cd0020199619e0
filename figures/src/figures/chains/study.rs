//! A curved mirror with an emitter in it, and the derivative of its image by every weighting of the chain.

use flatland::chain::{ChainTerms, Curve, Exact, Optics, Surface, World};
use flatland::estimator::chain::{AuxiliaryRay, Fault, WarpedArea};
use flatland::plane::Filter;
use flatland::transport::{Camera, Film};
use flatland::warp::{Debias, Warp};
use glam::DVec2;

use crate::context::Context;

/// Number of pixels.
pub(super) const PIXELS: usize = 32;
/// Auxiliary rays that are drawn; the estimator draws a random number.
pub(super) const RAYS: usize = 24;
/// Concentration κ of the drawn rays, in 1/pixel². The estimator has 20, which would be too narrow to see.
const DRAWN: f64 = 1.0;
/// Indices of the mirror and the emitter.
pub(super) const MIRROR: usize = 0;
pub(super) const EMITTER: usize = 1;

/// A weighting of the points of a chain.
pub(super) struct Weighting {
    pub(super) name: &'static str,
    fault: Option<Fault>,
}

/// All weightings; the first is the right one.
pub(super) const WEIGHTINGS: [Weighting; 4] = [
    Weighting { name: "every point", fault: None },
    Weighting { name: "first point alone", fault: Some(Fault::FirstAlone) },
    Weighting { name: "last point alone", fault: Some(Fault::LastAlone) },
    Weighting { name: "no warp", fault: Some(Fault::NoWarp) },
];

/// A motion, with the exact derivative and that of every weighting.
pub(super) struct Case {
    pub(super) name: &'static str,
    /// Velocity of each surface.
    pub(super) velocities: [DVec2; 2],
    pub(super) exact: Vec<ChainTerms>,
    /// Mean and standard error of every pixel, in the order of [`WEIGHTINGS`].
    pub(super) found: Vec<[Vec<f64>; 2]>,
}

/// The world, and all measurements.
pub(super) struct Study {
    pub(super) world: World,
    pub(super) camera: Camera,
    pub(super) samples: usize,
    pub(super) cases: [Case; 2],
    /// Auxiliary rays next to the mirror's border, and next to the emitter's image in it.
    pub(super) rays: [Vec<AuxiliaryRay>; 2],
}

impl Case {
    /// Slope of an estimate along the exact derivative, and its standard error.
    pub(super) fn slope(&self, weighting: usize) -> [f64; 2] {
        let exact = || self.exact.iter().map(ChainTerms::total);
        let size: f64 = exact().map(|d| d * d).sum();
        let [mean, error] = &self.found[weighting];
        let along: f64 = exact().zip(mean).map(|(d, m)| d * m).sum();
        let variance: f64 = exact().zip(error).map(|(d, e)| (d * e).powi(2)).sum();
        [along / size, variance.sqrt() / size]
    }
}

impl Study {
    pub(super) fn new(context: &Context) -> anyhow::Result<Self> {
        let camera = Camera {
            position: DVec2::new(0.9, -0.4),
            angle: 1.8,
            field_of_view: 0.62,
            film: Film { pixels: PIXELS, filter: Filter::Tent },
        };
        let mirror = Surface {
            curve: Curve::arc(DVec2::new(0.0, 5.0), 2.0, -2.05, 0.95),
            optics: Optics::Mirror { reflectance: 0.6 },
        };
        let emitter = Surface {
            curve: Curve::segment(DVec2::new(-2.1, 0.4), DVec2::new(-1.0, 0.0)),
            optics: Optics::emitter([2.0, 2.6]),
        };
        let world = World::new(1.0, vec![mirror, emitter], vec![])?;
        let samples = context.study(2_000, 20_000, 200_000);
        let case = |name, velocities: [DVec2; 2]| -> anyhow::Result<Case> {
            context.step(name);
            let mut rates = vec![0.0; world.numbers().len() + 4];
            for (surface, v) in velocities.into_iter().enumerate() {
                let first = world.first_of_surface(surface);
                rates[first..first + 2].copy_from_slice(&v.to_array());
                if surface == EMITTER {
                    rates[first + 2..first + 4].copy_from_slice(&v.to_array());
                }
            }
            let exact = Exact::default().image(&world, &camera, &rates)?.derivative;
            let found = WEIGHTINGS.iter().map(|weighting| {
                let fault = weighting.fault;
                let method = WarpedArea { samples, fault, seed: context.seed(), ..WarpedArea::default() };
                let estimate = method.forward(&world, &camera, &rates)?;
                Ok([estimate.mean, estimate.standard_error])
            });
            Ok(Case { name, velocities, exact, found: found.collect::<anyhow::Result<_>>()? })
        };
        let cases = [
            case("the emitter moves", [DVec2::ZERO, DVec2::new(0.5, 0.2)])?,
            case("the mirror moves", [DVec2::new(0.4, 0.1), DVec2::ZERO])?,
        ];
        let drawn = WarpedArea::default();
        let warp = Warp { debias: Debias::Consistent { rays: RAYS }, ..drawn.warp };
        let drawn = WarpedArea { warp, kappa: DRAWN, seed: context.seed(), ..drawn };
        let [border, image] = places(&world, &camera);
        let rays = [border, image].map(|u| drawn.auxiliary_rays(&world, &camera, u));
        let [border, image] = rays;
        Ok(Self { samples, cases, rays: [border?, image?], world, camera })
    }
}

/// Film coordinates next to the mirror's border, and next to the emitter's image.
fn places(world: &World, camera: &Camera) -> [f64; 2] {
    let single = WarpedArea {
        warp: Warp { debias: Debias::Consistent { rays: 1 }, ..Warp::default() },
        kappa: 1e12,
        ..WarpedArea::default()
    };
    let length = |u: f64| {
        single.auxiliary_rays(world, camera, u).map_or(0, |rays| rays.first().map_or(0, |r| r.points.len()))
    };
    let first = |from: f64, points: usize| {
        let steps = (0..40 * PIXELS).map(|i| from + i as f64 / 40.0);
        steps.take_while(|u| *u < PIXELS as f64).find(|u| length(*u) >= points).unwrap_or(from)
    };
    [first(0.0, 1) + 0.1, first(0.0, 2) + 0.1]
}
