//! Tests of materials made of two: mixtures, and separate front and back sides.

use std::f64::consts::PI;

use glam::{DAffine2, DVec3};

use super::*;
use crate::scene::{Blend, Bsdf, Dielectric, Microfacets, Reflectance, Roughness, Texture, Value, Wrap};

fn colour(c: DVec3) -> Bsdf {
    Bsdf::Diffuse { reflectance: Reflectance::Constant(c) }
}

fn metal(alpha: Option<f64>) -> Bsdf {
    let (eta, k) = (DVec3::new(0.2, 0.9, 1.1), DVec3::new(3.9, 2.4, 2.2));
    let specular_reflectance = Reflectance::Constant(DVec3::splat(0.9));
    match alpha {
        None => Bsdf::Conductor { eta, k, specular_reflectance },
        Some(alpha) => Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha,
            stretch: 1.0,
            eta,
            k,
            specular_reflectance,
        },
    }
}

fn glass(eta: f64, alpha: Option<f64>) -> Bsdf {
    let facets = alpha.map(|alpha| Roughness::new(Microfacets::Ggx, alpha));
    let specular_transmittance = Reflectance::Constant(DVec3::new(0.9, 0.8, 0.7));
    Bsdf::Dielectric(Dielectric { eta, facets, specular_reflectance: DVec3::ONE, specular_transmittance })
}

/// A sheet that fills the film below a lamp and a sky, with a mixture of two materials.
fn sheet([first, second]: [Bsdf; 2], weight: Value) -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, 0.3);
    let mut d = Description::new(camera, film(4, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let texels = [0.9, 0.5, 0.5, 0.1].map(DVec3::splat).to_vec();
    let (id, wrap, to_uv) = ("weights".to_owned(), Wrap::Clamp, DAffine2::IDENTITY);
    d.add_texture(Texture { id, width: 2, height: 2, texels, wrap, to_uv });
    let other = d.add_material(Material::new("second", second, false));
    let blend = Some(Blend { other, weight });
    let mixed = d.add_material(Material { blend, ..Material::new("mixed", first, true) });
    d.add_shape("sheet", Mesh::rectangle(), mixed);
    let lamp = Mesh::rectangle().transformed(&(at(0.6, 0.4, 2.0, 0.3) * DAffine3::from_rotation_y(PI)));
    d.add_emitter("lamp", lamp, DVec3::splat(3.0));
    let radiance = DVec3::new(0.2, 0.3, 0.4);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    d
}

/// Light reflected once is the mean of the two materials by the mixture weight, also for mirrors.
#[test]
fn a_mixture_is_the_mean_of_its_materials() {
    let mut comparisons = Comparisons::of("a_mixture_is_the_mean_of_its_materials");
    let image = |d: Description| {
        let scene = Scene::new(d).unwrap();
        total(|seed| render(&scene, 128, seed, &Progress::none()).unwrap().image.pixels)
    };
    let black = || colour(DVec3::ZERO);
    let red = || colour(DVec3::new(0.8, 0.2, 0.1));
    let dark = || colour(DVec3::new(0.2, 0.05, 0.02));
    let cases = [
        ("paper and metal", red(), metal(Some(0.3))),
        ("a mirror and paper", metal(None), red()),
        ("paper and black", red(), black()),
        ("glass and dark paper", glass(1.5, None), dark()),
        ("paper and frosted glass", red(), glass(1.3, Some(0.4))),
        ("two glasses", glass(1.5, None), glass(1.2, Some(0.2))),
        ("glass and a mirror", glass(1.5, None), metal(None)),
    ];
    for (name, first, second) in cases {
        let at = |weight: f64| image(sheet([first.clone(), second.clone()], Value::Constant(weight)));
        let ([a, b], mixed) = ([0.0, 1.0].map(at), at(0.3));
        let expected = (0.7 * a.0 + 0.3 * b.0, (0.7 * a.1).hypot(0.3 * b.1));
        comparisons.add(name.to_owned(), mixed, expected, 0.0, expected.0);
        comparisons.reject("weights exchanged", (0.3 * a.0 + 0.7 * b.0, 0.0), expected);
    }
    comparisons.finish();
}

/// A sheet turns in its own plane with a texture for its mixture weight or its roughness. Control: the same
/// sheet without texture.
#[test]
fn weights_and_roughnesses_move_with_their_surface() {
    let mut comparisons = Comparisons::of("weights_and_roughnesses_move_with_their_surface");
    let none = Progress::none();
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 4) as f64)).collect()
    };
    let parts = || [colour(DVec3::new(0.3, 0.1, 0.05)), metal(Some(0.4))];
    let turning = |scene: &Scene| {
        let mut change = Tangent::still(scene);
        change.rotate(scene, 0, DVec3::ZERO, DVec3::Z);
        change
    };
    let warped = |scene: &Scene| {
        let change = turning(scene);
        total(|seed| {
            let method = WarpedArea { samples: 64, seed, ..WarpedArea::default() };
            weighted(method.forward(scene, &change, &none).unwrap().gradient)
        })
    };
    let rough = |textured: bool| {
        let mut d = sheet([metal(Some(0.5)), metal(Some(0.5))], Value::Constant(0.0));
        (d.materials[1].blend, d.materials[1].roughness_textures) = (None, [textured.then_some(0); 2]);
        d
    };
    let cases = [
        ("a weight", sheet(parts(), Value::Texture(0)), sheet(parts(), Value::Constant(0.5))),
        ("a roughness", rough(true), rough(false)),
    ];
    for (name, textured, still) in cases {
        let scene = Scene::new(textured).unwrap();
        let differences = total(|seed| {
            let method = FiniteDifference { samples: 1024, step: 6e-2, seed };
            weighted(method.forward(&scene, &turning(&scene), &none).unwrap().gradient)
        });
        comparisons.add(name.to_owned(), warped(&scene), differences, 0.0, differences.0);
        comparisons.reject("what stays behind", warped(&Scene::new(still).unwrap()), differences);

        let (mut change, mut active) = (turning(&scene), ActiveParameters::nothing(&scene));
        (active.shapes[0], active.materials) = (true, vec![true; active.materials.len()]);
        change.texels[0].iter_mut().for_each(|t| *t = DVec3::new(0.3, -0.1, 0.2));
        (change.reflectance[0], change.reflectance[1]) =
            (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.3, -0.2, 0.1));
        (change.roughness[0], change.roughness[1]) = (0.7, 0.3);
        let (adjoint, method) = (random_adjoint(scene.size()), WarpedArea::default());
        let image = method.forward(&scene, &change, &none).unwrap().gradient;
        let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
        let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
        assert!((forward - reverse).abs() < 1e-9 * forward.abs(), "{name}: {forward} {reverse}");
    }
    comparisons.finish();
}

/// A mirror in a mixture or on a back side is refused like any other mirror.
#[test]
fn mirrors_in_mixtures_are_refused_too() {
    let scene = Scene::new(sheet([colour(DVec3::ONE), metal(None)], Value::Constant(0.5))).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::X);
    let found = EdgeSampling::default().forward(&scene, &change, &Progress::none()).err();
    let (shape, material) = ("sheet".to_owned(), "second".to_owned());
    assert_eq!(found, Some(GradientError::Unsupported(Unsupported::Mirror { shape, material })));
}

/// Each side looks like a sheet of its own material.
#[test]
fn backs_have_their_own_material() {
    let look = |d: &Description, z: f64| {
        let mut d = d.clone();
        d.camera = Camera::look_at(DVec3::new(0.0, 0.5, z), DVec3::ZERO, DVec3::Y, 0.3);
        render(&Scene::new(d).unwrap(), 16, 1, &Progress::none()).unwrap().image.pixels
    };
    let (first, second) = (colour(DVec3::new(0.8, 0.2, 0.1)), metal(Some(0.3)));
    let alone = |bsdf: &Bsdf| {
        let mut d = sheet([bsdf.clone(), bsdf.clone()], Value::Constant(0.0));
        d.materials[1].blend = None;
        d
    };
    let mut both = alone(&first);
    both.materials[0] = Material::new("second", second.clone(), false);
    both.materials[1].back = Some(0);
    assert_eq!(look(&both, 3.0), look(&alone(&first), 3.0));
    assert_eq!(look(&both, -3.0), look(&alone(&second), -3.0));
    assert_ne!(look(&both, -3.0), look(&alone(&first), -3.0));
    both.materials[1].back = Some(1);
    assert!(Scene::new(both).is_err(), "a material that is its own back");
}
