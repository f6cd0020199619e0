//! A block over a printed floor with a grey card, under a lamp that no camera sees.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine2, DAffine3, DVec3};
use volume3d::geometry::Mesh;
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Integrator, Material, Reflectance, Scene, Texture,
    Wrap,
};

/// Texels along each side of the floor.
pub(super) const TEXELS: usize = 4;

/// The unknown parameters.
pub(super) const NAMES: [&str; 5] =
    ["block.translation", "block.rotation", "paint.reflectance", "lamp.radiance", "printed.texture"];

/// Cameras at the front and at the side, so that depth in one is width in the other.
pub(super) fn cameras() -> [Camera; 2] {
    [DVec3::new(0.4, 2.6, 3.0), DVec3::new(3.0, 2.4, -0.5)]
        .map(|eye| Camera::look_at(eye, DVec3::new(0.0, 0.2, 0.0), DVec3::Y, 0.75))
}

pub(super) fn film(side: usize) -> Film {
    Film { width: side, height: side, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } }
}

/// The true scene.
pub(super) fn truth(side: usize) -> anyhow::Result<Scene> {
    let [camera, _] = cameras();
    let mut description = Description::new(camera, film(side));
    // Light from lamp or sky to a surface and into the camera, so that unseen surfaces do not matter.
    description.integrator = Integrator { max_depth: Some(2), rr_depth: 2 };
    let (wrap, to_uv) = (Wrap::Clamp, DAffine2::IDENTITY);
    let texels = (0..TEXELS * TEXELS).map(texel).collect();
    let texture = description.add_texture(Texture {
        id: "print".to_owned(),
        width: TEXELS,
        height: TEXELS,
        texels,
        wrap,
        to_uv,
    });
    let bsdf = Bsdf::Diffuse { reflectance: Reflectance::Texture(texture) };
    let printed = description.add_material(Material::new("printed", bsdf, true));
    let paint = description.add_material(Material::diffuse("paint", DVec3::new(0.25, 0.45, 0.65)));
    let floor = DAffine3::from_rotation_x(-FRAC_PI_2) * DAffine3::from_scale(DVec3::splat(1.2));
    description.add_shape("floor", Mesh::rectangle().transformed(&floor), printed);
    // A known reflectance: a picture shows the product of light and reflectance, and the sky alone separates
    // them slowly.
    let grey = description.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    let card = DAffine3::from_translation(DVec3::new(-1.0, 0.02, 0.75))
        * DAffine3::from_rotation_x(-FRAC_PI_2)
        * DAffine3::from_scale(DVec3::splat(0.4));
    description.add_shape("card", Mesh::rectangle().transformed(&card), grey);
    let block = DAffine3::from_translation(0.65 * DVec3::Y)
        * DAffine3::from_rotation_y(0.6)
        * DAffine3::from_rotation_x(0.4)
        * DAffine3::from_scale(DVec3::new(0.4, 0.2, 0.28));
    description.add_shape("block", Mesh::cube().transformed(&block), paint);
    let lamp = DAffine3::from_translation(DVec3::new(0.8, 3.2, 0.5))
        * DAffine3::from_rotation_x(FRAC_PI_2)
        * DAffine3::from_scale(DVec3::splat(0.4));
    description.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::new(12.0, 10.0, 8.0));
    let radiance = DVec3::new(0.25, 0.3, 0.35);
    description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    Ok(Scene::new(description)?)
}

/// Patches of several colours, none of them black or white.
fn texel(i: usize) -> DVec3 {
    let wave = |k: f64| 0.5 + 0.28 * (2.1 * i as f64 + k).sin();
    DVec3::new(wave(0.0), wave(1.7), wave(3.1))
}

/// Initial parameters of every fit: a displaced and rotated block, grey paint, a dim grey lamp and a blank
/// floor.
pub(super) fn start(truth: &[f64]) -> Vec<f64> {
    let mut x = vec![0.5; truth.len()];
    x[..6].copy_from_slice(&[0.15, -0.1, 0.12, 0.2, -0.3, 0.15]);
    x[9..12].fill(7.0);
    x
}
