//! Finds the texture of a table from one picture of it, as far as the picture shows it.
//!
//! ```sh
//! cargo run --release -p volume3d --example texture -- FOLDER
//! ```
//!
//! The table of `scenes/table.xml` gets a pattern, and is rendered. Then the pattern is forgotten: every
//! texel is grey, and descends the gradient of the difference between pictures. What the camera does not see
//! of the table, because a block hides it or the picture ends, has no derivative: nothing can be known of it,
//! and it stays grey. FOLDER (`texture` unless given) gets pictures and patterns of the truth, the start and
//! the fit as PNG.

use std::error::Error;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use glam::{DAffine2, DVec3};
use volume3d::Image;
use volume3d::gradient::{Estimator, Progress, render};
use volume3d::io::{load_scene, write_png};
use volume3d::optimize::{Adam, Loss, Parameters};
use volume3d::scene::{Bsdf, Material, Reflectance, Scene, Texture, Wrap};

/// Texels along each side of the table.
const SIDE: usize = 32;
const STEPS: u64 = 60;
/// A texel that changes the picture by less than this part of what the best seen one does counts as not seen.
const SEEN: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("texture"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/table.xml");
    let mut description = load_scene(&path)?;
    let (width, height) = (SIDE, SIDE);
    let texture = description.add_texture(Texture {
        id: "pattern".to_owned(),
        width,
        height,
        texels: pattern(),
        wrap: Wrap::Clamp,
        to_uv: DAffine2::IDENTITY,
    });
    let bsdf = Bsdf::Diffuse { reflectance: Reflectance::Texture(texture) };
    let printed = description.add_material(Material::new("printed", bsdf, true));
    let table =
        description.shapes.iter_mut().find(|shape| shape.id == "table").ok_or("the scene has no table")?;
    table.material = printed;
    // The light that the block sends to the table would tell a little of what no picture shows.
    description.integrator.max_depth = Some(2);
    let mut scene = Scene::new(description)?;

    // The truth, and what is seen of it: the derivative of the sum of all pixels.
    let parameters = Parameters::new(&scene, &["printed.texture"])?;
    let truth = parameters.values(&scene);
    let target = picture(&scene, &folder, "target")?;
    // Texels move nothing: the interior term is all of their derivative.
    let method = Estimator::interior(64, 0);
    let ones = Image::constant(target.width, target.height, DVec3::ONE);
    let all = method.reverse(&scene, &ones, &parameters.active(&scene), &Progress::none())?;
    let all = parameters.gradient(&scene, &truth, &all.by_parameter);
    let most = all.iter().copied().fold(0.0, f64::max);
    let seen: Vec<bool> = all.iter().map(|g| *g > SEEN * most).collect();

    let mut x = vec![0.5; truth.len()];
    parameters.apply(&x, &mut scene)?;
    picture(&scene, &folder, "start")?;
    report("start", &x, &truth, &seen);
    let mut adam = Adam::new(0.0);
    for step in 0..STEPS {
        // From 0.06 a step, in units of reflectance, down to nothing.
        adam.rate = 0.03 * (1.0 + (PI * step as f64 / STEPS as f64).cos());
        // The image and the gradient draw samples of their own, or their product would be biased.
        let image = render(&scene, 16, step, &Progress::none())?.image;
        let (loss, adjoint) = Loss::L2.of(&image, &target)?;
        let method = Estimator::interior(8, step);
        let gradient = method.reverse(&scene, &adjoint, &parameters.active(&scene), &Progress::none())?;
        let gradient = parameters.gradient(&scene, &x, &gradient.by_parameter);
        // Bounds keep every texel within [0, 1].
        parameters.retract(&mut x, &adam.step(&gradient));
        parameters.apply(&x, &mut scene)?;
        if step % 10 == 9 {
            report(&format!("step {}: loss {loss:.1e}", step + 1), &x, &truth, &seen);
        }
    }
    picture(&scene, &folder, "fit")?;
    println!("wrote {}", folder.display());
    Ok(())
}

/// Rings of two colours that become darker to one side.
fn pattern() -> Vec<DVec3> {
    let texel = |i: usize| {
        let (x, y) = ((i % SIDE) as f64 / SIDE as f64 - 0.5, (i / SIDE) as f64 / SIDE as f64 - 0.5);
        let ring = 0.5 + 0.5 * (40.0 * x.hypot(y)).sin();
        DVec3::new(0.85, 0.6, 0.25).lerp(DVec3::new(0.15, 0.3, 0.5), ring) * (0.7 + 0.6 * x)
    };
    (0..SIDE * SIDE).map(texel).collect()
}

/// How far texels are from the truth, root mean square, apart for those that are seen and those that are not.
fn report(what: &str, x: &[f64], truth: &[f64], seen: &[bool]) {
    let off = |wanted: bool| {
        let kept = || x.iter().zip(truth).zip(seen).filter(|(_, s)| **s == wanted).map(|((x, t), _)| x - t);
        (kept().map(|d| d * d).sum::<f64>() / kept().count().max(1) as f64).sqrt()
    };
    let part = seen.iter().filter(|s| **s).count() as f64 / seen.len() as f64;
    println!(
        "{what}; the {:.0}% of texels that are seen are {:.3} from the truth, the others {:.3}",
        100.0 * part,
        off(true),
        off(false)
    );
}

/// Renders a scene, writes the picture and its texture, and returns the picture.
fn picture(scene: &Scene, folder: &Path, name: &str) -> Result<Image, Box<dyn Error>> {
    let image = render(scene, 256, 1 << 20, &Progress::none())?.image;
    write_png(&folder.join(format!("{name}.png")), &image)?;
    let Texture { width, height, texels, .. } = &scene.description().textures[0];
    let texture = Image { width: *width, height: *height, pixels: texels.clone() };
    write_png(&folder.join(format!("{name}_texture.png")), &texture)?;
    Ok(image)
}
