//! Builds a scene in code and renders it, with the standard error of every pixel.
//!
//! ```sh
//! cargo run --release -p volume3d --example render -- FOLDER
//! ```
//!
//! FOLDER (`render` unless given) gets the image as `image.png`, to look at, and as `image.exr`, linear and
//! not clamped, its standard error as `error.exr`, and the scene as `scene.xml`, which the command `volume3d`
//! reads.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Progress, render};
use volume3d::io::{write_exr, write_png, write_scene};
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Integrator, Material, Microfacets, Reflectance,
    Scene,
};

const SAMPLES: usize = 256;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("render"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    let scene = Scene::new(description())?;

    let start = Instant::now();
    let rendered = render(&scene, SAMPLES, 0, &Progress::none())?;
    let seconds = start.elapsed().as_secs_f64();
    let (image, error) = (&rendered.image, &rendered.standard_error);
    write_png(&folder.join("image.png"), image)?;
    write_exr(&folder.join("image.exr"), image)?;
    write_exr(&folder.join("error.exr"), error)?;
    write_scene(&folder.join("scene.xml"), &scene)?;

    let size = |image: &Image| {
        let squares = image.pixels.iter().map(|p| p.length_squared()).sum::<f64>();
        (squares / (3 * image.pixels.len()) as f64).sqrt()
    };
    println!(
        "{} × {} pixels of {SAMPLES} samples in {seconds:.1} s; the noise of a pixel is {:.2}% of the image, \
         root mean squares",
        image.width,
        image.height,
        100.0 * size(error) / size(image)
    );
    println!("wrote {}", folder.display());
    Ok(())
}

/// Three blocks of clay, brass and paper in the corner of a room, under a lamp.
fn description() -> Description {
    let camera = Camera::look_at(DVec3::new(3.0, 2.6, 4.8), DVec3::new(-0.2, 0.75, 0.0), DVec3::Y, 0.65);
    let film = Film {
        width: 160,
        height: 120,
        crop: None,
        sample_border: true,
        filter: Filter::Gaussian { deviation: 0.5 },
    };
    let mut description = Description::new(camera, film);
    description.integrator = Integrator { max_depth: Some(5), rr_depth: 5 };

    let plaster = description.add_material(Material::diffuse("plaster", DVec3::new(0.75, 0.72, 0.68)));
    let clay = description.add_material(Material::diffuse("clay", DVec3::new(0.65, 0.27, 0.16)));
    let paper = description.add_material(Material::diffuse("paper", DVec3::new(0.2, 0.35, 0.6)));
    let brass = description.add_material(Material::new(
        "brass",
        Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha: 0.25,
            stretch: 1.0,
            // η and k of brass at red, green and blue, rounded.
            eta: DVec3::new(0.44, 0.6, 1.1),
            k: DVec3::new(3.7, 2.8, 1.9),
            specular_reflectance: Reflectance::Constant(DVec3::ONE),
        },
        true,
    ));

    // Rectangles face +z, and are two units wide.
    let (size, half) = (DAffine3::from_scale(DVec3::splat(2.0)), FRAC_PI_2);
    let floor = DAffine3::from_rotation_x(-half) * size;
    let back = DAffine3::from_translation(DVec3::new(0.0, 2.0, -2.0)) * size;
    let left =
        DAffine3::from_translation(DVec3::new(-2.0, 2.0, 0.0)) * DAffine3::from_rotation_y(half) * size;
    for (id, place) in [("floor", floor), ("back", back), ("left", left)] {
        description.add_shape(id, Mesh::rectangle().transformed(&place), plaster);
    }
    let block = |size: [f64; 3], turn: f64, at: [f64; 3]| {
        let place = DAffine3::from_translation(DVec3::from(at)) * DAffine3::from_rotation_y(turn);
        Mesh::cube().transformed(&(place * DAffine3::from_scale(DVec3::from(size))))
    };
    description.add_shape("tower", block([0.35, 0.9, 0.35], 0.3, [-0.8, 0.9, -0.7]), clay);
    description.add_shape("bar", block([0.6, 0.3, 0.3], -0.5, [0.5, 0.3, -0.2]), brass);
    description.add_shape("sheet", block([0.25, 0.02, 0.35], 0.9, [-0.3, 0.02, 0.9]), paper);

    let lamp = DAffine3::from_translation(DVec3::new(0.8, 3.6, 0.6)) * DAffine3::from_rotation_x(half);
    let lamp = lamp * DAffine3::from_scale(DVec3::splat(0.5));
    description.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::new(14.0, 13.0, 11.0));
    let radiance = DVec3::new(0.12, 0.14, 0.18);
    description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    description
}
