use glam::DVec2;

use super::*;
use crate::random::{open01, stream};
use crate::warp::{BoundaryFunction, Circle, Debias, LinearField as _, Plane, WarpError, assert_transposed};

/// A strip of moving material seen from a fixed direction: velocity v inside, at x < 0, and static background
/// elsewhere.
fn strip(point: DVec2) -> (DVec2, f64) {
    if point.x < 0.0 { (DVec2::new(1.0, 0.5), -point.x) } else { (DVec2::ZERO, f64::INFINITY) }
}

fn warp(debias: Debias) -> Warp {
    Warp { debias, ..Warp::default() }
}

#[test]
fn the_divergence_is_that_of_the_field() {
    // With one auxiliary set kept in place, V(u) is a smooth function of u: compare the
    // stencil's ∇·V with central differences of its V, rebuilt by hand.
    fn check<D: Domain<Vector = DVec2>>(
        u: DVec2,
        moved: impl Fn(f64) -> DVec2,
        exponent: impl Fn(DVec2, DVec2) -> f64,
    ) {
        let kappa = 6.0;
        let velocity = |p: DVec2| DVec2::new(1.0 + p.y, p.x * p.x - 0.3);
        let boundary = |p: DVec2| (p.x * 0.7).abs();
        let warp = warp(Debias::Consistent { rays: 10 });
        let stencil = warp.stencil::<D, _>(u, kappa, &mut stream(1, &[]), |p| (p, boundary(p)));
        // The same draws repeated, for their densities.
        let mut draws = vec![];
        warp.points.draw::<D>(u, kappa, warp.radial_exponent, 10, &mut stream(1, &[]), &mut draws);
        let value = |at: DVec2| {
            let scale = 0.4 * kappa.sqrt();
            let (mut z, mut a) = (0.0, DVec2::ZERO);
            for draw in &draws {
                let p = draw.point;
                let b = (scale * boundary(p)).powi(2).min(1.0);
                // w at the new position over the density at the old one.
                let w = (exponent(at, p).exp_m1() + b).powf(-1.5) / draw.log_density.exp();
                z += w;
                a += w * velocity(p);
            }
            D::project(at, a / z)
        };
        let field = stencil.field(|&p| velocity(p));
        assert!((field.value - value(u)).length() < 1e-12);
        let h = 1e-6;
        let tangents: &[f64] = if D::CURVATURE == 0.0 { &[0.0, 1.0] } else { &[0.0] };
        let divergence: f64 = tangents
            .iter()
            .map(|&k| {
                let (plus, minus) =
                    if k == 0.0 { (moved(h), moved(-h)) } else { (u + h * DVec2::Y, u - h * DVec2::Y) };
                let tangent = (plus - minus).normalize();
                (value(plus) - value(minus)).dot(tangent) / (2.0 * h)
            })
            .sum();
        assert!(
            (field.divergence - divergence).abs() < 1e-6 * (1.0 + divergence.abs()),
            "{field:?} {divergence}"
        );
    }
    let u = DVec2::new(0.2, -0.1);
    check::<Plane>(u, |h| u + h * DVec2::X, |a, b| 3.0 * (a - b).length_squared());
    check::<Circle>(DVec2::from_angle(1.3), |h| DVec2::from_angle(1.3 + h), |a, b| 6.0 * (1.0 - a.dot(b)));
}

#[test]
fn scatter_is_the_transpose_of_field() {
    for debias in [
        Debias::Consistent { rays: 7 },
        Debias::RussianRoulette { rays: 4, tail: 1.5 },
        Debias::Multilevel { rays: 4, first: 0.9, ratio: 0.45 },
    ] {
        for seed in 0..50 {
            let mut rng = stream(seed, &[]);
            let u = DVec2::from_angle(6.0 * open01(&mut rng));
            let stencil = warp(debias).stencil::<Circle, _>(u, 9.0, &mut rng, |p| (p, p.x.abs()));
            let velocity = |p: &DVec2| DVec2::new(p.y * 3.0, 1.0 - p.x);
            assert_transposed(&stencil, (DVec2::new(0.3, -1.2), 0.7), velocity, DVec2::dot);
        }
    }
}

#[test]
fn a_common_velocity_is_kept_and_has_no_divergence() {
    for debias in [Debias::Consistent { rays: 16 }, Debias::default()] {
        let stencil =
            warp(debias).stencil::<Plane, _>(DVec2::new(0.3, 0.2), 50.0, &mut stream(1, &[]), strip);
        let field = stencil.field(|_| DVec2::new(2.0, -1.0));
        assert!((field.value - DVec2::new(2.0, -1.0)).length() < 1e-12);
        assert!(field.divergence.abs() < 1e-10);
    }
}

#[test]
fn the_field_reaches_the_boundary_velocity_as_rays_grow() {
    // On the strip's edge V·ν must become 1; where γ equals its bound, only slowly.
    let value = |rays, gamma| {
        let boundary = BoundaryFunction::KernelScaled { scale: 0.6 };
        let weighting = Weighting::BoundaryAware { gamma, boundary };
        let warp = Warp { weighting, ..warp(Debias::Consistent { rays }) };
        let u = DVec2::new(1e-12, 0.0);
        let at = |seed| {
            let s = warp.stencil::<Plane, _>(u, 100.0, &mut stream(seed, &[]), strip);
            s.field(|&v| v).value.x
        };
        (0..400).map(at).sum::<f64>() / 400.0
    };
    let (few, many) = (value(16, 3.0), value(16_384, 3.0));
    assert!(few < many && many > 0.95, "{few} {many}");
    assert!(value(16_384, 1.0) < 0.9, "γ below its bound must not reach the boundary's velocity");
}

#[test]
fn nothing_overflows_at_the_extremes() {
    for kappa in [1e-6_f64, 1.0, 1e12, 1e200] {
        for gamma in [0.5, 3.0, 40.0] {
            let width = kappa.sqrt().recip();
            for at in [0.0, 1e-15, -1e-15, 1e-3, -3.0] {
                for rays in [1, 2, 16] {
                    let warp = Warp {
                        weighting: Weighting::BoundaryAware { gamma, boundary: BoundaryFunction::default() },
                        ..warp(Debias::Consistent { rays })
                    };
                    let u = DVec2::new(at * width, 0.0);
                    let s = warp.stencil::<Plane, _>(u, kappa, &mut stream(rays as u64, &[]), strip);
                    let field = s.field(|&v| v);
                    assert!(
                        field.value.is_finite() && field.divergence.is_finite(),
                        "{kappa} {gamma} {at} {rays}"
                    );
                }
            }
        }
    }
}

#[test]
fn bad_parameters_are_refused() {
    let good = Warp::default();
    assert_eq!(good.check(1.0), Ok(()));
    assert!(matches!(good.check(f64::NAN), Err(WarpError::Kappa { .. })));
    let weighting = Weighting::BoundaryAware { gamma: -1.0, boundary: BoundaryFunction::default() };
    assert!(matches!(Warp { weighting, ..good }.check(1.0), Err(WarpError::Gamma { .. })));
    let boundary = BoundaryFunction::SceneScaled { scale: 0.0 };
    let weighting = Weighting::BoundaryAware { gamma: 3.0, boundary };
    assert!(matches!(Warp { weighting, ..good }.check(1.0), Err(WarpError::Scale { .. })));
    let debias = Debias::Consistent { rays: 0 };
    assert!(matches!(Warp { debias, ..good }.check(1.0), Err(WarpError::Debias { .. })));
}
