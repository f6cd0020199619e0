//! Shapes without a closed form, against central differences of dense images.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use flatland::plane::Filter;
use flatland::sdf::fields::{BangaruField, ViciniField};
use flatland::sdf::shapes::{Grid, Interpolation, Parametric as _, RoundedBox, Shape};
use flatland::sdf::{AngularFilm, Scene, Sdf as _, Shading, Tracer};
use glam::DVec2;
use tests::effort::thorough;
use tests::power::Power;

use super::case::Case;
use super::{SHADING, disc};

/// The angles that bound a shape in one piece around the angle `inside`, to rounding.
fn ends(scene: &Scene, inside: f64) -> [f64; 2] {
    [-1.0, 1.0].map(|side| {
        let (mut hit, mut miss) = (inside, inside + side);
        for _ in 0..60 {
            let middle = 0.5 * (hit + miss);
            let seen = scene.view().trace(DVec2::from_angle(middle)).hit().is_some();
            if seen { hit = middle } else { miss = middle }
        }
        hit
    })
}

/// The image of such a shape, by sums of `count` rays over each smooth piece, which α = a + (b − a)(1 − cos
/// πs)/2 concentrates at the square roots at its ends.
fn dense_image(scene: &Scene, film: &AngularFilm, inside: f64, count: usize) -> Vec<f64> {
    let silhouettes = ends(scene, inside);
    let of_pixel = |pixel: usize| {
        let centre = film.centre(pixel);
        let (low, high) = (centre - film.radius(), centre + film.radius());
        let mut cuts = vec![low, centre, high];
        cuts.extend(silhouettes.into_iter().filter(|&angle| low < angle && angle < high));
        cuts.sort_by(f64::total_cmp);
        let piece = |ends: &[f64]| {
            let half = 0.5 * (ends[1] - ends[0]);
            let at = |i: usize| {
                let (sin, cos) = (PI * (i as f64 + 0.5) / count as f64).sin_cos();
                let angle = ends[0] + half * (1.0 - cos);
                let radiance = scene.radiance(&scene.view().trace(DVec2::from_angle(angle)));
                film.value(angle - centre) * radiance * half * sin
            };
            PI / count as f64 * (0..count).map(at).sum::<f64>()
        };
        cuts.windows(2).map(piece).sum()
    };
    (0..film.count()).map(of_pixel).collect()
}

/// Central differences of [`dense_image`]. Rays within 10⁻⁹ radians of a silhouette count as misses at
/// ±h alike; h = 10⁻³ leaves h² of truncation, below the statistical error of the estimates by a factor
/// of 100.
fn measured(shape: Shape, shading: Shading, direction: Vec<f64>, inside: f64) -> Case {
    let (h, count) = (1e-3, 400);
    let tracer = Tracer { far: 5.0, step_scale: FRAC_1_SQRT_2, ..Tracer::default() };
    let film = AngularFilm::new(-0.5, 0.6, 12, Filter::Tent).expect("a film");
    let at = |h: f64| {
        let theta = shape.parameters().iter().zip(&direction).map(|(p, d)| p + h * d).collect::<Vec<_>>();
        let moved = shape.with_parameters(&theta).expect("still a shape");
        Scene::new(moved, DVec2::ZERO, tracer, shading, 0.3).expect("a scene")
    };
    let [plus, minus] = [h, -h].map(|h| dense_image(&at(h), &film, inside, count));
    let exact = plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * h)).collect();
    Case { scene: at(0.0), film, direction, exact }
}

/// The reference itself, on a disc, which has a closed form.
#[test]
fn central_differences_of_dense_images_are_exact_enough() {
    let direction = vec![0.5, 1.4, 1.0];
    let case = measured(disc(3.0, 0.2, 1.0), SHADING, direction.clone(), 0.06);
    let exact = Case::of(case.scene, case.film, direction).exact;
    let worst = case.exact.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("central differences: off by {worst:e}");
    assert!(worst < 1e-4, "{worst}");
}

/// Distances on a grid: a spline is smooth enough for both fields; bilinear interpolation, with ∇φ
/// discontinuous between cells, is not.
#[test]
fn grids_must_be_smooth() {
    let mut power = Power::of("sdf::grids_must_be_smooth");
    let corners = (DVec2::new(-0.5, -3.0), DVec2::new(5.5, 3.0));
    let value = |p: DVec2| (p - DVec2::new(3.0, 0.2)).length() - 1.0;
    // Without the normal, which is discontinuous where ∇φ is: the failure is due to the field, not the
    // shading.
    let flat = Shading { normal: DVec2::ZERO, ..SHADING };
    let case = |interpolation, shading| {
        let grid = Shape::Grid(Grid::sampled(interpolation, corners, 30, value).expect("a grid"));
        let direction = (0..grid.parameter_count()).map(|i| 0.5 + (1.3 * i as f64).sin()).collect();
        measured(grid, shading, direction, 0.06)
    };
    let smooth = case(Interpolation::Bicubic, SHADING);
    smooth.assert_right(
        &mut power,
        "bicubic grid, Bangaru",
        &smooth.traced(46_000, &BangaruField::default()),
    );
    if thorough() {
        let vicini = ViciniField::default();
        smooth.assert_right(&mut power, "bicubic grid, Vicini", &smooth.traced(36_000, &vicini));
    }
    let kinked = case(Interpolation::Bilinear, flat);
    kinked.assert_wrong("bilinear grid, Bangaru", &kinked.traced(6000, &BangaruField::default()));
}

/// Rounded corners are the remedy for corners.
#[test]
fn rounded_corners_are_smooth_silhouettes() {
    let mut power = Power::of("sdf::rounded_corners_are_smooth_silhouettes");
    let rounded = RoundedBox::new(DVec2::new(3.0, 0.2), DVec2::new(0.5, 0.4), 0.4, 0.2).expect("a box");
    let direction = vec![0.5, 1.4, 1.0, -0.2, 0.6, 0.8];
    let case = measured(Shape::Box(rounded), SHADING, direction, 0.06);
    case.assert_right(&mut power, "rounded box, Bangaru", &case.traced(36_000, &BangaruField::default()));
    case.assert_right(&mut power, "rounded box, Vicini", &case.traced(36_000, &ViciniField::default()));
}
