//! Finds where a block is from a picture of it: a fit of six numbers by gradients.
//!
//! ```sh
//! cargo run --release -p volume3d --example pose -- FOLDER
//! ```
//!
//! The picture is rendered from `scenes/table.xml`. Then the block is moved and turned away, and descends the
//! gradient of the difference between pictures. FOLDER (`pose` unless given) gets target, start and fit as
//! PNG, and the fitted scene.

use std::error::Error;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use glam::DVec3;
use volume3d::Image;
use volume3d::gradient::{Estimator, Progress, render};
use volume3d::io::{load_scene, write_png, write_scene};
use volume3d::optimize::{Adam, Loss, Parameters};
use volume3d::scene::Scene;

const STEPS: u64 = 80;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("pose"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/table.xml");
    let mut scene = Scene::new(load_scene(&path)?)?;

    // What is to be found, and the picture to find it from.
    let parameters = Parameters::new(&scene, &["block.translation", "block.rotation"])?;
    let truth = parameters.values(&scene);
    let target = picture(&scene, 256, 0, &folder.join("target.png"))?;

    // A quarter of a unit and half a radian away.
    let mut x = truth.clone();
    parameters.retract(&mut x, &[0.2, 0.1, -0.1, 0.2, -0.4, 0.2]);
    parameters.apply(&x, &mut scene)?;
    picture(&scene, 256, 0, &folder.join("start.png"))?;

    let mut adam = Adam::new(0.0);
    let method = Estimator::auto(8, 0).resolve(&scene, &parameters.active(&scene), &Progress::none())?;
    for step in 0..STEPS {
        // From 0.04 units and radians a step down to nothing.
        adam.rate = 0.02 * (1.0 + (PI * step as f64 / STEPS as f64).cos());
        // The image and the gradient draw samples of their own, or their product would be biased.
        let image = render(&scene, 16, step, &Progress::none())?.image;
        let (loss, adjoint) = Loss::Multiscale { levels: 5 }.of(&image, &target)?;
        let active = parameters.active(&scene);
        let gradient = method.with_seed(step).reverse(&scene, &adjoint, &active, &Progress::none())?;
        let gradient = parameters.gradient(&scene, &x, &gradient.by_parameter);
        parameters.retract(&mut x, &adam.step(&gradient));
        parameters.apply(&x, &mut scene)?;
        if step % 10 == 9 {
            let (shift, turn) = (DVec3::from_slice(&x), DVec3::from_slice(&x[3..]));
            let (shift, turn) = (shift.length(), turn.length().to_degrees());
            println!("step {:2}: loss {loss:.2e}, {shift:.4} units and {turn:.2}° from the truth", step + 1);
        }
    }
    picture(&scene, 256, 0, &folder.join("fit.png"))?;
    write_scene(&folder.join("fit.xml"), &scene)?;
    println!("wrote {}", folder.display());
    Ok(())
}

/// Renders a scene and writes the picture.
fn picture(scene: &Scene, samples: usize, seed: u64, path: &Path) -> Result<Image, Box<dyn Error>> {
    let image = render(scene, samples, seed, &Progress::none())?.image;
    write_png(path, &image)?;
    Ok(image)
}
