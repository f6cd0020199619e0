//! Discontinuities of a field along a scan of directions, away from silhouettes.

use flatland::random::stream;
use flatland::sdf::fields::{BangaruField, TracedField};
use flatland::sdf::{Tracer, View};
use flatland::warp::LinearField as _;
use glam::DVec3;
use volume3d::Sphere;

use super::case::Case;
use super::outputs::Outputs;
use super::{sphere, union, vicini};

/// Directions of a scan.
const COUNT: u32 = 4000;
/// Largest change between neighbours of a field without discontinuities, and of the remainder after
/// bisection.
const SUSPECT: f64 = 1e-3;
const JUMP: f64 = 1e-7;

/// V, whether the ray hits, and how many points it has.
type Seen = (DVec3, bool, usize);

fn scan(case: &Case, field: &dyn TracedField<Sphere>) -> usize {
    let tracer = Tracer { tolerance: 1e-10, max_steps: 20_000, ..case.tracer };
    let view = View { sdf: case.sdf.as_ref(), eye: DVec3::ZERO, start: 0.0, tracer };
    let at = |angle: f64| -> Seen {
        let omega = DVec3::new(angle.sin(), 0.07 * angle.cos(), angle.cos()).normalize();
        let form = field.form(&view, omega, &mut stream(0, &[]));
        let trace = view.trace(omega);
        let value = form.field(|x| case.sdf.rate(*x, &case.direction)).value;
        (value, trace.hit().is_some(), trace.points.len())
    };
    let angle = |i: u32| -0.55 + 1.1 * f64::from(i) / f64::from(COUNT);
    let all: Vec<Seen> = (0..=COUNT).map(|i| at(angle(i))).collect();
    let mut jumps = 0;
    for (i, pair) in (0..COUNT).zip(all.windows(2)) {
        let change = |a: Seen, b: Seen| (b.0 - a.0).length();
        if pair[0].2 == pair[1].2 && change(pair[0], pair[1]) <= SUSPECT {
            continue;
        }
        let (mut low, mut high) = ((angle(i), pair[0]), (angle(i + 1), pair[1]));
        for _ in 0..40 {
            let middle = 0.5 * (low.0 + high.0);
            let found = at(middle);
            let lower = change(low.1, found) >= change(found, high.1);
            if lower { high = (middle, found) } else { low = (middle, found) }
        }
        // At silhouettes V has its prescribed value, and bisection ends where rounding decides.
        let silhouette = low.1.1 != high.1.1;
        jumps += usize::from(!silhouette && change(low.1, high.1) > JUMP);
    }
    jumps
}

#[test]
fn default_fields_do_not_jump() {
    for case in [sphere(Outputs::Film), union(Outputs::Film, 0.5)] {
        assert_eq!(scan(&case, &vicini()), 0, "{}, Vicini", case.name);
        assert_eq!(scan(&case, &BangaruField::default()), 0, "{}, Bangaru", case.name);
    }
    let kinked = scan(&union(Outputs::Film, 0.0), &BangaruField::default());
    let dropped =
        scan(&union(Outputs::Film, 0.5), &BangaruField { keep: Some(14), ..BangaruField::default() });
    println!("{kinked} jumps on the medial axis, {dropped} where points come and go");
    assert!(kinked > 0 && dropped > 0);
}
