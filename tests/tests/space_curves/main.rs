//! Every kind of curve by itself: scenes in which one boundary term is nearly the whole derivative, compared
//! with closed forms and quadrature.
//!
//! In scenes where many things move, a tenth of one term may be a hundredth of the whole. Here a curve of one
//! kind crosses the visible region, little else changes, and the reference has no noise: a bias of
//! [`NOTICED`] of the one term is rejected, with few samples. Tested are edge sampling and softened fields,
//! which sample the same curves, and exact means over discontinuities, which follow them.

mod bounce;
mod film;
mod lamps;
mod meeting;
mod turned;

use glam::DVec3;
use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::power::Power;
use tests::statistics::student;
use volume3d::gradient::{EdgeSampling, Field, GradientImage, Progress, Tangent, WarpedArea};
use volume3d::scene::Scene;

/// The relative bias that comparisons here must notice; it is larger for light after a bounce, where few
/// paths reach the film.
const NOTICED: f64 = 0.06;

/// Independent runs of a method.
const RUNS: u64 = 80;

/// A scene, its change, and the derivative of its film's sum, with the error of that.
struct Case {
    scene: Scene,
    change: Tangent,
    exact: f64,
    error: f64,
}

/// Edge sampling: samples of curves on the film, towards lights, and towards all other surfaces.
fn edges(samples: usize, [primary, secondary, bounces]: [usize; 3]) -> EdgeSampling {
    EdgeSampling { samples, primary, secondary, bounces, seed: 0, allow_missing: vec![] }
}

/// A softened field: samples of silhouettes, of shadows, and of silhouettes seen at bounces.
fn softened(samples: usize, softness: f64, [silhouettes, shadows, bounces]: [usize; 3]) -> WarpedArea {
    let field = Field::Softened { film: 1.2, lobe: 0.5, softness, silhouettes, shadows, bounces };
    WarpedArea { samples, field, ..WarpedArea::default() }
}

/// The exact mean over discontinuities.
fn exact_mean(samples: usize) -> WarpedArea {
    WarpedArea { samples, ..WarpedArea::default() }
}

/// A method with a seed, along a given change.
trait Method: Sync {
    fn run(&self, case: &Case, seed: u64) -> GradientImage;
}

impl Method for EdgeSampling {
    fn run(&self, case: &Case, seed: u64) -> GradientImage {
        let method = Self { seed, ..self.clone() };
        method.forward(&case.scene, &case.change, &Progress::none()).expect("valid")
    }
}

impl Method for WarpedArea {
    fn run(&self, case: &Case, seed: u64) -> GradientImage {
        let method = Self { seed, ..self.clone() };
        method.forward(&case.scene, &case.change, &Progress::none()).expect("valid")
    }
}

impl Case {
    fn estimate(&self, method: &impl Method) -> Estimate {
        let run = |seed| {
            let found = method.run(self, seed);
            assert!(found.non_finite.is_empty(), "{:?}", found.non_finite);
            found.gradient.pixels.iter().sum::<DVec3>().element_sum()
        };
        Estimate::of((0..RUNS).into_par_iter().map(run).collect::<Vec<_>>())
    }

    fn compared(&self, found: Estimate) -> Comparison {
        Comparison {
            found,
            reference: Estimate::exact(self.exact),
            limit: student(RUNS - 1),
            slack: self.error,
        }
    }

    /// Asserts that the method's mean is the derivative.
    fn accept(&self, power: &mut Power, label: &str, method: &impl Method) {
        let start = std::time::Instant::now();
        let found = self.estimate(method);
        println!("{label}: {:.2} s", start.elapsed().as_secs_f64());
        self.compared(found).accept(power, label, self.exact);
    }

    /// Asserts that it is not.
    fn reject(&self, label: &str, method: &impl Method) {
        self.compared(self.estimate(method)).reject(label);
    }
}

/// Power record with the bias that a test must notice.
fn power(test: &'static str) -> Power {
    Power::of(test).noticing(NOTICED)
}

/// The same where light is reflected twice.
fn after_a_bounce(test: &'static str) -> Power {
    Power::of(test).noticing(0.15)
}
