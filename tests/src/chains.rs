//! Random worlds with mirrors, glass, openings and lights without extent, with exact derivatives.

use flatland::chain::{ChainTerms, Curve, Exact, Light, Optics, Surface, World};
use flatland::estimator::chain::WarpedArea;
use flatland::plane::Filter;
use flatland::transport::{Camera, Film};
use glam::DVec2;
use rayon::prelude::*;

use crate::campaign::{Reference, Target, focused};
use crate::choices::choices;
use crate::comparison::Estimate;
use crate::dice::Dice;

choices! {
    /// Kinds of worlds.
    Kind {
        /// Emitters in flat mirrors.
        Flat,
        /// Emitters in curved mirrors, convex and concave.
        Curved,
        /// Emitters behind and in glass.
        Glass,
        /// Emitters behind openings.
        Openings,
        /// Shadows of lights without extent, seen directly and in a mirror.
        Lights,
    }
}

/// A world with its exact derivative, reduced to one number by weights.
#[derive(Debug)]
pub struct Known {
    world: World,
    camera: Camera,
    rates: Vec<f64>,
    weights: Vec<f64>,
    exact: f64,
    scale: f64,
    label: String,
}

/// Most points of a chain.
const LONGEST: usize = 6;

impl Known {
    /// The world of a kind and a seed; `None` if it is refused or nothing in view moves.
    fn new(kind: Kind, seed: u64) -> Option<Self> {
        let mut dice = Dice::new(seed, kind as u64);
        let filter = dice.pick(&[Filter::Tent, Filter::Box, Filter::Gaussian]);
        let camera = Camera {
            position: DVec2::new(dice.between(-0.2, 0.2), -1.5),
            angle: std::f64::consts::FRAC_PI_2 + dice.between(-0.1, 0.1),
            field_of_view: dice.between(0.6, 1.0),
            film: Film { pixels: 4, filter },
        };
        let (surfaces, lights) = draw(kind, &mut dice);
        let world = World::new(dice.between(0.0, 0.5), surfaces, lights).ok()?;
        let mut rates: Vec<f64> = world.numbers().iter().map(|_| 0.0).collect();
        for (index, surface) in world.surfaces().iter().enumerate() {
            if dice.chance(0.6) {
                let numbers = surface.curve.numbers().len() + surface.optics.numbers().len();
                let first = world.first_of_surface(index);
                rates[first..first + numbers].iter_mut().for_each(|r| *r = dice.between(-0.5, 0.5));
                // A full turn that opens has no derivative.
                if kind == Kind::Glass && matches!(surface.curve, Curve::Arc { .. }) {
                    rates[first + 4] = 0.0;
                }
            }
        }
        rates.extend(if dice.chance(0.3) { [0.2, -0.1, 0.3, 0.2] } else { [0.0; 4] });
        let exact = Exact { longest: LONGEST, ..Exact::default() }.image(&world, &camera, &rates).ok()?;
        let derivative: Vec<f64> = exact.derivative.iter().map(ChainTerms::total).collect();
        let weights = focused(&derivative);
        let sum = |values: &[f64]| weights.iter().zip(values).map(|(w, v)| w * v).sum::<f64>();
        let size: Vec<f64> = exact
            .derivative
            .iter()
            .zip(&exact.image)
            .map(|(d, i)| d.interior.abs() + d.primary.abs() + d.chain.abs() + d.shadow.abs() + i)
            .collect();
        let scale = weights.iter().zip(&size).map(|(w, s)| w.abs() * s).sum::<f64>();
        let exact = sum(&derivative);
        let label = format!("{kind:?} {seed}, {filter:?}");
        (scale > 0.0).then_some(Self { world, camera, rates, weights, exact, scale, label })
    }

    /// The weighted sum of the pixels that a method finds.
    pub fn run(&self, seed: u64, method: &WarpedArea) -> Estimate {
        let method = WarpedArea { seed, longest: LONGEST, ..*method };
        let found = method.forward(&self.world, &self.camera, &self.rates);
        let found = found.unwrap_or_else(|e| panic!("{e}\n{}", self.label));
        assert!(found.non_finite.is_empty(), "{}", self.label);
        let mean = self.weights.iter().zip(&found.mean).map(|(w, m)| w * m).sum();
        let variance: f64 =
            self.weights.iter().zip(&found.standard_error).map(|(w, e)| (w * e).powi(2)).sum();
        Estimate { mean, standard_error: variance.sqrt() }
    }
}

impl Reference for Known {
    fn target(&self) -> Target<'_> {
        Target { exact: self.exact, scale: self.scale, label: &self.label }
    }
}

/// `count` worlds of a kind.
pub fn known(kind: Kind, count: usize) -> Vec<Known> {
    let seeds: Vec<u64> = (0..6 * count as u64).collect();
    let mut all: Vec<Known> = seeds.into_par_iter().filter_map(|seed| Known::new(kind, seed)).collect();
    all.truncate(count);
    assert_eq!(all.len(), count, "too few worlds are accepted");
    all
}

fn segment(dice: &mut Dice, [x, y]: [[f64; 2]; 2], tilt: f64) -> Curve {
    let middle = DVec2::new(dice.between(x[0], x[1]), dice.between(y[0], y[1]));
    let half = DVec2::from_angle(dice.between(-tilt, tilt)) * dice.between(0.3, 0.6);
    Curve::segment(middle - half, middle + half)
}

fn emitter(dice: &mut Dice, place: [[f64; 2]; 2]) -> Surface {
    let emission = [dice.between(0.5, 2.0), dice.between(0.5, 2.0)];
    Surface { curve: segment(dice, place, 0.4), optics: Optics::emitter(emission) }
}

/// Places of things before the camera, and behind it, where mirrors show them.
const NEAR: [[f64; 2]; 2] = [[-0.5, 0.5], [-0.2, 0.6]];
const MIDDLE: [[f64; 2]; 2] = [[-0.6, 0.6], [1.0, 1.6]];
const FAR: [[f64; 2]; 2] = [[-0.7, 0.7], [2.2, 2.8]];
const BEHIND: [[f64; 2]; 2] = [[-1.0, 1.0], [-2.6, -2.0]];

/// Surfaces and lights of a kind.
fn draw(kind: Kind, dice: &mut Dice) -> (Vec<Surface>, Vec<Light>) {
    let mut surfaces = vec![];
    let mut lights = vec![];
    match kind {
        Kind::Flat => {
            for place in [MIDDLE, FAR] {
                let optics = Optics::Mirror { reflectance: dice.between(0.4, 1.0) };
                surfaces.push(Surface { curve: segment(dice, place, 0.3), optics });
            }
            surfaces.extend([emitter(dice, BEHIND), emitter(dice, BEHIND)]);
        }
        Kind::Curved => {
            let radius = dice.scale(0.8, 3.0);
            let sign = dice.sign();
            let extent = dice.between(0.6, 1.2) / radius.max(1.0);
            let middle = DVec2::new(dice.between(-0.3, 0.3), dice.between(1.0, 2.0));
            let centre = middle + DVec2::new(0.0, sign * radius);
            let start = -sign * std::f64::consts::FRAC_PI_2 - 0.5 * extent + dice.between(-0.1, 0.1);
            let optics = Optics::Mirror { reflectance: dice.between(0.4, 1.0) };
            surfaces.push(Surface { curve: Curve::arc(centre, radius, start, extent), optics });
            surfaces.extend([emitter(dice, BEHIND), emitter(dice, NEAR)]);
        }
        Kind::Glass => {
            let radius = dice.between(0.3, 0.7);
            let centre = DVec2::new(dice.between(-0.4, 0.4), dice.between(0.8, 1.4));
            // The left side is outside of a full turn with a negative extent.
            let curve = Curve::arc(centre, radius, dice.between(0.0, 1.0), -std::f64::consts::TAU);
            surfaces.push(Surface { curve, optics: Optics::Glass { index: dice.between(1.2, 1.8) } });
            surfaces.extend([emitter(dice, FAR), emitter(dice, BEHIND)]);
        }
        Kind::Openings => {
            for place in [NEAR, MIDDLE] {
                let emission = [dice.between(0.0, 0.5), dice.between(0.0, 0.5)];
                let optics = Optics::Diffuse { reflectance: 0.0, emission, opacity: dice.between(0.2, 0.8) };
                surfaces.push(Surface { curve: segment(dice, place, 0.5), optics });
            }
            surfaces.push(emitter(dice, FAR));
        }
        Kind::Lights => {
            let floor = Curve::segment(DVec2::new(-2.0, 2.6), DVec2::new(2.0, dice.between(2.4, 2.8)));
            surfaces.push(Surface { curve: floor, optics: Optics::diffuse(dice.between(0.3, 0.9)) });
            let opacity = if dice.chance(0.3) { 0.6 } else { 1.0 };
            let optics = Optics::Diffuse { reflectance: 0.5, emission: [0.0; 2], opacity };
            surfaces.push(Surface { curve: segment(dice, MIDDLE, 0.6), optics });
            if dice.chance(0.5) {
                let optics = Optics::Mirror { reflectance: 0.7 };
                surfaces.push(Surface { curve: segment(dice, NEAR, 0.6), optics });
                let wall = Curve::segment(DVec2::new(-2.5, -2.5), DVec2::new(2.5, -2.4));
                surfaces.push(Surface { curve: wall, optics: Optics::diffuse(0.6) });
            }
            lights.push(if dice.chance(0.5) {
                Light::point(DVec2::new(dice.sign() * dice.between(1.2, 2.0), -0.8), dice.between(1.0, 4.0))
            } else {
                let angle = -std::f64::consts::FRAC_PI_2 + dice.between(-0.7, 0.7);
                Light::Directional { angle, irradiance: dice.between(0.5, 2.0) }
            });
        }
    }
    (surfaces, lights)
}
