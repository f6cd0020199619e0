//! Tests of edges that coincide with borders of box-filtered pixels.

use glam::DVec3;

use super::{at, film};
use crate::geometry::Mesh;
use crate::gradient::{
    ActiveParameters, EdgeSampling, Field, FiniteDifference, GradientImage, OnPixelBorders, Progress,
    Tangent, WarpedArea,
};
use crate::scene::{Camera, Description, Filter, Scene};

/// A square of radiance 1 that covers pixels 4 to 11 of 16 in both directions, moved to the right by a
/// fraction of a pixel.
fn scene(moved: f64, filter: Filter) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 2.0 * 0.25_f64.atan());
    let mut d = Description::new(camera, film(16, filter));
    d.integrator.max_depth = Some(2);
    d.add_emitter("square", Mesh::rectangle().transformed(&at(moved / 8.0, 0.0, 0.0, 0.5)), DVec3::ONE);
    Scene::new(d).unwrap()
}

type Run<'r> = &'r dyn Fn(&Scene, &Tangent) -> GradientImage;

/// Calls `f` with every method and its name.
fn each_method(mut f: impl FnMut(&str, Run<'_>)) {
    let none = Progress::none();
    let (film, lobe) = (1.2, 0.5);
    for softness in [0.4, 5.0] {
        let field = Field::Softened { film, lobe, softness, silhouettes: 16, shadows: 0, bounces: 0 };
        let method = WarpedArea { field, samples: 64, seed: 1, ..WarpedArea::default() };
        f(&format!("softened, {softness}"), &|scene, change| method.forward(scene, change, &none).unwrap());
    }
    let method = WarpedArea { samples: 256, seed: 1, ..WarpedArea::default() };
    f("mean over jumps", &|scene, change| method.forward(scene, change, &none).unwrap());
    let method = EdgeSampling { samples: 2, primary: 64, seed: 1, ..EdgeSampling::default() };
    f("edge sampling", &|scene, change| method.forward(scene, change, &none).unwrap());
    let method = FiniteDifference { samples: 512, step: 0.1, seed: 1 };
    f("finite differences", &|scene, change| method.forward(scene, change, &none).unwrap());
}

/// The mean derivative of a column's pixels away from the square's corners, and its standard error.
fn of_column(image: &GradientImage, x: usize) -> (f64, f64) {
    let rows = 5..11;
    let mean = rows.clone().map(|y| image.gradient.pixels[y * 16 + x].x).sum::<f64>() / 6.0;
    let error = rows.map(|y| image.standard_error.pixels[y * 16 + x].x.powi(2)).sum::<f64>().sqrt() / 6.0;
    (mean, error)
}

/// Pixels on both sides of the border have the mean of the two one-sided derivatives, by every method; with
/// the edge a millionth of a pixel away they have one of them. A method that gave all to one pixel, or a part
/// of a softened field to the wrong one, would be off by half.
#[test]
fn pixels_on_both_sides_have_the_mean_of_one_sided_derivatives() {
    for (moved, [inner, outer]) in [(0.0, [0.5, 0.5]), (1e-15, [0.5, 0.5]), (1e-6, [0.0, 1.0])] {
        let scene = scene(moved, Filter::Box);
        let mut right = Tangent::still(&scene);
        right.translate(&scene, 0, DVec3::X / 8.0);
        // Edges move outward by a pixel.
        let mut grows = Tangent::still(&scene);
        grows.scale(&scene, 0, DVec3::ZERO, 0.25);
        each_method(|name, run| {
            let one_sided = moved > 1e-9 && name == "finite differences";
            for (change, left) in [(&right, -1.0), (&grows, 1.0)] {
                let image = run(&scene, change);
                // Edges at 4 and 12; moved a little to the right they lie within pixels 4 and 12.
                let expected = [left * outer, left * inner, inner, outer];
                let at = if moved > 1e-9 { [4, 3, 11, 12] } else { [3, 4, 11, 12] };
                for (x, expected) in at.into_iter().zip(expected).filter(|_| !one_sided) {
                    let (found, error) = of_column(&image, x);
                    assert!(
                        (found - expected).abs() <= 6.5 * error + 2e-3 && error < 0.05,
                        "{name}, moved by {moved:e}, column {x}: {found} ± {error} for {expected}"
                    );
                }
                let total = image.regions.total.x;
                let exact = if left < 0.0 { 0.0 } else { 32.0 };
                let error = image.regions.total_error.x;
                assert!(
                    (total - exact).abs() <= 6.5 * error + 0.05 && error < 1.5,
                    "{name}, moved by {moved:e}: {total} ± {error} for {exact} in all"
                );
            }
        });
    }
}

/// Forward and reverse mode are transposes also for edges on pixel borders.
#[test]
fn on_borders_reverse_is_the_transpose_of_forward() {
    let scene = scene(0.0, Filter::Box);
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::new(0.3, -0.7, 0.2));
    let mut active = ActiveParameters::nothing(&scene);
    active.shapes[0] = true;
    let none = Progress::none();
    let adjoint = super::random_adjoint(scene.size());
    let field = Field::softened(8);
    let method = WarpedArea { field, samples: 8, ..WarpedArea::default() };
    let forward = method.forward(&scene, &change, &none).unwrap().gradient;
    let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
    let across: f64 = forward.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| g.dot(*a)).sum();
    let along: f64 = reverse.positions.iter().zip(&change.positions).map(|(g, v)| g.dot(*v)).sum();
    assert!((across - along).abs() < 1e-9 * across.abs(), "{across} {along}");
}

/// Edges on a border, near one, away from all, and under a continuous filter.
#[test]
fn edges_along_borders_are_told() {
    let of = |moved, filter| OnPixelBorders::of(&scene(moved, filter));
    let on = of(0.0, Filter::Box);
    assert!(matches!(on[..], [OnPixelBorders { shape: 0, edges: 4, distance: 0.0 }]), "{on:?}");
    let near = of(1e-6, Filter::Box);
    assert!(
        matches!(near[..], [OnPixelBorders { edges: 4, distance, .. }] if (distance / 1e-6 - 1.0).abs() < 1e-6),
        "{near:?}"
    );
    // Two of the four edges still lie on borders.
    assert!(matches!(of(0.3, Filter::Box)[..], [OnPixelBorders { edges: 2, .. }]));
    assert_eq!(of(0.0, Filter::Tent { radius: 1.0 }), []);
}
