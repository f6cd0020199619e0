//! Tests of parameters, losses and steps.

mod parameters;

use glam::{DAffine3, DMat3, DVec3};

use super::*;
use crate::Image;
use crate::geometry::{Attribute, Mesh, Normals};
use crate::scene::{
    Alias, Bsdf, Camera, Description, Environment, Film, Filter, Instances, Light, Material, Microfacets,
    Reflectance, Scene, Texture, Wrap,
};

/// A scene with one object of every kind.
pub(super) fn scene() -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO, DVec3::Y, 0.7);
    let film =
        Film { width: 8, height: 8, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } };
    let mut d = Description::new(camera, film);
    let texels = (0..6).map(|i| DVec3::splat(0.2 + 0.1 * f64::from(i))).collect();
    let (wrap, to_uv) = (Wrap::Clamp, glam::DAffine2::IDENTITY);
    let texture = d.add_texture(Texture { id: "paper".to_owned(), width: 3, height: 2, texels, wrap, to_uv });
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.7)));
    let reflectance = Reflectance::Texture(texture);
    let printed =
        Material { bsdf: Bsdf::Diffuse { reflectance }, ..Material::diffuse("printed", DVec3::ONE) };
    let printed = d.add_material(printed);
    let metal = d.add_material(Material {
        bsdf: Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha: 0.3,
            stretch: 1.0,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance: Reflectance::Constant(DVec3::ONE),
        },
        ..Material::diffuse("metal", DVec3::ONE)
    });
    let corners = Mesh::cube().triangles().to_vec();
    let values = Mesh::cube().positions().iter().map(|p| p.normalize()).collect();
    let round = Normals::Given(Attribute { values, triangles: corners });
    d.add_shape("block", Mesh::cube().with_normals(round).unwrap(), white);
    let aside = DAffine3::from_translation(DVec3::new(-2.0, 0.3, 0.0));
    d.add_shape("page", Mesh::rectangle().transformed(&aside), printed);
    d.add_shape("ball", Mesh::cube().smooth().transformed(&aside.inverse()), metal);
    let above = DAffine3::from_translation(4.0 * DVec3::Y) * DAffine3::from_rotation_x(1.57);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&above), DVec3::splat(4.0));
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::splat(0.2) });
    let intensity = DVec3::ONE;
    d.lights.push(Light::Point { id: "bulb".to_owned(), position: DVec3::splat(5.0), intensity });
    let texels = (0..4).map(|i| DVec3::splat(0.3 + 0.2 * f64::from(i))).collect();
    let slide = d.add_texture(Texture { id: "slide".to_owned(), width: 2, height: 2, texels, wrap, to_uv });
    d.lights.push(Light::Spot {
        id: "beam".to_owned(),
        position: DVec3::new(1.0, 5.0, 2.0),
        to_world: DMat3::from_rotation_x(1.3),
        intensity,
        cutoff: 0.5,
        beam: 0.3,
        texture: Some(slide),
    });
    let direction = DVec3::new(0.3, -0.8, 0.2).normalize();
    let (irradiance, kappa) = (DVec3::ONE, f64::INFINITY);
    d.lights.push(Light::Directional { id: "sun".to_owned(), direction, irradiance, kappa });
    d.instances.push(Instances { id: "pair".to_owned(), shapes: vec![0, 2], implicits: vec![] });
    d.aliases.push(Alias { id: "chalk".to_owned(), material: white });
    Scene::new(d).unwrap()
}

/// Pseudorandom numbers of magnitude `size`.
fn numbers(count: usize, seed: u64, size: f64) -> Vec<f64> {
    let mut rng = flatland::random::stream(seed, &[]);
    (0..count).map(|_| size * (flatland::random::open01(&mut rng) - 0.5)).collect()
}

#[test]
fn adjoints_are_the_derivative_of_losses() {
    let image = |seed| {
        let pixels = numbers(45, seed, 1.0).chunks_exact(3).map(|c| DVec3::from_slice(c) + 0.6).collect();
        Image { width: 5, height: 3, pixels }
    };
    let (image, target) = (image(5), image(6));
    let losses = [
        Loss::L2,
        Loss::L1,
        Loss::Relative { epsilon: 0.1 },
        Loss::Multiscale { levels: 9 },
        Loss::Multiscale { levels: 1 },
    ];
    for loss in losses {
        let (value, adjoint) = loss.of(&image, &target).unwrap();
        assert!(value > 0.0);
        assert_eq!(loss.of(&target, &target).unwrap(), (0.0, Image::constant(5, 3, DVec3::ZERO)), "{loss:?}");
        for i in 0..15 {
            let at = |h: f64| {
                let mut moved = image.clone();
                moved.pixels[i].y += h;
                loss.of(&moved, &target).unwrap().0
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!(
                (difference - adjoint.pixels[i].y).abs() < 1e-9,
                "{loss:?} {i} {difference} {}",
                adjoint.pixels[i].y
            );
        }
    }
    let (l2, one) = (Loss::L2.of(&image, &target), Loss::Multiscale { levels: 1 }.of(&image, &target));
    assert!((l2.unwrap().0 - one.unwrap().0).abs() < 1e-15);
    let larger = Image::constant(5, 4, DVec3::ONE);
    assert!(matches!(Loss::L2.of(&larger, &target), Err(LossError::Size { .. })));
    let mut noisy = image.clone();
    noisy.pixels[0].x = f64::INFINITY;
    assert_eq!(Loss::L2.of(&noisy, &target), Err(LossError::NotFinite { what: "image", x: 0, y: 0 }));
    let nothing = Loss::Relative { epsilon: 0.0 }.of(&image, &target);
    assert_eq!(nothing, Err(LossError::Epsilon { epsilon: 0.0 }));
    let mut holed = target;
    holed.pixels[7].z = f64::NAN;
    assert_eq!(Loss::L2.of(&image, &holed), Err(LossError::NotFinite { what: "target", x: 2, y: 1 }));
}

#[test]
fn adam_takes_the_steps_of_its_definition() {
    let mut adam = Adam::new(0.1);
    // The first step is the rate, whatever the gradient: m̂ = g and v̂ = g².
    let first = adam.step(&[3.0, -1e-3]);
    assert!((first[0] + 0.1).abs() < 1e-9 && (first[1] - 0.1).abs() < 1e-5, "{first:?}");
    let second = adam.step(&[1.0, 0.0]);
    let (m, v) =
        ((0.9 * 0.1 * 3.0 + 0.1) / (1.0 - 0.81), (0.999 * 0.001 * 9.0 + 0.001) / (1.0 - 0.999_f64.powi(2)));
    assert!((second[0] + 0.1 * m / v.sqrt()).abs() < 1e-9);
    // With one v, small gradients make small steps.
    let step = Adam::new(0.1).uniform().step(&[3.0, -1e-3]);
    assert!((step[1] / step[0] + 1e-3 / 3.0).abs() < 1e-12);
    // A quadratic valley with two curvatures.
    let (mut x, mut adam) = ([4.0, -3.0], Adam::new(0.1));
    for t in 0..2000 {
        adam.rate = 0.1 * (1.0 - f64::from(t) / 2000.0);
        let step = adam.step(&[100.0 * x[0], 0.1 * (x[1] - 1.0)]);
        x.iter_mut().zip(step).for_each(|(x, s)| *x += s);
    }
    assert!(x[0].abs() < 1e-3 && (x[1] - 1.0).abs() < 1e-3, "{x:?}");
}
