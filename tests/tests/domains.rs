//! The warp machinery on the circle and the sphere: unbiased, but only with the term −n u·V that the
//! curvature of these domains requires (`flatland::warp::Domain`).

use std::f64::consts::{PI, TAU};

use flatland::random::{Stream, open01, stream};
use flatland::warp::{AuxiliaryPoints, Circle, Debias, Domain, Draw, LinearField as _, Vector, Warp};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::{Moments, suite_threshold as limit};
use volume3d::Sphere;

/// A domain without the curvature term, as in existing implementations.
struct Flat<D>(std::marker::PhantomData<D>);

impl<D: Domain> Domain for Flat<D> {
    type Vector = D::Vector;
    const CURVATURE: f64 = 0.0;
    fn draw(u: D::Vector, kappa: f64, radial_exponent: f64, xi: [f64; 2]) -> Draw<D::Vector> {
        D::draw(u, kappa, radial_exponent, xi)
    }
    fn reflect(u: D::Vector, draw: &Draw<D::Vector>) -> Draw<D::Vector> {
        D::reflect(u, draw)
    }
    fn project(u: D::Vector, v: D::Vector) -> D::Vector {
        D::project(u, v)
    }
}

/// A cap of directions within an angle α of c that moves rigidly: velocity `spin`(u) inside, 0 outside,
/// weighted by the smooth function g(u) = u·e.
///
/// I = ∫ over the cap of u·e du, whose derivative is known.
struct Cap<V> {
    centre: V,
    angle: f64,
    weight: V,
}

/// f g ∇·V + f ∇g·V at a uniform point, times the measure of the domain.
fn sample<D: Domain>(
    cap: &Cap<D::Vector>,
    spin: &impl Fn(D::Vector) -> D::Vector,
    warp: &Warp,
    kappa: f64,
    u: D::Vector,
    measure: f64,
    rng: &mut Stream,
) -> f64 {
    let depth = |p: D::Vector| cap.angle - p.dot(cap.centre).clamp(-1.0, 1.0).acos();
    if depth(u) < 0.0 {
        return 0.0;
    }
    let stencil = warp.stencil::<D, _>(u, kappa, rng, |p| {
        let depth = depth(p);
        if depth > 0.0 { (Some(p), depth) } else { (None, f64::INFINITY) }
    });
    let field = stencil.field(|hit| hit.map_or(D::Vector::ZERO, spin));
    measure * (u.dot(cap.weight) * field.divergence + D::project(u, cap.weight).dot(field.value))
}

fn mean(samples: u64, seed: u64, sample: impl Fn(&mut Stream) -> f64 + Sync) -> Estimate {
    let chunk =
        |chunk| -> Moments { (0..samples / 64).map(|i| sample(&mut stream(seed, &[chunk, i]))).collect() };
    let chunks: Vec<Moments> = (0..64_u64).into_par_iter().map(chunk).collect();
    let all = chunks.into_iter().reduce(Moments::merge).expect("64 chunks");
    Estimate { mean: all.mean(), standard_error: all.standard_error() }
}

const SPHERE: Cap<DVec3> = Cap { centre: DVec3::Z, angle: 0.9, weight: DVec3::new(-0.3, 1.0, 0.5) };
const CIRCLE: Cap<DVec2> = Cap { centre: DVec2::X, angle: 0.9, weight: DVec2::new(0.5, 1.0) };

/// Number of samples, and seed.
type Effort = (u64, u64);

fn sphere<D: Domain<Vector = DVec3>>(
    warp: &Warp,
    kappa: f64,
    (samples, seed): Effort,
    spin: impl Fn(DVec3) -> DVec3 + Sync,
) -> Estimate {
    mean(samples, seed, |rng| {
        let (z, phi) = (2.0 * open01(rng) - 1.0, TAU * open01(rng));
        let r = (1.0 - z * z).sqrt();
        let u = DVec3::new(r * phi.cos(), r * phi.sin(), z);
        sample::<D>(&SPHERE, &spin, warp, kappa, u, 2.0 * TAU, rng)
    })
}

fn circle<D: Domain<Vector = DVec2>>(
    warp: &Warp,
    kappa: f64,
    (samples, seed): Effort,
    spin: impl Fn(DVec2) -> DVec2 + Sync,
) -> Estimate {
    mean(samples, seed, |rng| {
        let u = DVec2::from_angle(TAU * open01(rng));
        sample::<D>(&CIRCLE, &spin, warp, kappa, u, TAU, rng)
    })
}

/// Turning about x: ċ = x × z = −y. I = π sin²α c·e.
fn turning_sphere(warp: &Warp, kappa: f64, effort: Effort) -> (Estimate, f64) {
    let found = sphere::<Sphere>(warp, kappa, effort, |p| DVec3::X.cross(p));
    (found, -PI * 0.9_f64.sin().powi(2))
}

/// Turning: ċ = y. I = 2 sin α c·e.
fn turning_circle(warp: &Warp, kappa: f64, effort: Effort) -> (Estimate, f64) {
    (circle::<Circle>(warp, kappa, effort, DVec2::perp), 2.0 * 0.9_f64.sin())
}

fn compared((found, exact): (Estimate, f64)) -> Comparison {
    Comparison { found, reference: Estimate::exact(exact), limit: limit(), slack: 0.0 }
}

#[test]
fn unbiased_on_circle_and_sphere() {
    let mut power = Power::of("domains::unbiased_on_circle_and_sphere");
    let samples = pick(1 << 17, 1 << 18);
    for points in [AuxiliaryPoints::Antithetic, AuxiliaryPoints::Independent, AuxiliaryPoints::Stratified] {
        let warp = Warp { points, ..Warp::default() };
        for kappa in [2.0, 5.0, 100.0] {
            let both = [
                ("sphere", turning_sphere(&warp, kappa, (samples, 1))),
                ("circle", turning_circle(&warp, kappa, (samples, 2))),
            ];
            for (domain, found) in both {
                let label = format!("{domain}, {points:?} points, κ = {kappa}");
                compared(found).accept(&mut power, &label, found.1);
            }
        }
    }
}

/// The velocity of a cap that grows by one radian per unit of θ: along the meridians, of speed 1 on its edge.
fn growth<D: Domain>(cap: &Cap<D::Vector>) -> impl Fn(D::Vector) -> D::Vector {
    move |u| -D::project(u, cap.centre) * (1.0 / cap.angle.sin())
}

/// The same caps, growing. Their derivative is the integral of u·e over their edge.
fn growing_sphere<D: Domain<Vector = DVec3>>() -> (Estimate, f64) {
    let found = sphere::<D>(&Warp::default(), 5.0, (1 << 19, 4), growth::<D>(&SPHERE));
    (found, PI * 1.8_f64.sin() * SPHERE.weight.z)
}

fn growing_circle<D: Domain<Vector = DVec2>>() -> (Estimate, f64) {
    let found = circle::<D>(&Warp::default(), 5.0, (1 << 19, 5), growth::<D>(&CIRCLE));
    (found, 2.0 * 0.9_f64.cos() * CIRCLE.weight.x)
}

/// For a rotating cap the term averages out; for a growing cap it does not.
#[test]
fn without_the_curvature_term_both_are_biased() {
    let with = [growing_sphere::<Sphere>(), growing_circle::<Circle>()];
    let without = [growing_sphere::<Flat<Sphere>>(), growing_circle::<Flat<Circle>>()];
    let mut power = Power::of("domains::without_the_curvature_term_both_are_biased");
    for ((with, without), domain) in with.into_iter().zip(without).zip(["sphere", "circle"]) {
        compared(with).accept(&mut power, &format!("growing cap, {domain}"), with.1);
        compared(without).reject(&format!("{domain}, without the term"));
    }
}

#[test]
fn few_rays_are_biased_and_many_are_less_so() {
    let bias = |rays| {
        let warp = Warp { debias: Debias::Consistent { rays }, ..Warp::default() };
        let (found, exact) = turning_sphere(&warp, 100.0, (1 << 17, 3));
        found.mean / exact - 1.0
    };
    let (few, many) = (bias(4), bias(64));
    println!("bias at κ = 100: {:.1}% with 4 rays, {:.1}% with 64", 100.0 * few, 100.0 * many);
    assert!(few.abs() > 0.1 && many.abs() < 0.5 * few.abs(), "{few} {many}");
}
