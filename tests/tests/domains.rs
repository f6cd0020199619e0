//! The warp machinery on the circle and the sphere: unbiased there too, and only with the term
//! −n u·V that the curvature of these domains brings (theory, section 3).

use flatland::random::{Stream, open01, stream};
use flatland::warp::{AuxiliaryPoints, Circle, Debias, Domain, Draw, LinearField as _, Vector, Warp};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use tests::effort::pick;
use tests::power::{NOTICED, Power};
use tests::statistics::{Moments, suite_threshold as limit};
use volume3d::Sphere;

/// A domain that forgets its curvature: existing implementations.
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

/// A cap of directions within an angle α of c, moving rigidly: material velocity `spin`(u) inside,
/// stillness outside, seen through the smooth weight g(u) = u·e.
///
/// I = ∫ over the cap of u·e du, of which the derivative is known.
struct Cap<V> {
    centre: V,
    angle: f64,
    weight: V,
}

/// f g ∇·V + f ∇g·V at a uniform point, times the measure of the domain.
fn sample<D: Domain>(
    cap: &Cap<D::Vector>,
    spin: impl Fn(D::Vector) -> D::Vector,
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
    let field = stencil.field(|hit| hit.map_or(D::Vector::ZERO, &spin));
    measure * (u.dot(cap.weight) * field.divergence + D::project(u, cap.weight).dot(field.value))
}

fn mean(samples: u64, seed: u64, sample: impl Fn(&mut Stream) -> f64 + Sync) -> Moments {
    let chunks = (0..64_u64).into_par_iter().map(|chunk| {
        let mut moments = Moments::default();
        for i in 0..samples / 64 {
            moments.push(sample(&mut stream(seed, &[chunk, i])));
        }
        moments
    });
    let parts: Vec<Moments> = chunks.collect();
    parts.into_iter().reduce(Moments::merge).expect("64 chunks")
}

fn sphere<D: Domain<Vector = DVec3>>(warp: &Warp, kappa: f64, samples: u64, seed: u64) -> Moments {
    let cap = Cap { centre: DVec3::Z, angle: 0.9, weight: DVec3::new(-0.3, 1.0, 0.5) };
    // Turning about x: ċ = x × z = −y. I = π sin²α c·e.
    mean(samples, seed, |rng| {
        let (z, phi) = (2.0 * open01(rng) - 1.0, std::f64::consts::TAU * open01(rng));
        let r = (1.0 - z * z).sqrt();
        let u = DVec3::new(r * phi.cos(), r * phi.sin(), z);
        let measure = 2.0 * std::f64::consts::TAU;
        sample::<D>(&cap, |p| DVec3::X.cross(p), warp, kappa, u, measure, rng)
    })
}

fn circle<D: Domain<Vector = DVec2>>(warp: &Warp, kappa: f64, samples: u64, seed: u64) -> Moments {
    let cap = Cap { centre: DVec2::X, angle: 0.9, weight: DVec2::new(0.5, 1.0) };
    // Turning: ċ = y. I = 2 sin α c·e.
    mean(samples, seed, |rng| {
        let u = DVec2::from_angle(std::f64::consts::TAU * open01(rng));
        sample::<D>(&cap, DVec2::perp, warp, kappa, u, std::f64::consts::TAU, rng)
    })
}

const SPHERE_EXACT: fn() -> f64 = || -std::f64::consts::PI * 0.9_f64.sin().powi(2);
const CIRCLE_EXACT: fn() -> f64 = || 2.0 * 0.9_f64.sin();

fn z(moments: Moments, exact: f64) -> f64 {
    (moments.mean() - exact) / moments.standard_error()
}

/// Asserts that a mean is its exact value, and that it would not be with a bias that must be noticed.
fn accept(power: &mut Power, label: &str, moments: Moments, exact: f64) {
    let tolerance = limit() * moments.standard_error();
    println!("{label}: z = {:.2}", z(moments, exact));
    assert!((moments.mean() - exact).abs() < tolerance, "{label}: {moments:?} for {exact}");
    let less = (1.0 - NOTICED) * moments.mean() - exact;
    assert!(less.abs() > (1.0 - NOTICED) * tolerance, "{label} would pass with a bias of {NOTICED}");
    power.add(label, tolerance, exact);
}

/// Samples of a mean.
fn samples() -> u64 {
    pick(1 << 17, 1 << 19)
}

#[test]
fn unbiased_on_circle_and_sphere() {
    let mut power = Power::of("domains::unbiased_on_circle_and_sphere");
    for points in [AuxiliaryPoints::Antithetic, AuxiliaryPoints::Independent, AuxiliaryPoints::Stratified] {
        let warp = Warp { points, ..Warp::default() };
        for kappa in [2.0, 5.0, 100.0] {
            let label = |domain: &str| format!("{domain}, {points:?} points, κ = {kappa}");
            let on_sphere = sphere::<Sphere>(&warp, kappa, samples(), 1);
            accept(&mut power, &label("sphere"), on_sphere, SPHERE_EXACT());
            let on_circle = circle::<Circle>(&warp, kappa, samples(), 2);
            accept(&mut power, &label("circle"), on_circle, CIRCLE_EXACT());
        }
    }
    power.finish();
}

/// The velocity of a cap that grows by one radian per unit of θ: along the meridians, and 1 on its
/// edge.
fn growth<D: Domain>(centre: D::Vector, angle: f64) -> impl Fn(D::Vector) -> D::Vector {
    move |u| -D::project(u, centre) * (1.0 / angle.sin())
}

/// The same caps growing. Their derivative is the integral of u·e over their edge.
fn growing_sphere<D: Domain<Vector = DVec3>>(warp: &Warp, kappa: f64) -> (Moments, f64) {
    let cap = Cap { centre: DVec3::Z, angle: 0.9, weight: DVec3::new(-0.3, 1.0, 0.5) };
    let exact = std::f64::consts::PI * 1.8_f64.sin() * cap.weight.z;
    let moments = mean(1 << 19, 4, |rng| {
        let (z, phi) = (2.0 * open01(rng) - 1.0, std::f64::consts::TAU * open01(rng));
        let r = (1.0 - z * z).sqrt();
        let u = DVec3::new(r * phi.cos(), r * phi.sin(), z);
        let measure = 2.0 * std::f64::consts::TAU;
        sample::<D>(&cap, growth::<D>(cap.centre, cap.angle), warp, kappa, u, measure, rng)
    });
    (moments, exact)
}

fn growing_circle<D: Domain<Vector = DVec2>>(warp: &Warp, kappa: f64) -> (Moments, f64) {
    let cap = Cap { centre: DVec2::X, angle: 0.9, weight: DVec2::new(0.5, 1.0) };
    let exact = 2.0 * 0.9_f64.cos() * cap.weight.x;
    let moments = mean(1 << 19, 5, |rng| {
        let u = DVec2::from_angle(std::f64::consts::TAU * open01(rng));
        sample::<D>(&cap, growth::<D>(cap.centre, cap.angle), warp, kappa, u, std::f64::consts::TAU, rng)
    });
    (moments, exact)
}

/// For a cap that turns, the term averages out; for one that grows it does not.
#[test]
fn without_the_curvature_term_both_are_biased() {
    let warp = Warp::default();
    let with = [growing_sphere::<Sphere>(&warp, 5.0), growing_circle::<Circle>(&warp, 5.0)];
    let without = [growing_sphere::<Flat<Sphere>>(&warp, 5.0), growing_circle::<Flat<Circle>>(&warp, 5.0)];
    let mut power = Power::of("domains::without_the_curvature_term_both_are_biased");
    for ((with, without), domain) in with.into_iter().zip(without).zip(["sphere", "circle"]) {
        accept(&mut power, &format!("growing cap, {domain}"), with.0, with.1);
        let z = z(without.0, without.1);
        println!("without the term: z = {z:.1}");
        assert!(z.abs() > limit(), "{domain}: {z}");
    }
    power.finish();
}

#[test]
fn few_rays_are_biased_and_many_are_less_so() {
    let bias = |rays| {
        let warp = Warp { debias: Debias::Consistent { rays }, ..Warp::default() };
        sphere::<Sphere>(&warp, 100.0, 1 << 17, 3).mean() / SPHERE_EXACT() - 1.0
    };
    let (few, many) = (bias(4), bias(64));
    println!("bias at κ = 100: {:.1}% with 4 rays, {:.1}% with 64", 100.0 * few, 100.0 * many);
    assert!(few.abs() > 0.1 && many.abs() < 0.5 * few.abs(), "{few} {many}");
}
