//! Tests of discontinuities that a method does not handle and leaves out with permission.

use super::*;
use crate::scene::{Bsdf, Light, Reflectance};

/// A square emitter above a floor.
fn above_a_floor(bsdf: Bsdf) -> Scene {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::new(0.0, -0.3, -3.0), DVec3::Y, 0.9);
    let mut d = Description::new(camera, film(8, Filter::Box));
    d.integrator.max_depth = Some(2);
    let floor = d.add_material(Material::new("floor", bsdf, true));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, -0.6, -3.0, 3.0) * down())), floor);
    d.add_emitter("square", Mesh::rectangle().transformed(&at(0.1, 0.1, -3.0, 0.4)), DVec3::ONE);
    Scene::new(d).unwrap()
}

fn mirror() -> Bsdf {
    let (eta, k) = (DVec3::ONE, DVec3::splat(3.0));
    Bsdf::Conductor { eta, k, specular_reflectance: Reflectance::Constant(DVec3::ONE) }
}

fn edges(samples: usize, seed: u64, missing: &[Missing]) -> EdgeSampling {
    let [primary, secondary] = [samples; 2];
    EdgeSampling { samples, primary, secondary, bounces: secondary, seed, allow_missing: missing.to_vec() }
}

/// The part seen directly is differentiated, bitwise as if there were no mirror; the part seen in the mirror
/// has derivative zero.
#[test]
fn a_mirror_shows_what_stands_still() {
    let (mirror, black) = (
        above_a_floor(mirror()),
        above_a_floor(Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::ZERO) }),
    );
    let mut change = Tangent::still(&mirror);
    change.translate(&mirror, 1, DVec3::new(1.0, 0.3, 0.0));
    let allowed = edges(16, 0, &[Missing::Mirror, Missing::PointLight]);
    let found = allowed.forward(&mirror, &change, &Progress::none()).unwrap();
    let direct = edges(16, 0, &[]).forward(&black, &change, &Progress::none()).unwrap();
    assert_eq!(found.gradient, direct.gradient);
    assert_eq!(direct.left_out, []);
    let (shape, material) = ("floor".to_owned(), "floor".to_owned());
    assert_eq!(found.left_out, [Unsupported::Mirror { shape, material }]);
    // Finite differences show that the part left out is nonzero: the image in the mirror moves.
    let differences = FiniteDifference { samples: 256, step: 1e-2, seed: 0 };
    let whole = differences.forward(&mirror, &change, &Progress::none()).unwrap().gradient;
    let below = |image: &Image| image.pixels[40..].iter().map(|p| p.x.abs()).sum::<f64>();
    assert!(below(&found.gradient) == 0.0 && below(&whole) > 0.1, "{}", below(&whole));

    let refused =
        |allowed: &[Missing]| edges(1, 0, allowed).forward(&mirror, &change, &Progress::none()).err();
    let mirror_is_refused = |e| matches!(e, Some(GradientError::Unsupported(Unsupported::Mirror { .. })));
    assert!(mirror_is_refused(refused(&[])) && mirror_is_refused(refused(&[Missing::Transmission])));
}

/// With a point light at the camera all shadows are hidden behind their occluders, so that nothing visible is
/// left out. Control: a light away from the camera, where visible shadows are.
#[test]
fn a_point_light_at_the_camera_casts_no_shadow_that_is_seen() {
    let lit_from = |position: DVec3| {
        let mut d = room(Filter::Tent { radius: 1.0 }).description().clone();
        (d.environment, d.integrator.max_depth) = (None, Some(2));
        d.shapes.retain(|shape| shape.radiance.is_none());
        let (id, intensity) = ("bulb".to_owned(), DVec3::splat(6.0));
        d.lights.push(Light::Point { id, position, intensity });
        Scene::new(d).unwrap()
    };
    let eye = room(Filter::Box).description().camera.origin;
    let [hidden, seen] = [eye, eye + DVec3::new(1.2, 0.8, 0.0)].map(lit_from);
    let mut change = Tangent::still(&hidden);
    change.translate(&hidden, 2, DVec3::new(1.0, 0.4, 0.5));
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * ((i % 6) as f64 - 2.5)).collect()
    };
    let allowed = [Missing::PointLight];
    let run = |scene: &Scene| {
        total(|seed| {
            weighted(edges(64, seed, &allowed).forward(scene, &change, &Progress::none()).unwrap().gradient)
        })
    };
    let differences = |scene: &Scene| {
        total(|seed| {
            let method = FiniteDifference { samples: 1024, step: 2e-3, seed };
            weighted(method.forward(scene, &change, &Progress::none()).unwrap().gradient)
        })
    };
    let mut comparisons = Comparisons::of("a_point_light_at_the_camera_casts_no_shadow_that_is_seen");
    let whole = differences(&hidden);
    comparisons.add("edge sampling".into(), run(&hidden), whole, 0.0, whole.0);
    comparisons.reject("a light aside", run(&seen), differences(&seen));
    comparisons.finish();
}

/// Forward and reverse leave out the same terms.
#[test]
fn what_is_left_out_is_left_out_of_the_transpose() {
    let scene = above_a_floor(mirror());
    let change = random_tangent(&scene, 3);
    let method = edges(8, 5, &[Missing::Mirror]);
    let forward = method.forward(&scene, &change, &Progress::none()).unwrap();
    let adjoint = random_adjoint(scene.size());
    let active = ActiveParameters::everything(&scene);
    let reverse = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap();
    assert_eq!(forward.left_out, reverse.left_out);
    let pixels = forward.gradient.pixels.iter().zip(&adjoint.pixels);
    let (product, transposed) =
        (pixels.map(|(g, a)| g.dot(*a)).sum::<f64>(), reverse.by_parameter.dot(&change));
    assert!((product - transposed).abs() < 1e-10 * product.abs(), "{product} {transposed}");
}
