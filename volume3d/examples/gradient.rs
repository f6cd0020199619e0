//! Renders a scene, and how every pixel changes as a block moves: its silhouette and its shadow move with it.
//!
//! ```sh
//! cargo run --release -p volume3d --example gradient -- FOLDER
//! ```
//!
//! FOLDER (`gradient` unless given) gets `image.png` and `gradient.png`, in which blue pixels get darker and
//! red ones brighter.

use std::error::Error;
use std::path::{Path, PathBuf};

use glam::DVec3;
use volume3d::gradient::{Estimator, Progress, Tangent};
use volume3d::io::{load_scene, signed_range, write_png, write_signed_png};
use volume3d::scene::Scene;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("gradient"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/table.xml");
    let scene = Scene::new(load_scene(&path)?)?;

    // The block moves to the right, by one unit of the scene for each unit of the parameter.
    let mut change = Tangent::still(&scene);
    change.translate(&scene, scene.find_shape("block")?, DVec3::X);
    let result = Estimator::auto(64, 0).forward(&scene, &change, &Progress::none())?;

    write_png(&folder.join("image.png"), &result.image)?;
    let gradient = &result.gradient;
    write_signed_png(&folder.join("gradient.png"), gradient, signed_range(gradient))?;
    let noise = result.standard_error.pixels.iter().map(|e| e.length_squared()).sum::<f64>();
    let signal = gradient.pixels.iter().map(|g| g.length_squared()).sum::<f64>();
    println!("wrote {}; noise is {:.1}% of the gradient", folder.display(), 100.0 * (noise / signal).sqrt());
    Ok(())
}
