//! Along whole paths, forward and reverse mode are a linear map and its transpose, and no result depends on
//! the number of threads.

use flatland::estimator::transport::{EdgeSampling, Method, WarpedArea};
use flatland::transport::fields::Construction;
use flatland::transport::{Paths, Tangent};
use flatland::warp::{Debias, Warp};
use tests::transport::worlds::{Case, Kind, Knobs, Moving};

fn adjoint(case: &Case) -> Vec<f64> {
    (0..case.camera.film.pixels).map(|i| (3.1 * i as f64 + 0.4).sin()).collect()
}

/// ⟨adjoint, J θ̇⟩ = ⟨Jᵀ adjoint, θ̇⟩, relative to the sum of absolute terms.
fn dot_test(method: &impl Method, case: &Case) -> f64 {
    let adjoint = adjoint(case);
    let forward = method.forward(&case.world, &case.camera, &case.change).expect("a valid case");
    let reverse = method.reverse(&case.world, &case.camera, &adjoint).expect("a valid case");
    assert!(forward.non_finite.is_empty() && reverse.non_finite.is_empty(), "{}", case.label);
    let products: Vec<f64> = adjoint.iter().zip(forward.total()).map(|(a, g)| a * g).collect();
    let gradient = reverse.total();
    let terms = reverse.mean.to_array();
    let absolute =
        |c: &Tangent| c.values().zip(case.change.values()).map(|(g, t)| (g * t).abs()).sum::<f64>();
    let size = products.iter().map(|p| p.abs()).sum::<f64>() + terms.iter().map(absolute).sum::<f64>();
    (products.iter().sum::<f64>() - gradient.dot(&case.change)).abs() / size.max(f64::MIN_POSITIVE)
}

fn cases(kinds: &[Kind], each: u64) -> impl Iterator<Item = Case> + '_ {
    kinds.iter().flat_map(move |&kind| {
        (0..each).map(move |seed| {
            let moving = Moving::ALL[(seed % 10) as usize];
            Knobs { moving, pixels: 4, ..Knobs::random(70_000 + seed, kind) }.build()
        })
    })
}

/// Difference allowed between numbers that are equal up to rounding, relative to the sum of the absolute
/// values of all terms.
const ROUNDING: f64 = 1e-12;

#[test]
fn reverse_is_the_transpose_of_forward() {
    let constructions = [
        Construction::default(),
        Construction::Auxiliary(Warp::original(6)),
        Construction::Auxiliary(Warp {
            debias: Debias::RussianRoulette { rays: 4, tail: 1.5 },
            ..Warp::default()
        }),
        Construction::JumpMean { reach: 8.0 },
        Construction::Softened { reach: 8.0, softness: 2.0 },
        Construction::Harmonic,
        Construction::Direct,
        Construction::Followed { candidates: 4 },
    ];
    let mut worst = 0.0_f64;
    for (bounces, samples) in [(1, 20), (3, 20), (32, 6)] {
        let paths = Paths { bounces, ..Paths::default() };
        for case in cases(&Kind::GENERIC, 10) {
            let mut errors: Vec<f64> = constructions
                .into_iter()
                .map(|construction| {
                    let method = WarpedArea { samples, paths, construction, ..WarpedArea::default() };
                    dot_test(&method, &case)
                })
                .collect();
            errors.push(dot_test(&EdgeSampling { samples, paths, ..EdgeSampling::default() }, &case));
            for (method, error) in errors.into_iter().enumerate() {
                assert!(
                    error < ROUNDING,
                    "method {method} is off by {error:e} with {bounces} bounces on {}",
                    case.label
                );
                worst = worst.max(error);
            }
        }
    }
    println!("worst relative difference {worst:.1e}");
}

#[test]
fn reverse_is_the_transpose_of_forward_at_the_extremes() {
    let mut worst = 0.0_f64;
    for case in cases(&Kind::DEGENERATE, 10) {
        let paths = Paths { bounces: 2, ..Paths::default() };
        let warped = dot_test(&WarpedArea { samples: 20, paths, ..WarpedArea::default() }, &case);
        let edges = dot_test(&EdgeSampling { samples: 20, paths, ..EdgeSampling::default() }, &case);
        let error = warped.max(edges);
        assert!(error < ROUNDING, "off by {error:e} on {}", case.label);
        worst = worst.max(error);
    }
    println!("worst relative difference {worst:.1e}");
}

#[test]
fn the_same_bits_at_1_2_and_4_threads() {
    let case = cases(&[Kind::Room], 10).last().expect("a case");
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let paths = Paths { bounces: 3, ..Paths::default() };
            let warped = WarpedArea { samples: 40, paths, ..WarpedArea::default() };
            let edges = EdgeSampling { samples: 40, paths, ..EdgeSampling::default() };
            let methods: [&dyn Method; 2] = [&warped, &edges];
            let mut bits: Vec<u64> = vec![];
            for method in methods {
                let forward = method.forward(&case.world, &case.camera, &case.change).expect("valid");
                let reverse = method.reverse(&case.world, &case.camera, &adjoint(&case)).expect("valid");
                bits.extend(
                    forward.total().into_iter().chain(forward.standard_error.total).map(f64::to_bits),
                );
                bits.extend(
                    reverse.total().values().chain(reverse.standard_error.values()).map(f64::to_bits),
                );
            }
            let image = paths.image(&case.world, &case.camera, 40, 1).expect("valid");
            bits.extend(image.iter().flatten().copied().map(f64::to_bits));
            bits
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}
