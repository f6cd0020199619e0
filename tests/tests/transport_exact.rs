//! The exact engine of flat transport, compared with an oracle that shares no code with it on random worlds,
//! generic and degenerate; and with values known by an argument.

use flatland::plane::Filter;
use flatland::transport::Terms;
use flatland::transport::exact::{Exact, Radiosity};
use rayon::prelude::*;
use tests::effort::pick;
use tests::transport::constants::{Constant, constants};
use tests::transport::oracle::{self, PixelOracle};
use tests::transport::worlds::{Case, Kind, Knobs, Moving};

/// Rounding and quadrature allowed, relative to the sum of the absolute values of all terms.
const TOLERANCE: f64 = 1e-9;

/// The largest error of a case relative to its tolerance, and all pixels beyond it.
#[derive(Default)]
struct Findings {
    worst: f64,
    failures: Vec<String>,
}

impl Findings {
    fn compare(&mut self, what: &str, found: f64, expected: f64, scale: f64, tolerance: f64) {
        let allowed = tolerance * scale;
        let error = (found - expected).abs();
        self.worst = self.worst.max(if error == 0.0 { 0.0 } else { error / scale });
        // Not "error > allowed": NaN must fail too.
        let fine = error <= allowed;
        if !fine {
            self.failures.push(format!(
                "{what}: {found:e} for {expected:e}, off by {error:.1e}, allowed {allowed:.1e}"
            ));
        }
    }
}

/// Scale below which no correct answers can be distinguished: rounding of the terms of value and derivative.
/// The value contributes, as a derivative may have no terms at all.
fn scale(pixel: &PixelOracle) -> f64 {
    pixel.absolute + pixel.value.abs()
}

/// The smallest distance of a vertex from a segment that does not end in it, relative to the largest
/// coordinate.
fn gap(case: &Case) -> f64 {
    let world = &case.world;
    let mut gap = f64::INFINITY;
    for segment in world.segments() {
        let [a, b] = segment.ends();
        let others = world.vertices().enumerate().filter(|(v, _)| !segment.vertices.contains(v));
        for (_, p) in others {
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            gap = gap.min(p.distance(a.lerp(b, t)));
        }
    }
    gap / world.vertices().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// A surface point is rounded to ε of its coordinates and, at a distance g from a vertex, the direction of
/// that vertex to ε/g: where a light almost touches a receiver and approaches it, ε/g of the derivative is
/// rounding, however it is computed. Everything else must meet [`TOLERANCE`].
fn tolerance(case: &Case) -> f64 {
    TOLERANCE.max(2.0 * f64::EPSILON / gap(case))
}

/// The derivative of an exact engine from its terms; a control returns another value.
type Derivative = fn(Terms<f64>) -> f64;

fn compare(case: &Case, bounces: usize, derivative: Derivative) -> Findings {
    let exact = Exact { bounces, ..Exact::default() };
    let Case { world, camera, change, label } = case;
    let expected = oracle::image(world, camera, change, bounces);
    let mut findings = Findings::default();
    let pair = exact.image(world, camera).and_then(|i| Ok((i, exact.gradient(world, camera, change)?)));
    let (image, gradient) = match pair {
        Ok(pair) => pair,
        Err(e) => {
            findings.failures.push(format!("{label}: {e}"));
            return findings;
        }
    };
    let tolerance = tolerance(case);
    for (i, pixel) in expected.iter().enumerate() {
        let name = |what: &str| format!("{label}, {bounces} bounces, {what} of pixel {i}");
        findings.compare(&name("value"), image.pixels[i], pixel.value, pixel.value, tolerance);
        let found = derivative(gradient.pixels[i]);
        findings.compare(&name("derivative"), found, pixel.derivative, scale(pixel), tolerance);
    }
    findings
}

/// Cases of a kind with every change and every filter, `each` of every combination.
fn cases(kind: Kind, each: u64) -> Vec<Knobs> {
    let filters = [Filter::Box, Filter::Tent, Filter::Gaussian];
    let mut all = vec![];
    for (i, moving) in Moving::ALL.into_iter().enumerate() {
        for (j, filter) in filters.into_iter().enumerate() {
            let first = 1000 * (3 * i + j) as u64;
            all.extend((first..first + each).map(|seed| Knobs {
                moving,
                filter,
                ..Knobs::random(seed, kind)
            }));
        }
    }
    all
}

fn check(kinds: &[Kind], each: u64) {
    let mut failures = vec![];
    for &kind in kinds {
        let knobs = cases(kind, each);
        let run = |knobs: &Knobs| {
            let case = knobs.build();
            [0, 1].map(|bounces| compare(&case, bounces, Terms::total))
        };
        let found: Vec<Findings> = knobs.par_iter().flat_map_iter(run).collect();
        let worst = found.iter().map(|f| f.worst).fold(0.0, f64::max);
        println!("{kind:?}: {} worlds, worst relative error {worst:.1e}", knobs.len());
        failures.extend(found.into_iter().flat_map(|f| f.failures));
    }
    assert!(failures.is_empty(), "{} failures\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn generic_worlds() {
    check(&Kind::GENERIC, 3);
}

#[test]
fn degenerate_worlds() {
    check(&Kind::DEGENERATE, 2);
}

/// The tests above must be able to fail: each corruption of the derivative is noticed wherever it changes the
/// value. (Half of the worlds show no vertex on the film, and have no primary term to omit.)
#[test]
fn wrong_derivatives_are_noticed() {
    let controls: [(&str, Derivative); 6] = [
        ("zero", |_| 0.0),
        ("sign flipped", |t| -t.total()),
        ("no interior term", |t| t.primary + t.secondary),
        ("no primary term", |t| t.interior + t.secondary),
        ("no secondary term", |t| t.interior + t.primary),
        ("one part in 10⁷", |t| t.total() * (1.0 + 1e-7)),
    ];
    let cases: Vec<Case> = (0..20)
        .map(|seed| Knobs { moving: Moving::Mixed, ..Knobs::random(seed, Kind::Shadows) }.build())
        .collect();
    for (name, wrong) in controls {
        let is_wrong = |case: &&Case| {
            let exact = Exact::default();
            let gradient = exact.gradient(&case.world, &case.camera, &case.change).expect("differentiable");
            let mut pixels = gradient.pixels.iter().zip(&gradient.scales);
            pixels.any(|(t, scale)| (wrong(*t) - t.total()).abs() > 1e-8 * scale)
        };
        let (mut tried, mut passed) = (0, vec![]);
        for case in cases.iter().filter(is_wrong) {
            tried += 1;
            if compare(case, 1, wrong).failures.is_empty() {
                passed.push(&case.label);
            }
        }
        println!("{name}: {tried} of {} worlds", cases.len());
        assert!(tried >= 8 && passed.is_empty(), "{name}, of {tried}, passed: {passed:?}");
    }
}

#[test]
fn what_is_known_by_an_argument() {
    let mut findings = Findings::default();
    let filters = [Filter::Box, Filter::Tent, Filter::Gaussian];
    let mut count = 0;
    for bounces in [0, 1] {
        for Constant { case, value, derivative, .. } in constants(&filters, bounces) {
            count += 1;
            let Case { world, camera, change, label } = &case;
            let exact = Exact { bounces, ..Exact::default() };
            let image = exact.image(world, camera).unwrap_or_else(|e| panic!("{label}: {e}"));
            let gradient = exact.gradient(world, camera, change).unwrap_or_else(|e| panic!("{label}: {e}"));
            for i in 0..camera.film.pixels {
                if let Some(value) = value {
                    findings.compare(&format!("{label}, value"), image.pixels[i], value, value, 1e-11);
                }
                let (found, scale) = (gradient.pixels[i].total(), gradient.scales[i] + image.scales[i]);
                findings.compare(&format!("{label}, derivative"), found, derivative, scale, 1e-11);
            }
        }
    }
    println!("{count} worlds, worst relative error {:.1e}", findings.worst);
    assert!(findings.failures.is_empty(), "{}", findings.failures.join("\n"));
}

/// Radiosity of light scattered twice, where the oracle is a recursion of adaptive integrals: to
/// 10⁻⁶, which both state as their error.
#[test]
fn light_scattered_twice() {
    let kinds = [Kind::Shadows, Kind::Room];
    let knobs = kinds[..pick(1, 2)].iter().flat_map(|&kind| {
        (0..Moving::ALL.len()).map(move |i| {
            let moving = Moving::ALL[i];
            Knobs { moving, shapes: 1, pixels: 4, ..Knobs::random(300 + i as u64, kind) }
        })
    });
    let run = |case: &Case| {
        let Case { world, camera, change, label } = case;
        let expected = oracle::image(world, camera, change, 2);
        // The coarsest resolution states errors of about 10⁻⁹ of the scale: the oracle's are larger.
        let radiosity = Radiosity { bounces: Some(2), parts: 1, tolerance: 1e-8 };
        let [image, gradient] =
            radiosity.gradient(world, camera, change).unwrap_or_else(|e| panic!("{label}: {e}"));
        let mut findings = Findings::default();
        for (i, pixel) in expected.iter().enumerate() {
            let stated = format!("errors stated {:.1e} and {:.1e}", gradient.errors[i], pixel.error);
            let name = |what: &str| format!("{label}, {what} of pixel {i}, {stated}");
            findings.compare(&name("value"), image.pixels[i], pixel.value, pixel.value, 1e-6);
            findings.compare(&name("derivative"), gradient.pixels[i], pixel.derivative, scale(pixel), 1e-6);
        }
        findings
    };
    let cases: Vec<Case> = knobs.map(|k| k.build()).filter(is_diffuse).collect();
    let found: Vec<Findings> = cases.par_iter().map(run).collect();
    let worst = found.iter().map(|f| f.worst).fold(0.0, f64::max);
    println!("{} worlds, worst relative error {worst:.1e}", cases.len());
    let failures: Vec<String> = found.into_iter().flat_map(|f| f.failures).collect();
    assert!(
        cases.len() >= pick(8, 16) && failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures.join("\n")
    );
}

fn is_diffuse(case: &Case) -> bool {
    case.world.shapes().iter().all(|shape| shape.material().gloss.is_none())
}
