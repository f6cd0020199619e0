//! Shapes a sphere until it looks like a rounded cube from eight sides: a fit of all vertices by gradients.
//!
//! ```sh
//! cargo run --release -p volume3d --example mesh -- FOLDER
//! ```
//!
//! Eight small pictures of a rounded cube are rendered. Every step looks at a few of them, and moves the
//! vertices of a sphere down the gradient of the difference, by large steps that keep the surface smooth.
//! FOLDER (`mesh` unless given) gets pictures of the target, the start and the fit, and the fitted mesh as
//! OBJ.

use std::collections::HashMap;
use std::error::Error;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Estimator, Progress, render};
use volume3d::io::{write_obj, write_png};
use volume3d::optimize::{Adam, LargeSteps, Loss, Parameters};
use volume3d::scene::{Camera, Description, Environment, Film, Filter, Integrator, Material, Scene};

const VIEWS: usize = 8;
/// Views of one step.
const TOGETHER: usize = 2;
const STEPS: usize = 120;
/// The λ of large steps: what happens at a vertex is spread over about √(1.5 λ) edges.
const SMOOTHNESS: f64 = 1.0;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("mesh"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;

    let mut scene = Scene::new(description(sphere(3)))?;
    let parameters = Parameters::new(&scene, &["body.vertex_positions"])?;
    let mut x = parameters.values(&scene);
    let truth: Vec<f64> = x.chunks_exact(3).flat_map(|p| rounded(DVec3::from_slice(p)).to_array()).collect();
    parameters.apply(&truth, &mut scene)?;
    let targets: Vec<Image> = (0..VIEWS).map(|view| pictured(&mut scene, view)).collect::<Result<_, _>>()?;
    write(&mut scene, &folder.join("target.png"))?;
    parameters.apply(&x, &mut scene)?;
    write(&mut scene, &folder.join("start.png"))?;
    println!("start: {:.4} from the truth", distance(&x));

    // A rare large sample is forgotten after some twenty steps, and not after a thousand.
    let large_steps =
        LargeSteps::new(&scene.description().shapes[scene.find_shape("body")?].mesh, SMOOTHNESS)?;
    let mut adam = Adam::new(0.0).uniform();
    adam.beta2 = 0.95;
    let method = Estimator::auto(4, 0).resolve(&scene, &parameters.active(&scene), &Progress::none())?;
    for step in 0..STEPS {
        // From 0.04 units a step down to nothing.
        let remaining = 1.0 - step as f64 / STEPS as f64;
        adam.rate = 0.04 * remaining;
        let (mut loss, mut gradient) = (0.0, vec![0.0; x.len()]);
        for k in 0..TOGETHER {
            let view = (step * TOGETHER + k) * 3 % VIEWS;
            scene.set_camera(camera(view))?;
            // The image and the gradient draw samples of their own, or their product would be biased.
            let seed = (step * TOGETHER + k) as u64;
            let image = render(&scene, 16, seed, &Progress::none())?.image;
            let (value, adjoint) = Loss::Multiscale { levels: 3 }.of(&image, &targets[view])?;
            let active = parameters.active(&scene);
            let pulled = method.with_seed(seed).reverse(&scene, &adjoint, &active, &Progress::none())?;
            let pulled = parameters.gradient(&scene, &x, &pulled.by_parameter);
            loss += value / TOGETHER as f64;
            gradient.iter_mut().zip(pulled).for_each(|(g, p)| *g += p / TOGETHER as f64);
        }
        let step_of_all = large_steps.solve(&adam.step(&large_steps.solve(&gradient)));
        parameters.retract(&mut x, &step_of_all);
        parameters.apply(&x, &mut scene)?;
        if step % 20 == 19 {
            println!("step {:3}: loss {loss:.1e}, {:.4} from the truth", step + 1, distance(&x));
        }
    }
    write(&mut scene, &folder.join("fit.png"))?;
    let body = scene.find_shape("body")?;
    write_obj(&folder.join("fit.obj"), &scene.description().shapes[body].mesh)?;
    println!("wrote {}", folder.display());
    Ok(())
}

/// A body in a grey sky, between lamps of three colours.
fn description(body: Mesh) -> Description {
    let film =
        Film { width: 64, height: 64, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } };
    let mut description = Description::new(camera(0), film);
    description.integrator = Integrator { max_depth: Some(2), rr_depth: 5 };
    let clay = description.add_material(Material::diffuse("clay", DVec3::new(0.7, 0.5, 0.35)));
    description.add_shape("body", body, clay);
    // Out of sight of all cameras.
    for (turn, colour) in
        [(0.0, [9.0, 6.0, 3.0]), (TAU / 3.0, [3.0, 9.0, 6.0]), (-TAU / 3.0, [6.0, 3.0, 9.0])]
    {
        for (place, side) in [("above", 1.0), ("below", -1.0)] {
            let id = format!("lamp_{place}_{:.0}", turn.to_degrees());
            let place = DAffine3::from_rotation_y(turn) * DAffine3::from_rotation_x(side * 1.35);
            let place = place * DAffine3::from_translation(-6.0 * DVec3::Z);
            description.add_emitter(&id, Mesh::rectangle().transformed(&place), DVec3::from(colour));
        }
    }
    description.environment =
        Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::splat(0.3) });
    description
}

/// One of the cameras around the body, every other one from below.
fn camera(view: usize) -> Camera {
    let angle = TAU * view as f64 / VIEWS as f64;
    let height = if view.is_multiple_of(2) { 2.0 } else { -2.0 };
    let from = DVec3::new(4.0 * angle.cos(), height, 4.0 * angle.sin());
    Camera::look_at(from, DVec3::ZERO, DVec3::Y, 0.7)
}

/// The unit sphere: an octahedron, each face split in four so many times.
fn sphere(levels: usize) -> Mesh {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut positions: Vec<DVec3> = axes.iter().flat_map(|a| [*a, -*a]).collect();
    let mut triangles = vec![];
    for (i, j, k) in [(0, 2, 4), (1, 4, 2), (0, 5, 2), (0, 4, 3), (1, 2, 5), (1, 3, 4), (0, 3, 5), (1, 5, 3)]
    {
        triangles.push([i, j, k]);
    }
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let split = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    Mesh::new(positions, triangles).expect("a sphere is a mesh")
}

/// The point of the rounded cube x⁴ + y⁴ + z⁴ = 1 in the direction of another.
fn rounded(p: DVec3) -> DVec3 {
    let fourth = (p * p * p * p).element_sum();
    p / fourth.powf(0.25)
}

/// How far vertices are from the rounded cube along the lines to its centre, root mean square.
fn distance(x: &[f64]) -> f64 {
    let off = x.chunks_exact(3).map(DVec3::from_slice).map(|p| p.distance_squared(rounded(p)));
    (off.sum::<f64>() / (x.len() / 3) as f64).sqrt()
}

/// What a camera sees.
fn pictured(scene: &mut Scene, view: usize) -> Result<Image, Box<dyn Error>> {
    scene.set_camera(camera(view))?;
    Ok(render(scene, 256, 1 << 20, &Progress::none())?.image)
}

/// Writes all views beside one another.
fn write(scene: &mut Scene, path: &Path) -> Result<(), Box<dyn Error>> {
    let views: Vec<Image> = (0..VIEWS).map(|view| pictured(scene, view)).collect::<Result<_, _>>()?;
    let (width, height) = scene.size();
    let rows =
        (0..height).flat_map(|y| views.iter().flat_map(move |v| &v.pixels[y * width..(y + 1) * width]));
    let image = Image { width: VIEWS * width, height, pixels: rows.copied().collect() };
    write_png(path, &image)?;
    Ok(())
}
