use flatland::random::{open01, stream};
use flatland::sdf::shapes::{Parametric, ShapeError};
use flatland::sdf::{Jet, Sdf};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::super::tests::{architectures, network, point};
use super::super::{Architecture, Network};
use super::SingleNetwork;
use super::softplus::Softplus;

/// `count` random points: some full groups and an incomplete block.
fn points(count: usize) -> Vec<DVec3> {
    let mut rng = stream(1, &[]);
    (0..count).map(|_| point(&mut rng)).collect()
}

fn covectors(count: usize) -> Vec<Jet<DVec3>> {
    let mut rng = stream(2, &[]);
    (0..count).map(|_| Jet { value: 2.0 * open01(&mut rng) - 1.0, gradient: point(&mut rng) }).collect()
}

fn all() -> Vec<Architecture> {
    let mut all = architectures().to_vec();
    all.push(Architecture { hidden: 1, width: 1, sharpness: 100.0, frequencies: 0 });
    all.push(Architecture { hidden: 2, width: 33, sharpness: 30.0, frequencies: 6 });
    all
}

fn gradient(single: &SingleNetwork, points: &[DVec3], covectors: &[Jet<DVec3>], start: Vec<f64>) -> Vec<f64> {
    let mut gradient = start;
    single.add_parameter_gradient(points, covectors, &mut gradient).expect("counts");
    gradient
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Rounding of single precision is 6·10⁻⁸. Slopes have the rounding error of z, about 1, times β, and sums of
/// hundreds of terms add theirs. The limit for φ is relative to |φ| + 1, that for gradients to their lengths.
#[test]
fn agrees_with_double_precision() {
    let count = 2 * SingleNetwork::GROUP + 31;
    let (points, covectors) = (points(count), covectors(count));
    for architecture in all() {
        let network = network(architecture, 3);
        let single = SingleNetwork::new(&network).expect("small weights");
        let (values, jets) = (single.values(&points), single.jets(&points));
        let mut worst = [0.0_f64; 2];
        for (i, &x) in points.iter().enumerate() {
            let expected = network.jet(x);
            worst[0] = worst[0].max((values[i] - expected.value).abs() / (1.0 + expected.value.abs()));
            worst[0] = worst[0].max((jets[i].value - expected.value).abs() / (1.0 + expected.value.abs()));
            let error = (jets[i].gradient - expected.gradient).length() / (0.1 + expected.gradient.length());
            worst[1] = worst[1].max(error);
        }
        let zero = vec![0.0; network.parameter_count()];
        let mut expected = zero.clone();
        for (&x, &covector) in points.iter().zip(&covectors) {
            network.add_parameter_gradient(x, covector, &mut expected);
        }
        let found = gradient(&single, &points, &covectors, zero);
        let error: Vec<f64> = found.iter().zip(&expected).map(|(a, b)| a - b).collect();
        let by_weights = norm(&error) / norm(&expected);
        println!("{architecture:?}: φ {:.1e}, ∇φ {:.1e}, by weights {by_weights:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-6 && worst[1] < 1e-5 && by_weights < 1e-5, "{architecture:?}");
    }
}

/// The derivative of c φ + q·∇φ along δθ is the same by the network's forward mode and by the gradient.
#[test]
fn gradient_is_the_transpose_of_the_rate() {
    let count = SingleNetwork::GROUP + 5;
    let (points, covectors) = (points(count), covectors(count));
    for architecture in all() {
        let network = network(architecture, 5);
        let single = SingleNetwork::new(&network).expect("small weights");
        let found = gradient(&single, &points, &covectors, vec![0.0; network.parameter_count()]);
        let mut rng = stream(6, &[]);
        let along: Vec<f64> = found.iter().map(|_| open01(&mut rng) - 0.5).collect();
        let forward: f64 =
            points.iter().zip(&covectors).map(|(&x, &covector)| network.rate(x, &along).dot(covector)).sum();
        let reverse: f64 = found.iter().zip(&along).map(|(g, d)| g * d).sum();
        // Errors are about equal in all directions.
        let scale = norm(&found) * norm(&along) / (found.len() as f64).sqrt();
        assert!((forward - reverse).abs() < 1e-4 * scale, "{architecture:?}: {forward} and {reverse}");
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn jet_bits(jets: &[Jet<DVec3>]) -> Vec<u64> {
    jets.iter()
        .flat_map(|jet| [jet.value, jet.gradient.x, jet.gradient.y, jet.gradient.z])
        .map(f64::to_bits)
        .collect()
}

#[test]
fn bits_depend_neither_on_threads_nor_on_cuts() {
    let count = 3 * SingleNetwork::GROUP + 7;
    let (points, covectors) = (points(count), covectors(count));
    let network = network(architectures()[1], 7);
    let single = SingleNetwork::new(&network).expect("small weights");
    let zero = || vec![0.0; network.parameter_count()];
    let run =
        || (single.values(&points), single.jets(&points), gradient(&single, &points, &covectors, zero()));
    let (values, jets, all) = run();
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (v, j, g) = pool.install(run);
        assert_eq!((bits(&v), jet_bits(&j), bits(&g)), (bits(&values), jet_bits(&jets), bits(&all)));
    }
    for cut in [1, 2, 31, 32, 33, 200, count] {
        let v: Vec<f64> = points.chunks(cut).flat_map(|points| single.values(points)).collect();
        let j: Vec<_> = points.chunks(cut).flat_map(|points| single.jets(points)).collect();
        assert_eq!((bits(&v), jet_bits(&j)), (bits(&values), jet_bits(&jets)), "{cut}");
    }
    let (first, rest) = points.split_at(2 * SingleNetwork::GROUP);
    let (first_covectors, rest_covectors) = covectors.split_at(first.len());
    let half = gradient(&single, first, first_covectors, zero());
    assert_eq!(bits(&gradient(&single, rest, rest_covectors, half)), bits(&all));
}

#[test]
fn refuses_what_does_not_fit() {
    let network = network(architectures()[0], 8);
    let single = SingleNetwork::new(&network).expect("small weights");
    let count = network.parameter_count();
    let mut gradient = vec![0.0; count];
    assert!(single.values(&[]).is_empty() && single.jets(&[]).is_empty());
    single.add_parameter_gradient(&[], &[], &mut gradient).expect("nothing");
    let short = single.add_parameter_gradient(&[DVec3::ONE], &[], &mut gradient);
    assert_eq!(short, Err(ShapeError::Count { expected: 1, found: 0 }));
    let other = single.add_parameter_gradient(&[DVec3::ONE], &[Jet::ZERO], &mut gradient[1..]);
    assert_eq!(other, Err(ShapeError::Count { expected: count, found: count - 1 }));
    let mut parameters = network.parameters();
    parameters[3] = 1e39;
    let large = SingleNetwork::new(&network.with_parameters(&parameters).expect("finite"));
    assert!(large.is_err_and(|e| e.to_string().ends_with("is not within single precision")));
    for sharpness in [1e-39, 1e39] {
        let architecture = Architecture { sharpness, ..network.architecture() };
        let sharp = Network::new(architecture, network.parameters()).expect("finite");
        assert!(SingleNetwork::new(&sharp).is_err(), "{sharpness}");
    }
}

#[test]
fn points_that_are_not_finite_stay_alone() {
    let network = network(architectures()[0], 9);
    let single = SingleNetwork::new(&network).expect("small weights");
    let mut points = points(30);
    let whole = single.jets(&points);
    points[4] = DVec3::new(0.0, f64::NAN, 0.0);
    let jets = single.jets(&points);
    for (i, (jet, before)) in jets.iter().zip(&whole).enumerate() {
        assert!(if i == 4 { jet.value.is_nan() && jet.gradient.is_nan() } else { jet == before }, "{i}");
    }
    assert!(single.values(&points)[4].is_nan());
}

struct Each<'a>(&'a [f32], f32);

impl WithSimd for Each<'_> {
    type Output = Vec<[f32; 3]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<[f32; 3]> {
        let softplus = Softplus::new(simd, self.1);
        let mut found = vec![];
        for &z in self.0 {
            let z = simd.splat_f32s(z);
            let [value, slope] = softplus.with_slope(simd, z);
            found.push([softplus.value(simd, z), value, slope].map(|x| simd.reduce_max_f32s(x)));
        }
        found
    }
}

/// The errors stated in the docs of the functions, and the limits on both sides.
#[test]
fn softplus_is_accurate() {
    for sharpness in [1.0_f32, 100.0] {
        let z: Vec<f32> = (-160_000..=160_000).map(|i| i as f32 / 2000.0 / sharpness).collect();
        let mut worst = [0.0_f64; 3];
        for (z, found) in z.iter().zip(Arch::new().dispatch(Each(&z, sharpness))) {
            let t = f64::from(sharpness * z);
            let value = (t.max(0.0) + (-t.abs()).exp().ln_1p()) / f64::from(sharpness);
            let slope = 1.0 / (1.0 + (-t).exp());
            for (worst, (found, expected)) in
                worst.iter_mut().zip(found.into_iter().zip([value, value, slope]))
            {
                *worst = worst.max((f64::from(found) / expected - 1.0).abs());
            }
        }
        println!("β = {sharpness}: σ {:.1e}, σ′ {:.1e}", worst[0], worst[2]);
        assert!(worst.iter().all(|&error| error < 3e-7), "{worst:?}");
    }
    let ends = Arch::new().dispatch(Each(&[-1e4, 1e4, f32::NAN, f32::INFINITY], 100.0));
    assert!(ends[0][0] < 1e-38 && ends[0][2] < 1e-36 && ends[1] == [1e4, 1e4, 1.0]);
    assert!(ends[2][0].is_nan() && ends[3][0] == f32::INFINITY, "{ends:?}");
}
