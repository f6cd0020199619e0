//! Tests of properties that hold for every sample.

use flatland::warp::{Debias, Warp};
use glam::DVec3;

use super::*;
use crate::Image;
use crate::scene::{Bsdf, Light, Reflectance};

#[test]
fn the_image_is_that_without_derivatives_bit_for_bit() {
    for filter in filters() {
        let scene = room(filter);
        let change = random_tangent(&scene, 1);
        let method = WarpedArea { samples: 3, seed: 7, ..WarpedArea::default() };
        let with = method.forward_terms(&scene, &change, &Progress::none()).unwrap();
        let without = method.forward(&scene, &Tangent::still(&scene), &Progress::none()).unwrap();
        assert_eq!(with.image, without.image);
        assert!(without.image.pixels.iter().any(|p| p.x > 0.0));
    }
}

/// The interior term is independent of warps and of moving discontinuities, the borders of emitters included.
#[test]
fn the_interior_term_is_what_is_left_without_warps() {
    let scene = room(Filter::Tent { radius: 1.0 });
    let change = random_tangent(&scene, 5);
    let method = WarpedArea { samples: 3, seed: 7, control_variate: 0, ..WarpedArea::default() };
    let terms = method.forward_terms(&scene, &change, &Progress::none()).unwrap();
    let interior = &terms.terms.as_ref().unwrap().interior;
    let alone = WarpedArea { warps: false, ..method }.forward(&scene, &change, &Progress::none()).unwrap();
    let scale = alone.gradient.pixels.iter().map(|g| g.abs().max_element()).fold(0.0, f64::max);
    assert!(scale > 0.0);
    for (with, without) in interior.pixels.iter().zip(&alone.gradient.pixels) {
        assert!((*with - *without).abs().max_element() <= 1e-12 * scale, "{with} {without}");
    }
}

#[test]
fn an_outlier_is_one_sample_of_many_with_much_of_the_result() {
    let scene = square(Filter::Box);
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::X);
    let method = WarpedArea { samples: 16, ..WarpedArea::default() };
    let mut image = method.forward(&scene, &change, &Progress::none()).unwrap();
    let largest = image.largest.unwrap();
    assert!(
        image.outlier().is_none() && image.largest_share() > 0.0 && largest.among == 64 * 16,
        "{largest:?}"
    );
    let whole: f64 = image.gradient.pixels.iter().map(|g| g.abs().element_sum()).sum();
    image.largest = Some(Contribution { amount: 0.3 * whole, ..largest });
    assert!(image.outlier().is_some() && (image.largest_share() - 0.3).abs() < 1e-12);
    image.largest = Some(Contribution { amount: 0.3 * whole, among: 600, ..largest });
    assert!(image.outlier().is_none(), "few samples have much each");
}

#[test]
fn forward_and_reverse_are_transposes() {
    for (k, filter) in filters().into_iter().enumerate() {
        let scene = room(filter);
        let change = random_tangent(&scene, k as u64);
        let adjoint = random_adjoint((6, 6));
        let rays = |debias| WarpedArea {
            field: Field::AuxiliaryRays,
            warp: Warp { debias, ..Warp::default() },
            ..WarpedArea::default()
        };
        for method in [WarpedArea::default(), rays(Debias::Consistent { rays: 4 }), rays(Debias::default())] {
            let method = WarpedArea { samples: 4, ..method };
            let image = method.forward(&scene, &change, &Progress::none()).unwrap();
            let terms = method.forward_terms(&scene, &change, &Progress::none()).unwrap();
            let active = ActiveParameters::everything(&scene);
            let gradient = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
            let pair = |g: &Image| g.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum::<f64>();
            let (forward, reverse) = (pair(&image.gradient), gradient.dot(&change));
            let split = pair(&terms.gradient);
            assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
            let rotation = Rotation { samples: 4, ..Rotation::default() };
            let rotated = rotation.forward(&scene, &change, &Progress::none()).unwrap();
            let pulled = rotation.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
            let (a, b) = (pair(&rotated.gradient), pulled.dot(&change));
            assert!((a - b).abs() < 1e-9 * a.abs().max(1.0), "rotation: {a} {b}");
            assert!((forward - split).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {split}");
        }
    }
}

/// Geometry that moves in front of an ideal mirror, and a moving light without extent, are errors of edge
/// sampling and of the rotation heuristic in forward and reverse mode.
#[test]
fn what_no_list_has_is_refused() {
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, DVec3::Y, 0.8);
    let mut d = Description::new(camera, film(4, Filter::Box));
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    d.add_shape("floor", Mesh::rectangle().transformed(&down()), grey);
    let mut lit = d.clone();
    lit.add_shape("lid", Mesh::rectangle().transformed(&(at(0.2, 0.5, 0.0, 0.3) * down())), grey);
    let (position, intensity) = (DVec3::new(0.3, 2.0, 0.1), DVec3::ONE);
    lit.lights.push(Light::Point { id: "bulb".to_owned(), position, intensity });
    let lit = Scene::new(lit).unwrap();
    d.materials[grey].bsdf = Bsdf::Conductor {
        eta: DVec3::ONE,
        k: DVec3::ONE,
        specular_reflectance: Reflectance::Constant(DVec3::ONE),
    };
    let mirror = Scene::new(d).unwrap();
    let refuses = |scene: &Scene, change: &Tangent, active: &ActiveParameters, unsupported: &Unsupported| {
        let (adjoint, none) = (Image::constant(4, 4, DVec3::ONE), Progress::none());
        let (rotation, edges) = (Rotation::default(), EdgeSampling::default());
        let found = [
            rotation.forward(scene, change, &none).err(),
            edges.forward(scene, change, &none).err(),
            rotation.reverse(scene, &adjoint, active, &none).err(),
            edges.reverse(scene, &adjoint, active, &none).err(),
        ];
        for error in found {
            assert_eq!(error, Some(GradientError::Unsupported(unsupported.clone())));
        }
    };
    let (mut moves, mut shape) = (Tangent::still(&mirror), ActiveParameters::nothing(&mirror));
    moves.translate(&mirror, 0, DVec3::Y);
    shape.shapes[0] = true;
    let reflects = Unsupported::Mirror { shape: "floor".to_owned(), material: "grey".to_owned() };
    refuses(&mirror, &moves, &shape, &reflects);
    let (mut poses, mut active) = (Tangent::still(&lit), ActiveParameters::nothing(&lit));
    poses.pose[0] = DVec3::X;
    active.poses[0] = true;
    refuses(&lit, &poses, &active, &Unsupported::Delta { light: "bulb".to_owned() });
    // A light's intensity moves no shadow.
    active.poses[0] = false;
    active.lights = true;
    let result =
        WarpedArea::default().reverse(&lit, &Image::constant(4, 4, DVec3::ONE), &active, &Progress::none());
    assert!(result.is_ok_and(|g| g.by_parameter.intensity[0].min_element() > 0.0));
}

#[test]
fn an_emitter_without_triangles_is_none() {
    let plain = square(Filter::Tent { radius: 1.0 });
    let mut d = plain.description().clone();
    d.add_emitter("nothing", Mesh::new(vec![DVec3::ZERO], vec![]).unwrap(), DVec3::ONE);
    let scene = Scene::new(d).unwrap();
    let image = |scene: &Scene| render(scene, 4, 0, &Progress::none()).unwrap().image.pixels;
    assert_eq!(image(&scene), image(&plain));
    let gradient = |scene: &Scene| {
        let mut change = Tangent::still(scene);
        change.translate(scene, 0, DVec3::X);
        WarpedArea::default().forward(scene, &change, &Progress::none()).unwrap().gradient
    };
    assert_eq!(gradient(&scene), gradient(&plain));
}
