use flatland::plane::Image;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::*;
use crate::effort::pick;
use crate::oracle;
use crate::space::worlds::{
    CoverageCase, CoverageKind, CoverageKnobs, CrossingKind, CrossingKnobs, CrossingMoving,
};

fn cut(case: &CoverageCase) -> ProjectedScene {
    let CoverageCase { mesh, camera, motion, filter, label } = case;
    ProjectedScene::cut(mesh, camera, motion, *filter).unwrap_or_else(|e| panic!("{e}\n{label}"))
}

fn cases(seeds: std::ops::Range<u64>) -> Vec<CrossingKnobs> {
    let movings = [&CrossingMoving::AT_REST[..], &CrossingMoving::MOVING].concat();
    let pairs = CrossingKind::ALL.iter().flat_map(|&k| movings.iter().map(move |&m| (k, m)));
    pairs.flat_map(|(k, m)| seeds.clone().map(move |s| CrossingKnobs::random(s, k, m))).collect()
}

/// The worst of a figure over some cases, and which case that is.
fn worst(cases: Vec<CrossingKnobs>, figure: impl Fn(&CoverageCase) -> f64 + Sync) -> (f64, String) {
    let figures = cases.into_par_iter().map(|knobs| {
        let case = knobs.build();
        let figure = figure(&case);
        (if figure.is_nan() { f64::INFINITY } else { figure }, case.label)
    });
    figures.reduce(|| (0.0, String::new()), |a, b| if b.0 > a.0 { b } else { a })
}

fn largest(image: &Image) -> f64 {
    image.pixels().iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// I(θ), of the mesh and the camera moved, cut where it crosses then.
fn image_at(case: &CoverageCase, theta: f64) -> Option<Image> {
    let mesh = case.mesh.displaced(&case.motion, theta);
    let camera = case.camera.displaced(&case.motion.camera, theta);
    ProjectedScene::cut(&mesh, &camera, &case.motion, case.filter).ok()?.image().ok()
}

/// By how much differences deny a derivative: above 1 they do.
///
/// Richardson's extrapolation (4 D(h/2) − D(h))/3 of central differences D is off by O(h⁴) while
/// nothing flips over within h, and by rounding over h; the best of a sweep is what counts. Of 432
/// other cases, the worst best step was off by 3e-9 of the derivative.
fn denial(case: &CoverageCase, derivative: &Image) -> f64 {
    let central = |h: f64| {
        let (after, before) = (image_at(case, h)?, image_at(case, -h)?);
        Some(after.zip(&before, |a, b| (a - b) / (2.0 * h)))
    };
    let coordinates = case.mesh.positions.iter().map(|p| p.length() / p.distance(case.camera.origin));
    let rounding = f64::EPSILON * case.camera.pixels_per_slope() * coordinates.fold(1.0, f64::max);
    let excess = |h: f64| {
        let quotient = central(0.5 * h)?.zip(&central(h)?, |half, whole| (4.0 * half - whole) / 3.0);
        let error = largest(&quotient.zip(derivative, |a, b| a - b));
        Some(error / (2e-8 * largest(derivative).max(1e-2) + 4.0 * rounding / h))
    };
    [1e-3, 1e-4, 1e-5, 1e-6].into_iter().filter_map(excess).fold(f64::INFINITY, f64::min)
}

#[test]
fn derivatives_are_limits_of_differences() {
    let (excess, label) =
        worst(cases(0..pick(1, 2)), |case| denial(case, &cut(case).derivative().expect("a derivative")));
    println!("worst: {excess:.3} of what is allowed, {label}");
    assert!(excess < 1.0, "{excess} of what is allowed, {label}");
}

#[test]
fn wrong_derivatives_are_denied() {
    for knobs in cases(0..1).into_iter().step_by(pick(5, 2)) {
        let case = knobs.build();
        let exact = cut(&case).derivative().expect("a derivative");
        for factor in [0.0, -1.0, 1.0 + 1e-6] {
            let wrong = exact.zip(&exact, |d, _| factor * d);
            let is_still = largest(&exact) < 1e-2;
            assert!(is_still || denial(&case, &wrong) > 1.0, "{factor} times that of {}", case.label);
        }
    }
}

#[test]
fn derivatives_and_values_are_those_of_the_slab_oracle() {
    let error = |case: &CoverageCase| {
        let projected = cut(case);
        let (image, derivative) =
            (projected.image().expect("an image"), projected.derivative().expect("one"));
        let slabs = oracle::image(projected.scene(), projected.velocities(), projected.film());
        let errors =
            slabs.iter().zip(image.pixels()).zip(derivative.pixels()).map(|((slab, value), rate)| {
                let error =
                    (slab.value - value).abs().max_element() + (slab.derivative - rate).abs().max_element();
                error / (1.0 + slab.absolute)
            });
        errors.fold(0.0, f64::max)
    };
    let (error, label) = worst(cases(100..101).into_iter().step_by(3).collect(), error);
    println!("worst: {error:e}, {label}");
    assert!(error < 1e-9, "{error:e}, {label}");
}

/// The radiance of the nearest triangle along a ray (Möller and Trumbore 1997); NaN where its front
/// looks away.
fn cast(case: &CoverageCase, direction: DVec3) -> DVec3 {
    let mut nearest = (f64::INFINITY, case.mesh.background);
    for (corners, radiance) in case.mesh.triangles.iter().zip(&case.mesh.radiance) {
        let [a, b, c] = corners.map(|v| case.mesh.positions[v] - case.camera.origin);
        let across = direction.cross(c - a);
        let determinant = across.dot(b - a);
        let along = (-a).cross(b - a);
        let (u, v) = (across.dot(-a) / determinant, along.dot(direction) / determinant);
        let t = along.dot(c - a) / determinant;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < nearest.0 {
            nearest = (t, if determinant > 0.0 { *radiance } else { DVec3::NAN });
        }
    }
    nearest.1
}

#[test]
fn the_plane_shows_what_rays_hit() {
    const SIDE: usize = 60;
    let wrong = |case: &CoverageCase| {
        let projected = cut(case);
        let size = DVec2::new(case.camera.width as f64, case.camera.height as f64);
        let points = (0..SIDE * SIDE)
            .map(|i| size * DVec2::new((i % SIDE) as f64 + 0.41, (i / SIDE) as f64 + 0.37) / SIDE as f64);
        let is_wrong = |u: &DVec2| {
            let scene = projected.scene();
            scene.value(scene.hit(*u).as_ref(), *u) != cast(case, case.camera.direction(*u))
        };
        points.filter(is_wrong).count() as f64
    };
    let (wrong, label) = worst(cases(200..202), wrong);
    assert!(wrong < 1.0, "{wrong} points, {label}");
}

/// Nothing is cut where nothing crosses, and a mesh that crosses has no order uncut.
#[test]
fn what_does_not_cross_stays_whole() {
    for kind in CoverageKind::GENERIC {
        for seed in 0..4 {
            let case = CoverageKnobs::random(seed, kind).build();
            let CoverageCase { mesh, camera, motion, filter, .. } = &case;
            if !crossings(mesh, motion).expect("valid").is_empty() {
                continue;
            }
            let whole = ProjectedScene::new(mesh, camera, motion, *filter).expect("an order");
            let (a, b) = (whole.derivative().expect("one"), cut(&case).derivative().expect("one"));
            assert!(largest(&a.zip(&b, |a, b| a - b)) < 1e-12 * (1.0 + largest(&a)), "{}", case.label);
        }
    }
    for knobs in cases(0..2) {
        let CoverageCase { mesh, camera, motion, filter, label } = knobs.build();
        let refused = ProjectedScene::new(&mesh, &camera, &motion, filter).map(|_| ());
        assert!(matches!(refused, Err(CoverageError::Intersect { .. })), "{refused:?} {label}");
    }
}
