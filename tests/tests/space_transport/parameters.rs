//! Forward compared with reverse mode for every parameter, and derivatives by parameters other than geometry
//! compared with differences.

use flatland::random::{open01, stream};
use glam::{DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, directed, pulled, warped, weights};
use tests::space::scenes::{film, plate};
use tests::statistics::student;
use volume3d::Image;
use volume3d::gradient::{ActiveParameters, CameraTangent, Progress, Tangent, WarpedArea, render};
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Filter, Light, Material, Microfacets, Reflectance, Scene,
    Texture, Wrap,
};

use super::{TENT, conductor, court, known, sphere};

/// All features of a scene: textures, two microfacet distributions, smooth normals, all lights that may be
/// warped.
fn everything() -> Description {
    let mut d = court(6, conductor("metal", 0.25), Some(sphere(DVec3::new(0.05, 0.7, -0.2), 0.3)));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.4, -0.2), DVec3::Y, 0.9);
    d.film = film(6, TENT);
    let mut rng = stream(1, &[]);
    let mut colours = |n: usize| -> Vec<DVec3> {
        (0..n).map(|_| DVec3::from_array(std::array::from_fn(|_| open01(&mut rng)))).collect()
    };
    let texture = |id: &str, texels: Vec<DVec3>, width: usize| Texture {
        id: id.to_owned(),
        width,
        height: texels.len() / width,
        texels,
        wrap: Wrap::Repeat,
        to_uv: glam::DAffine2::from_scale(DVec2::splat(2.0)),
    };
    let paint = d.add_texture(texture("paint", colours(12), 4));
    let map = d.add_texture(texture("map", colours(8), 4));
    let mut painted = Material::diffuse("painted", DVec3::ZERO);
    painted.bsdf = Bsdf::Diffuse { reflectance: Reflectance::Texture(paint) };
    let painted = d.add_material(painted);
    let mut beckmann = conductor("beckmann", 0.3);
    if let Bsdf::RoughConductor { distribution, .. } = &mut beckmann.bsdf {
        *distribution = Microfacets::Beckmann;
    }
    let beckmann = d.add_material(beckmann);
    d.add_shape("wall", plate(DVec3::new(0.0, 0.5, -1.5), DVec3::Z, 1.0), painted);
    d.add_shape("side", plate(DVec3::new(-1.2, 0.5, -0.5), DVec3::X, 0.8), beckmann);
    d.lights.push(Light::Directional {
        id: "sun".to_owned(),
        direction: DVec3::new(0.4, -0.8, -0.3).normalize(),
        irradiance: DVec3::new(3.0, 2.0, 1.0),
        kappa: 20.0,
    });
    let to_world = DMat3::from_rotation_y(0.7);
    d.environment = Some(Environment::Map { id: "map".to_owned(), texture: map, scale: 0.8, to_world });
    d
}

fn random_tangent(scene: &Scene, seed: u64) -> Tangent {
    let mut rng = stream(seed, &[]);
    let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
    let mut change = Tangent::still(scene);
    change.positions.iter_mut().for_each(|p| *p = random());
    change.reflectance.iter_mut().for_each(|p| *p = random());
    change.roughness.iter_mut().for_each(|p| *p = random().x);
    change.texels.iter_mut().flatten().for_each(|p| *p = random());
    change.radiance.iter_mut().for_each(|p| *p = random());
    change.intensity.iter_mut().for_each(|p| *p = random());
    change.pose.iter_mut().for_each(|p| *p = random());
    change.environment_rotation = random();
    change.camera = CameraTangent { translation: random(), rotation: random(), field_of_view: random().x };
    change
}

/// ⟨δ, J v⟩ = ⟨Jᵀ δ, v⟩ for all parameters at once and for each family by itself.
#[test]
fn reverse_mode_is_the_transpose_for_every_parameter() {
    transposes(&[Filter::Tent { radius: 1.0 }, Filter::Gaussian { deviation: 0.5 }]);
}

#[test]
fn reverse_mode_is_the_transpose_for_box_pixels() {
    transposes(&[Filter::Box]);
}

fn transposes(filters: &[Filter]) {
    let mut worst = 0.0_f64;
    for (seed, &filter) in filters.iter().enumerate() {
        let mut d = everything();
        d.film.filter = filter;
        let scene = Scene::new(d).expect("a scene");
        let all = random_tangent(&scene, seed as u64);
        let still = Tangent::still(&scene);
        let families = [
            ("all", all.clone()),
            ("positions", Tangent { positions: all.positions.clone(), ..still.clone() }),
            ("camera", Tangent { camera: all.camera, ..still.clone() }),
            ("reflectance", Tangent { reflectance: all.reflectance.clone(), ..still.clone() }),
            ("roughness", Tangent { roughness: all.roughness.clone(), ..still.clone() }),
            ("texels", Tangent { texels: all.texels.clone(), ..still.clone() }),
            ("radiance", Tangent { radiance: all.radiance.clone(), ..still.clone() }),
            ("intensity", Tangent { intensity: all.intensity.clone(), ..still.clone() }),
            ("pose", Tangent { pose: all.pose.clone(), ..still.clone() }),
            ("environment's rotation", Tangent { environment_rotation: all.environment_rotation, ..still }),
        ];
        let adjoint = Image { width: 6, height: 6, pixels: weights(36) };
        let method = WarpedArea { seed: 2, ..warped(4) };
        let active = ActiveParameters::everything(&scene);
        let gradient = pulled(method.reverse(&scene, &adjoint, &active, &Progress::none()).expect("valid"));
        for (name, change) in families {
            let image = method.forward(&scene, &change, &Progress::none()).expect("valid");
            assert!(image.non_finite.is_empty());
            let terms = adjoint.pixels.iter().zip(&image.gradient.pixels).map(|(w, g)| *w * *g);
            let scale: f64 = terms.clone().map(|t| t.abs().element_sum()).sum();
            let (forward, reverse) = (terms.map(DVec3::element_sum).sum::<f64>(), gradient.dot(&change));
            let error = (forward - reverse).abs() / scale.max(1e-3);
            println!("{name}, {filter:?}: {forward:.6} {reverse:.6}, error {error:.1e}");
            assert!(error < 1e-9, "{name}, {filter:?}: {forward} {reverse}");
            worst = worst.max(error);
        }
    }
    println!("forward against reverse, through whole paths: worst {worst:.1e}");
}

/// Parameters other than geometry (reflectance, roughness, texels, radiance, light and its pose), compared
/// with differences of the image with common random numbers, which follow the same paths.
#[test]
fn parameters_that_are_not_geometry() {
    let base = || {
        let mut d = everything();
        d.integrator.max_depth = Some(pick(3, 6));
        d
    };
    /// A name, a step of differences, a factor on the number of runs, the rate and the displacement.
    type Parameter = (&'static str, f64, u64, fn(&mut Tangent), fn(&mut Description, f64));
    // The image is linear in radiance and irradiance: their step may have any length. The differences of the
    // last two are wrong by up to a percent.
    let edits: [Parameter; 5] = [
        (
            "texels",
            1e-3,
            1,
            |c| c.texels[0].fill(DVec3::ONE),
            |d, t| d.textures[0].texels.iter_mut().for_each(|x| *x += t),
        ),
        (
            "radiance",
            1.0,
            1,
            |c| c.radiance[2] = DVec3::ONE,
            |d, t| d.shapes[2].radiance = d.shapes[2].radiance.map(|r| r + t),
        ),
        (
            "irradiance",
            0.5,
            1,
            |c| c.intensity[0] = DVec3::ONE,
            |d, t| {
                if let Light::Directional { irradiance, .. } = &mut d.lights[0] {
                    *irradiance += t;
                }
            },
        ),
        (
            "pose",
            1e-2,
            4,
            |c| c.pose[0] = DVec3::new(0.5, 0.2, 0.8),
            |d, t| {
                if let Light::Directional { direction, .. } = &mut d.lights[0] {
                    *direction = DQuat::from_scaled_axis(t * DVec3::new(0.5, 0.2, 0.8)) * *direction;
                }
            },
        ),
        (
            "roughness",
            1e-2,
            4,
            |c| c.roughness[0] = 1.0,
            |d, t| {
                if let Bsdf::RoughConductor { alpha, .. } = &mut d.materials[0].bsdf {
                    *alpha += t;
                }
            },
        ),
    ];
    let mut power = Power::of("space_transport::parameters_that_are_not_geometry");
    for (name, step, times, change, edit) in edits {
        let k = known(base(), |_, c| change(c), name);
        let scenes = [step, -step].map(|theta| {
            let mut d = base();
            edit(&mut d, theta);
            Scene::new(d).expect("a scene")
        });
        let difference = |samples: usize, seed: u64| {
            let image =
                |scene| render(scene, samples, seed, &Progress::none()).expect("not stopped").image.pixels;
            let [ahead, behind] = scenes.each_ref().map(image);
            ahead.iter().zip(behind).map(|(a, b)| (*a - b) / (2.0 * step)).collect::<Vec<DVec3>>()
        };
        let k = Known { weights: directed(&difference(2048, 400)), ..k };
        let runs = times * PARAMETER_RUNS * pick(1, 2);
        let all =
            |run: &(dyn Fn(u64) -> f64 + Sync)| -> Vec<f64> { (0..runs).into_par_iter().map(run).collect() };
        let reference = Estimate::of(all(&|seed| k.weighted(&difference(128, 500 + seed))));
        let found = Estimate::of(all(&|seed| k.sample(&WarpedArea { seed, ..warped(64) })));
        let slack = 0.01 * reference.mean.abs();
        let compared = Comparison { found, reference, limit: student(runs - 1), slack };
        compared.accept(&mut power, name, reference.mean);
    }
}

/// Independent runs of both sides.
const PARAMETER_RUNS: u64 = 40;
