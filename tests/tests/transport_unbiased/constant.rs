//! Worlds whose derivative is known by an argument.

use flatland::estimator::transport::{EdgeSampling, GradientImage, Method as _, WarpedArea};
use flatland::plane::Filter;
use flatland::transport::Paths;
use flatland::transport::fields::Construction;
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::suite_threshold;
use tests::transport::campaign::Sampler as _;
use tests::transport::constants::constants;
use tests::transport::worlds::Case;

use super::{SAMPLES, edges, warped};

/// Values that are 0, or known without computation: furnaces, a floor that slides under itself, all objects
/// and the camera moved together. Noise is relative to the quantities that cancel: the terms and the image.
#[test]
fn what_is_known_by_an_argument() {
    let mut power = Power::of("transport_unbiased::what_is_known_by_an_argument");
    let mut worst = [0.0_f64; 3];
    for bounces in [1, 2] {
        let paths = Paths { bounces, ..Paths::default() };
        let filters = [Filter::Tent, Filter::Box];
        for constant in constants(&filters[..pick(1, 2)], bounces).into_iter().step_by(pick(2, 3)) {
            let Case { world, camera, change, label } = &constant.case;
            let image: f64 =
                paths.image(world, camera, SAMPLES, 4).expect("valid").iter().map(|p| p[0]).sum();
            let methods: [(&str, Sampled<'_>); 3] = [
                ("warped area", &|samples| {
                    let method = WarpedArea { samples, ..warped(Construction::default()) };
                    method.on(paths, 3).forward(world, camera, change).expect("valid")
                }),
                ("harmonic field", &|samples| {
                    let method = WarpedArea { samples, ..warped(Construction::Harmonic) };
                    method.on(paths, 3).forward(world, camera, change).expect("valid")
                }),
                ("edge sampling", &|samples| {
                    let method = EdgeSampling { samples, ..edges() };
                    method.on(paths, 3).forward(world, camera, change).expect("valid")
                }),
            ];
            for ((name, method), worst) in methods.into_iter().zip(&mut worst) {
                // More paths where noise would hide a bias: the number depends on the noise alone.
                let (mut samples, mut found) = (SAMPLES, method(SAMPLES));
                let (mut error, mut scale) = noise(&found, image);
                while suite_threshold() * error > 0.13 * scale && samples < 1000 * SAMPLES {
                    samples *= 4;
                    found = method(samples);
                    (error, scale) = noise(&found, image);
                }
                let total = found.total();
                let off = total.iter().sum::<f64>() - total.len() as f64 * constant.derivative;
                // Rounding, if samples do not differ.
                let z = off / error.max(1e-9);
                assert!(z.abs() < suite_threshold(), "{name}: off by {off} ± {error}, {label}");
                *worst = worst.max(z.abs());
                power.add(format!("{name}, {bounces} bounces, {label}"), suite_threshold() * error, scale);
            }
        }
    }
    println!("known by an argument: worst |z| {worst:.2?}");
}

/// The estimate of a method from a number of paths per pixel.
type Sampled<'a> = &'a dyn Fn(usize) -> GradientImage;

/// The standard error of the sum of all pixels, and its scale: the image and the terms that cancel.
fn noise(found: &GradientImage, image: f64) -> (f64, f64) {
    let terms: f64 = found.mean.iter().flat_map(|t| t.to_array()).map(f64::abs).sum();
    (found.standard_error.total.iter().map(|e| e * e).sum::<f64>().sqrt(), image + terms)
}
