//! A shape that moves in front of the origin, and the regression of a field's estimate on the exact
//! derivative.

use flatland::random::{open01, stream};
use flatland::sdf::fields::TracedField;
use flatland::sdf::{End, Sdf, Tracer, View};
use flatland::warp::LinearField as _;
use glam::DVec3;
use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::power::Power;
use tests::statistics::{Moments, suite_threshold};
use volume3d::Sphere;

use super::outputs::Outputs;

/// L = base + a·x + b·n on the shape, and the radiance of the background.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading {
    pub(crate) base: f64,
    pub(crate) position: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) background: f64,
}

impl Shading {
    pub(crate) fn at(&self, x: DVec3, n: DVec3) -> f64 {
        self.base + self.position.dot(x) + self.normal.dot(n)
    }
}

/// A shape, its motion, and the exact derivatives of its integrals.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) sdf: Box<dyn Sdf<DVec3>>,
    pub(crate) direction: Vec<f64>,
    pub(crate) shading: Shading,
    pub(crate) outputs: Outputs,
    pub(crate) exact: Vec<f64>,
    pub(crate) tracer: Tracer,
}

/// Terms that contribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Terms {
    All,
    /// None of the field's terms.
    Interior,
    /// All terms except −2 ω·U, the projection's part of the divergence.
    Unprojected,
}

/// Samples of a partial sum.
const BLOCK: usize = 1 << 12;

impl Case {
    /// Slope of the regression, and the fraction of rays that ran out of steps.
    pub(crate) fn slope(
        &self,
        field: &dyn TracedField<Sphere>,
        terms: Terms,
        samples: usize,
    ) -> (Estimate, f64) {
        let blocks = (0..samples.div_ceil(BLOCK)).into_par_iter().map(|block| {
            let (mut moments, mut lost) = (Moments::new(), 0);
            for index in BLOCK * block..(BLOCK * (block + 1)).min(samples) {
                let (value, end) = self.sample(field, terms, index as u64);
                assert!(value.is_finite(), "{}, sample {index}", self.name);
                moments.push(value);
                lost += u64::from(end == End::OutOfSteps);
            }
            (moments, lost)
        });
        let blocks: Vec<(Moments, u64)> = blocks.collect();
        let all = blocks.iter().fold(Moments::new(), |sum, (moments, _)| sum.merge(*moments));
        let lost: u64 = blocks.iter().map(|(_, lost)| lost).sum();
        (Estimate { mean: all.mean(), standard_error: all.standard_error() }, lost as f64 / samples as f64)
    }

    /// One sample of Σ e_p İ_p/Σ e_p², whose mean is 1.
    fn sample(&self, field: &dyn TracedField<Sphere>, terms: Terms, index: u64) -> (f64, End) {
        let mut dice = stream(17, &[index]);
        let (omega, area) = self.outputs.draw([open01(&mut dice), open01(&mut dice)]);
        let view = View { sdf: self.sdf.as_ref(), eye: DVec3::ZERO, start: 0.0, tracer: self.tracer };
        let trace = view.trace(omega);
        let shading = &self.shading;
        let (mut radiance, mut along, mut still) = (shading.background, DVec3::ZERO, 0.0);
        if let Some(hit) = trace.hit() {
            // As in flatland: dL = q·ẋ + r·∇φ̇ with ẋ = tV + ṫω.
            let second = self.sdf.second_order(hit.position);
            let gradient = second.jet.gradient;
            let inverse = gradient.length().recip();
            let normal = gradient * inverse;
            radiance = shading.at(hit.position, normal);
            let r = (shading.normal - normal * normal.dot(shading.normal)) * inverse;
            let q = shading.position + second.hessian * r;
            let slope = q.dot(omega) / gradient.dot(omega);
            let rate = self.sdf.rate(hit.position, &self.direction);
            along = (q - gradient * slope) * hit.t;
            still = r.dot(rate.gradient) - slope * rate.value;
        }
        // ∫ ∇·(V h) = 0, so that any constant may be subtracted from L.
        let beyond = radiance - 0.5 * (shading.base + shading.background);
        let norm: f64 = self.exact.iter().map(|e| e * e).sum();
        let (mut a, mut b, mut value) = (DVec3::ZERO, 0.0, 0.0);
        for (exact, (h, turn)) in self.exact.iter().zip(self.outputs.weights(omega)) {
            let weight = exact / norm * area;
            a += (along * h + turn * beyond) * weight;
            b += h * beyond * weight;
            value += h * still * weight;
        }
        if terms != Terms::Interior {
            let form = field.form(&view, omega, &mut dice);
            let rate = |x: &DVec3| self.sdf.rate(*x, &self.direction);
            let found = form.field(rate);
            let taps = form.taps().iter();
            let outward: f64 = taps.map(|tap| tap.value.dot(omega) * rate(&tap.point).value).sum();
            let divergence = found.divergence + if terms == Terms::Unprojected { 2.0 * outward } else { 0.0 };
            value += a.dot(found.value) + b * divergence;
        }
        (value, trace.end)
    }

    pub(crate) fn accept(
        &self,
        power: &mut Power,
        label: &str,
        field: &dyn TracedField<Sphere>,
        samples: usize,
    ) {
        let (found, lost) = self.slope(field, Terms::All, samples);
        let label = format!("{}, {label}", self.name);
        println!("{label}: {lost:.1e} of rays out of steps");
        assert!(lost <= 1e-4, "{label}: {lost}");
        let comparison =
            Comparison { found, reference: Estimate::exact(1.0), limit: suite_threshold(), slack: 0.0 };
        comparison.accept(power, &label, 1.0);
    }

    pub(crate) fn reject(&self, label: &str, field: &dyn TracedField<Sphere>, terms: Terms, samples: usize) {
        let (found, _) = self.slope(field, terms, samples);
        let comparison =
            Comparison { found, reference: Estimate::exact(1.0), limit: suite_threshold(), slack: 0.0 };
        comparison.reject(&format!("{}, {label}", self.name));
    }
}
