//! A field along a scan of directions, and its discontinuities away from silhouettes.

use flatland::random::stream;
use flatland::sdf::Tracer;
use flatland::sdf::fields::{BangaruField, ViciniField};
use glam::DVec3;

use super::shapes::Subject;
use super::study::{Method, tracer, vicini};

/// The angles of a scan, to both sides of the axis.
const REACH: f64 = 0.55;
/// Bounds on the change between neighbours of a continuous field, and on what bisection leaves of it.
const SUSPECT: f64 = 1e-3;
const JUMP: f64 = 1e-7;
/// Number of points that a field keeps of a ray's points.
const KEPT: usize = 14;

/// V along a scan.
pub(super) struct Scan {
    pub(super) name: String,
    /// The angle in degrees, and V along the scan in radians per unit of time.
    pub(super) values: Vec<[f64; 2]>,
    /// Sizes of the discontinuities where what the ray sees is continuous.
    pub(super) jumps: Vec<f64>,
}

/// The scan of the default field with the default tracer.
pub(super) const DEFAULT: &str = "Vicini et al., default tolerance";

/// A direction's field, whether its ray hits, and the number of its points.
#[derive(Clone, Copy)]
struct Seen {
    value: DVec3,
    hits: bool,
    points: usize,
}

/// All scans: default fields where they are continuous, and three that are not.
pub(super) fn scans(smooth: &Subject, plain: &Subject, count: u32) -> Vec<Scan> {
    let everywhere = Method::Vicini(ViciniField { reach: None, ..vicini() });
    let all = Method::Bangaru(BangaruField::default());
    let few = Method::Bangaru(BangaruField { keep: Some(KEPT), ..BangaruField::default() });
    vec![
        scan("Vicini et al.", smooth, Method::Vicini(vicini()), fine(), count),
        scan("Bangaru et al.", smooth, all, fine(), count),
        scan(DEFAULT, smooth, Method::Vicini(vicini()), tracer(), count),
        scan(&format!("Bangaru et al., {KEPT} points"), smooth, few, fine(), count),
        scan("Bangaru et al., plain union", plain, all, fine(), count),
        scan("Vicini et al., any distance, plain union", plain, everywhere, fine(), count),
    ]
}

/// A tracer accurate almost to rounding.
fn fine() -> Tracer {
    Tracer { tolerance: 1e-10, max_steps: 20_000, ..tracer() }
}

fn scan(name: &str, subject: &Subject, method: Method, tracer: Tracer, count: u32) -> Scan {
    let direction = |angle: f64| DVec3::new(angle.sin(), 0.07 * angle.cos(), angle.cos()).normalize();
    let at = |angle: f64| {
        let omega = direction(angle);
        let value = method.field(subject, tracer, omega, &mut stream(0, &[])).map_or(DVec3::ZERO, |(v, _)| v);
        let trace = subject.view(tracer).trace(omega);
        Seen { value, hits: trace.hit().is_some(), points: trace.points.len() }
    };
    let angle = |i: u32| REACH * (2.0 * f64::from(i) / f64::from(count) - 1.0);
    let all: Vec<Seen> = (0..=count).map(|i| at(angle(i))).collect();
    let jumps = (0..count).zip(all.windows(2)).filter_map(|(i, pair)| {
        let suspect = pair[0].points != pair[1].points || change(pair[0], pair[1]) > SUSPECT;
        if suspect { jump([(angle(i), pair[0]), (angle(i + 1), pair[1])], at) } else { None }
    });
    let jumps: Vec<f64> = jumps.collect();
    let value = |(i, seen): (u32, &Seen)| {
        let across = DVec3::new(angle(i).cos(), 0.0, -angle(i).sin());
        [angle(i).to_degrees(), seen.value.dot(across)]
    };
    Scan { name: name.to_owned(), values: (0..).zip(&all).map(value).collect(), jumps }
}

fn change(a: Seen, b: Seen) -> f64 {
    (b.value - a.value).length()
}

/// The change that remains after bisection, unless what the ray sees changes.
fn jump([mut low, mut high]: [(f64, Seen); 2], at: impl Fn(f64) -> Seen) -> Option<f64> {
    for _ in 0..40 {
        let middle = 0.5 * (low.0 + high.0);
        let found = at(middle);
        if change(low.1, found) >= change(found, high.1) {
            high = (middle, found);
        } else {
            low = (middle, found);
        }
    }
    let left = change(low.1, high.1);
    (low.1.hits == high.1.hits && left > JUMP).then_some(left)
}
