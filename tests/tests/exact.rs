//! Three expressions of one number, on random scenes: interior + edge integral, interior + divergence
//! integral of the oracle field, and the derivative of the exact primal, from an oracle that shares no code
//! with the exact engine.

use flatland::plane::exact::{Arrangement, ExactError};
use flatland::plane::{Filter, Image};
use glam::DVec3;
use proptest::test_runner::{Config, TestCaseError, TestRunner};
use tests::effort::pick;
use tests::oracle::{self, PixelOracle};
use tests::scenes::{self, Case, Kind, Knobs};

/// Rounding allowed, relative to the sum of the absolute values of all terms.
const TOLERANCE: f64 = 1e-9;

/// The smallest nonzero distance from a vertex to an edge of another shape.
fn gap(case: &Case) -> f64 {
    let scene = &case.scene;
    let mut gap = f64::INFINITY;
    for (shape, edge) in scene.edges() {
        let [a, b] = edge.map(|v| scene.vertices()[v]);
        for other in (0..scene.shapes().len()).filter(|&other| other != shape) {
            for v in scene.vertex_range(other) {
                let p = scene.vertices()[v];
                let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                let distance = p.distance(a.lerp(b, t));
                gap = if distance > 1e-14 { gap.min(distance) } else { gap };
            }
        }
    }
    gap
}

/// Between boundaries at a distance g that move differently, the slope of the oracle field is their velocity
/// difference over g, and their crossing moves 1/g times as fast as they do: the divergence integral then
/// loses ε/g of the velocities to rounding, however it is computed. The edge integral does not lose them, and
/// must meet [`TOLERANCE`] in every case.
fn divergence_tolerance(case: &Case) -> f64 {
    TOLERANCE.max(100.0 * f64::EPSILON / gap(case)).min(1e-2)
}

/// Every pixel that fails, with the expected value.
fn mismatches(
    what: &str,
    tolerance: f64,
    found: &Image,
    expected: impl Fn(&PixelOracle) -> DVec3,
    oracle: &[PixelOracle],
) -> Vec<String> {
    let worst = |(i, (found, o)): (usize, (&DVec3, &PixelOracle))| {
        let error = (*found - expected(o)).abs().max_element();
        let allowed = tolerance * (o.absolute + o.value.abs().max_element());
        // Not "error > allowed": NaN must fail too.
        let fine = error <= allowed;
        (!fine).then(|| {
            format!(
                "{what} of pixel {i}: {found} instead of {}, off by {error:e}, allowed {allowed:e}",
                expected(o)
            )
        })
    };
    found.pixels().iter().zip(oracle).enumerate().filter_map(worst).collect()
}

fn check(case: &Case) -> Result<(), String> {
    let velocities = case.velocities();
    let oracle = oracle::image(&case.scene, &velocities, &case.film);
    let fail = |e: ExactError| format!("{e}\n{}", case.label);
    let arrangement = Arrangement::new(&case.scene, &case.film).map_err(fail)?;
    let primal = arrangement.primal(&case.film);
    let interior = arrangement.interior(&case.film, &velocities).map_err(fail)?;
    let boundary = arrangement.boundary(&case.film, &velocities).map_err(fail)?;
    let divergence = arrangement.divergence(&case.film, &arrangement.oracle(&velocities));
    let plus = |image: &Image| image.zip(&interior, |a, b| a + b);
    let mut failures = mismatches("primal", TOLERANCE, &primal, |o| o.value, &oracle);
    failures.extend(mismatches("interior + edge", TOLERANCE, &plus(&boundary), |o| o.derivative, &oracle));
    let tolerance = divergence_tolerance(case);
    failures.extend(mismatches(
        "interior + divergence",
        tolerance,
        &plus(&divergence),
        |o| o.derivative,
        &oracle,
    ));
    if failures.is_empty() { Ok(()) } else { Err(format!("{}\n{}", case.label, failures.join("\n"))) }
}

fn run(cases: u32, kinds: Vec<Kind>) {
    let mut runner = TestRunner::new_with_rng(
        Config { cases, failure_persistence: None, max_shrink_iters: 200, ..Config::default() },
        proptest::test_runner::TestRng::deterministic_rng(Config::default().rng_algorithm),
    );
    let result =
        runner.run(&scenes::knobs(kinds), |knobs: Knobs| check(&knobs.build()).map_err(TestCaseError::fail));
    result.unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn generic_scenes() {
    run(pick(100, 250), vec![Kind::Generic]);
}

#[test]
fn degenerate_scenes() {
    run(pick(200, 500), Kind::ALL[1..].to_vec());
}

#[test]
fn every_kind_of_degeneracy_with_every_filter() {
    for kind in Kind::ALL {
        for filter in [Filter::Box, Filter::Tent, Filter::Gaussian] {
            for seed in 0..pick(1, 4) {
                let case = Knobs { filter, ..Knobs::random(1000 + seed, kind) }.build();
                check(&case).unwrap_or_else(|e| panic!("{e}"));
            }
        }
    }
}

#[test]
fn where_there_is_no_derivative_the_answer_is_an_error_that_names_the_place() {
    let (mut edges, mut pixels) = (0, 0);
    for seed in 0..200 {
        let case = scenes::non_differentiable(seed);
        let arrangement = Arrangement::new(&case.scene, &case.film).expect("an arrangement");
        match arrangement.boundary(&case.film, &case.velocities()) {
            Err(ExactError::EdgesPart { first, second, .. }) => {
                assert_ne!(first, second);
                edges += 1;
            }
            Err(ExactError::PixelEdge { .. }) => pixels += 1,
            other => panic!("seed {seed}: {other:?}\n{}", case.label),
        }
    }
    assert_eq!((edges, pixels), (100, 100));
}

/// A wrong derivative, from the boundary and the interior term.
type Control = fn(DVec3, DVec3) -> DVec3;

/// The tests above must be able to fail: they notice each corruption of the answer.
#[test]
fn wrong_answers_are_noticed() {
    let mut tried = 0;
    for seed in 0..60 {
        let case = scenes::random(seed, Kind::Generic);
        let velocities = case.velocities();
        let oracle = oracle::image(&case.scene, &velocities, &case.film);
        let arrangement = Arrangement::new(&case.scene, &case.film).expect("an arrangement");
        let boundary = arrangement.boundary(&case.film, &velocities).expect("differentiable");
        let interior = arrangement.interior(&case.film, &velocities).expect("velocities fit");
        // Where nothing visible moves, or no shade is carried along, a control equals the truth.
        let moves = |image: &Image| image.pixels().iter().any(|p| p.abs().max_element() > 1e-2);
        if !moves(&boundary) || !moves(&boundary.zip(&interior, |b, i| b + i)) {
            continue;
        }
        tried += 1;
        let controls: [(&str, Control); 4] = [
            ("zero", |_, _| DVec3::ZERO),
            ("sign flipped", |b, i| i - b),
            ("interior only", |_, i| i),
            ("one part in 10⁷", |b, i| (b + i) * (1.0 + 1e-7)),
        ];
        for (name, wrong) in controls {
            let failures =
                mismatches(name, TOLERANCE, &boundary.zip(&interior, wrong), |o| o.derivative, &oracle);
            assert!(!failures.is_empty(), "{name} passed on {}", case.label);
        }
    }
    assert!(tried > 40, "{tried}");
}
