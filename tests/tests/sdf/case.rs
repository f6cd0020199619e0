//! A moving scene, and comparisons of estimates with its exact derivative.

use std::f64::consts::FRAC_PI_4;

use flatland::estimator::Estimate;
use flatland::estimator::sdf::AreaIntegral;
use flatland::plane::Filter;
use flatland::sdf::exact::{Exact, Silhouette};
use flatland::sdf::fields::{MotionField, MovingField, TracedField};
use flatland::sdf::shapes::Shape;
use flatland::sdf::{AngularFilm, Scene, Sdf as _, Shading, Tracer};
use flatland::warp::Circle as Directions;
use glam::DVec2;
use tests::comparison::{Comparison, Estimate as Slope};
use tests::power::Power;
use tests::statistics::suite_threshold;

/// Differences up to this count as none.
const ROUNDING: f64 = 1e-9;

/// A scene, a motion and the exact derivative of its image.
pub(crate) struct Case {
    pub(crate) scene: Scene,
    pub(crate) film: AngularFilm,
    pub(crate) direction: Vec<f64>,
    pub(crate) exact: Vec<f64>,
}

impl Case {
    pub(crate) fn new(shape: Shape, shading: Shading, filter: Filter) -> Self {
        let tracer = Tracer { far: 10.0, ..Tracer::default() };
        let mut direction: Vec<f64> =
            (0..shape.parameter_count()).map(|i| 0.5 + (1.3 * i as f64).sin()).collect();
        if matches!(shape, Shape::Union(_)) {
            // The blending width has no visible effect.
            *direction.last_mut().expect("a width") = 0.0;
        }
        let scene = Scene::new(shape, DVec2::ZERO, tracer, shading, 0.3).expect("a scene");
        let film = AngularFilm::new(-FRAC_PI_4, FRAC_PI_4, 12, filter).expect("a film");
        Self::of(scene, film, direction)
    }

    pub(crate) fn of(scene: Scene, film: AngularFilm, direction: Vec<f64>) -> Self {
        let found = Exact::new(&scene).expect("closed").derivative(&film, &direction).expect("fits");
        let exact = found.iter().map(|[interior, boundary]| interior + boundary).collect();
        Self { scene, film, direction, exact }
    }

    pub(crate) fn silhouettes(&self) -> Vec<Silhouette> {
        Exact::new(&self.scene).expect("closed").silhouettes(&self.direction).expect("fits")
    }

    pub(crate) fn area(&self, samples: usize, field: &impl MotionField<Directions>) -> Estimate<Vec<f64>> {
        let method = AreaIntegral { samples, seed: 1, ..AreaIntegral::default() };
        method.forward(&self.scene, &self.film, field).expect("valid")
    }

    pub(crate) fn traced(&self, samples: usize, field: &impl TracedField<Directions>) -> Estimate<Vec<f64>> {
        self.area(samples, &self.moving(field))
    }

    pub(crate) fn moving<'a, F: TracedField<Directions>>(
        &'a self,
        field: &'a F,
    ) -> MovingField<'a, Directions, F> {
        MovingField::new(self.scene.view(), field, &self.direction).expect("valid")
    }

    /// The largest |z| of a pixel.
    fn worst(&self, label: &str, found: &Estimate<Vec<f64>>) -> f64 {
        assert!(found.non_finite.is_empty(), "{label}");
        // Rays within 5·10⁻⁸ r/t radians of a silhouette run out of steps, of at most four silhouettes in 1.6
        // radians: one ray in 10⁷ is expected, which biases the estimate by less than that fraction.
        assert!(found.out_of_steps <= 1 + found.rays / 1_000_000, "{label}: {} rays", found.out_of_steps);
        let pixels = found.mean.iter().zip(&self.exact).zip(&found.standard_error);
        let z = pixels.map(|((mean, exact), error)| {
            let off = (mean - exact).abs();
            if off <= ROUNDING && !error.is_nan() { 0.0 } else { (off - ROUNDING) / error }
        });
        z.fold(0.0, |worst, z| if z.is_nan() { f64::INFINITY } else { worst.max(z) })
    }

    /// Regression of an estimate on the exact derivative.
    pub(crate) fn slope(&self, label: &str, found: &Estimate<Vec<f64>>) -> Slope {
        let norm: f64 = self.exact.iter().map(|e| e * e).sum();
        let product: f64 = self.exact.iter().zip(&found.mean).map(|(e, m)| e * m).sum();
        let noise: f64 = self.exact.iter().zip(&found.standard_error).map(|(e, s)| (e * s).powi(2)).sum();
        let slope = Slope { mean: product / norm, standard_error: noise.sqrt() / norm };
        let worst = self.worst(label, found);
        let Slope { mean, standard_error } = slope;
        println!("{label}: slope {mean:.3} ± {standard_error:.3}, worst |z| {worst:.1}, {} rays", found.rays);
        slope
    }

    /// Asserts that no pixel, nor the regression over all pixels, exceeds the suite's threshold.
    pub(crate) fn assert_right(&self, power: &mut Power, label: &str, found: &Estimate<Vec<f64>>) {
        let slope = self.slope(label, found);
        let worst = self.worst(label, found);
        assert!(worst < suite_threshold(), "{label}: worst |z| {worst}");
        assert_slope_1(power, label, slope, 0.0);
    }

    pub(crate) fn assert_wrong(&self, label: &str, found: &Estimate<Vec<f64>>) {
        self.slope(label, found);
        let worst = self.worst(label, found);
        assert!(worst > suite_threshold(), "{label} was not rejected: worst |z| {worst}");
    }
}

/// Asserts that a regression is 1 up to its noise and some slack.
pub(crate) fn assert_slope_1(power: &mut Power, label: &str, found: Slope, slack: f64) {
    let reference = Slope::exact(1.0);
    Comparison { found, reference, limit: suite_threshold(), slack }.accept(power, label, 1.0);
}
