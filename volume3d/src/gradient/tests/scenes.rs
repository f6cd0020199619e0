//! Simple test scenes.

use flatland::random::{open01, stream};
use glam::{DAffine3, DQuat, DVec3};

use crate::Image;
use crate::geometry::Mesh;
use crate::gradient::{CameraTangent, Tangent};
use crate::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Integrator, Material, Microfacets, Reflectance,
    Scene,
};

pub(crate) fn film(width: usize, filter: Filter) -> Film {
    Film { width, height: width, crop: None, sample_border: true, filter }
}

pub(crate) fn filters() -> [Filter; 3] {
    [Filter::Box, Filter::Tent { radius: 1.0 }, Filter::Gaussian { deviation: 0.5 }]
}

pub(crate) fn at(x: f64, y: f64, z: f64, scale: f64) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, DVec3::new(x, y, z))
}

/// A square of radiance 2 in front of a camera that looks along −z, on radiance 0.5.
pub(crate) fn square(filter: Filter) -> Scene {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 1.0);
    let mut d = Description::new(camera, film(6, filter));
    d.add_emitter("square", Mesh::rectangle().transformed(&at(0.05, -0.02, -3.0, 0.7)), DVec3::splat(2.0));
    let radiance = DVec3::splat(0.5);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    Scene::new(d).unwrap()
}

/// A room with a lamp and a block; some walls are glossy, and some meshes have smooth normals.
pub(crate) fn room(filter: Filter) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.1, 0.2, 2.5), DVec3::ZERO, DVec3::Y, 0.9);
    let mut d = Description::new(camera, film(6, filter));
    d.integrator = Integrator { max_depth: Some(4), rr_depth: 3 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.7, 0.6, 0.5)));
    let glossy = d.add_material(Material::new(
        "glossy",
        Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha: 0.3,
            stretch: 1.0,
            eta: DVec3::new(0.2, 0.9, 1.1),
            k: DVec3::new(3.9, 2.4, 2.2),
            specular_reflectance: Reflectance::Constant(DVec3::splat(0.9)),
        },
        true,
    ));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, -1.0, 0.0, 1.5) * down())), white);
    d.add_shape("back", Mesh::rectangle().transformed(&at(0.0, 0.0, -1.0, 1.5)), glossy);
    d.add_shape("block", Mesh::cube().smooth().transformed(&at(0.1, -0.5, 0.0, 0.3)), white);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&(at(0.0, 1.0, 0.0, 0.4) * up())), DVec3::splat(5.0));
    let radiance = DVec3::new(0.2, 0.3, 0.4);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    Scene::new(d).unwrap()
}

pub(crate) fn up() -> DAffine3 {
    DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2)
}

pub(crate) fn down() -> DAffine3 {
    DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2)
}

/// A random adjoint image of the given size.
pub(crate) fn random_adjoint((width, height): (usize, usize)) -> Image {
    let mut rng = stream(5, &[]);
    let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
    Image { width, height, pixels: (0..width * height).map(|_| random()).collect() }
}

pub(crate) fn random_tangent(scene: &Scene, seed: u64) -> Tangent {
    let mut rng = stream(seed, &[]);
    let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
    let mut change = Tangent::still(scene);
    change.positions.iter_mut().for_each(|p| *p = random());
    change.reflectance.iter_mut().for_each(|p| *p = random());
    change.roughness.iter_mut().for_each(|p| *p = random().x);
    change.radiance.iter_mut().for_each(|p| *p = random());
    change.environment = random();
    change.camera = CameraTangent { translation: random(), rotation: random(), field_of_view: random().x };
    change
}

/// Derivative of the sum of all pixels of [`square`] by a uniform scale. The sum is radiance times area, and
/// the area changes at twice the rate of the scale.
pub(crate) fn rate_of_square() -> f64 {
    let focal = 3.0 / 0.5_f64.tan();
    let area = (1.4 * focal / 3.0_f64).powi(2);
    // Sum of three equal channels.
    3.0 * 2.0 * area * 1.5
}
