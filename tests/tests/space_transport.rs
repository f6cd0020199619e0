//! Whole paths against central differences with common random numbers, where there is no closed form, and forward
//! against reverse mode for every parameter.
//!
//! Every scene is one number: its gradient image in the weights of a rough, independent estimate of it, so that parts
//! of opposite sign do not cancel and every pixel counts as it should. Differences are biased by powers of their step.
//! They are extrapolated from three steps (Richardson), and what the last two extrapolations differ by is allowed as
//! error, beside the standard errors of both sides. Edge sampling, whose samples have light tails, is compared with
//! them; it is then what warped area is compared with. Every method must reject what is wrong with its own terms, a
//! bias of [`NOTICED`] among it.

use std::time::Instant;

use flatland::random::{open01, stream};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;
use tests::campaign::Estimate;
use tests::effort::{pick, thorough};
use tests::power::{NOTICED, Power};
use tests::space::campaign::{Known, directed, pulled, student, weights};
use tests::space::scenes::{film, plate};
use tests::statistics::Moments;
use volume3d::geometry::Mesh;
use volume3d::gradient::{
    ActiveParameters, CameraTangent, EdgeSampling, FiniteDifference, GradientImage, Progress, Tangent,
    WarpedArea, render,
};
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Filter, Integrator, Light, Material, Microfacets, Reflectance,
    Scene, Texture, Wrap,
};

const TENT: Filter = Filter::Tent { radius: 1.0 };

/// A sphere of 80 triangles with normals of its vertices.
fn sphere(centre: DVec3, radius: f64) -> Mesh {
    let mut mesh = (
        vec![DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z],
        vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]],
    );
    for _ in 0..2 {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for t in &mesh.1 {
            let [a, b, c]: [DVec3; 3] = t.map(|i: u32| mesh.0[i as usize]);
            let k = positions.len() as u32;
            positions.extend([a, b, c, (a + b).normalize(), (b + c).normalize(), (c + a).normalize()]);
            triangles.extend([
                [k, k + 3, k + 5],
                [k + 3, k + 1, k + 4],
                [k + 5, k + 4, k + 2],
                [k + 3, k + 4, k + 5],
            ]);
        }
        mesh = (positions, triangles);
    }
    let positions = mesh.0.into_iter().map(|p| centre + radius * p).collect();
    Mesh::new(positions, mesh.1).expect("a mesh").smooth()
}

fn conductor(id: &str, alpha: f64) -> Material {
    let bsdf = Bsdf::RoughConductor {
        distribution: Microfacets::Ggx,
        alpha,
        eta: DVec3::new(0.2, 0.9, 1.1),
        k: DVec3::new(3.9, 2.4, 2.2),
        specular_reflectance: Reflectance::Constant(DVec3::splat(0.9)),
    };
    Material { id: id.to_owned(), bsdf, two_sided: true }
}

/// A floor that a camera sees nothing else of, a lamp above it, and something between them.
fn court(depth: usize, floor: Material, thing: Option<Mesh>) -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::ZERO, DVec3::Y, 0.35);
    let mut d = Description::new(camera, film(3, TENT));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 100 };
    let floor = d.add_material(floor);
    let grey = d.add_material(Material::diffuse("grey", DVec3::new(0.7, 0.6, 0.5)));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 3.0), floor);
    let thing = thing.unwrap_or_else(|| plate(DVec3::new(0.1, 0.8, -0.3), DVec3::new(0.1, 1.0, 0.3), 0.25));
    d.add_shape("thing", thing, grey);
    d.add_emitter(
        "lamp",
        plate(DVec3::new(0.2, 2.0, -0.6), DVec3::new(-0.1, -1.0, 0.2), 0.5),
        DVec3::splat(6.0),
    );
    d
}

fn known(d: Description, moves: impl Fn(&Scene, &mut Tangent), label: &str) -> Known {
    let scene = Scene::new(d).expect("a scene");
    let mut change = Tangent::still(&scene);
    moves(&scene, &mut change);
    let (width, height) = scene.size();
    let weights = weights(width * height);
    Known { scene, change, weights, exact: 0.0, error: 0.0, scale: 0.0, label: label.to_owned() }
}

/// How many independent runs differences, edge sampling and warped area are given on a scene: so many times as many as
/// there are of each at least, whose spread is estimated by as many degrees of freedom.
fn runs(times: [u64; 3]) -> [u64; 3] {
    times.map(|times| 96 * pick(1, 4) * times)
}

/// Samples a pixel in each run.
const DIFFERENCE_SAMPLES: usize = 176;
const WARPED_SAMPLES: usize = 64;

fn edges(seed: u64) -> EdgeSampling {
    EdgeSampling { samples: 64, primary: 64, secondary: 256, seed }
}

/// Runs in parallel, seed by seed.
fn repeated<T: Send>(runs: u64, run: impl Fn(u64) -> T + Send + Sync) -> Vec<T> {
    (0..runs).into_par_iter().map(run).collect()
}

fn estimate(runs: impl Iterator<Item = f64>) -> Estimate {
    let moments: Moments = runs.collect();
    Estimate { mean: moments.mean(), standard_error: moments.standard_error() }
}

/// Central differences at three steps, h, 2h and 4h, extrapolated twice, and how far apart the last two extrapolations
/// are: an error of order h⁶ and one of order h⁴.
fn differences(k: &Known, step: f64, runs: u64) -> (Estimate, f64) {
    let runs: Vec<[f64; 2]> = repeated(runs, |seed| {
        let at = [1.0, 2.0, 4.0].map(|times| {
            let method =
                FiniteDifference { samples: DIFFERENCE_SAMPLES, step: times * step, seed: 9000 + seed };
            k.weighted(&method.forward(&k.scene, &k.change, &Progress::none()).expect("valid").gradient)
        });
        let [narrow, wide] = [0, 1].map(|i| (4.0 * at[i] - at[i + 1]) / 3.0);
        [(16.0 * narrow - wide) / 15.0, (narrow - wide) / 15.0]
    });
    (estimate(runs.iter().map(|r| r[0])), estimate(runs.iter().map(|r| r[1])).mean.abs())
}

/// The same scene in the weights of a gradient from other samples. Any weights are fair, and these notice most.
fn weighted(k: Known) -> Known {
    let other = EdgeSampling { samples: 1024, primary: 1024, secondary: 4096, seed: 7777 };
    let other = other.forward(&k.scene, &k.change, &Progress::none()).expect("valid").gradient;
    Known { weights: directed(&other), ..k }
}

/// A method by its terms.
type Method = fn(&Known, u64) -> GradientImage;

const METHODS: [(&str, Method); 2] = [
    ("edge sampling", |k, seed| {
        edges(seed).forward_terms(&k.scene, &k.change, &Progress::none()).expect("valid")
    }),
    ("warped area", |k, seed| warped(k, WarpedArea { seed, ..area() })),
];

fn area() -> WarpedArea {
    WarpedArea { samples: WARPED_SAMPLES, ..WarpedArea::default() }
}

fn warped(k: &Known, method: WarpedArea) -> GradientImage {
    method.forward_terms(&k.scene, &k.change, &Progress::none()).expect("valid")
}

/// Interior, primary and secondary term of every run.
fn terms(k: &Known, runs: u64, method: Method) -> Vec<[f64; 3]> {
    repeated(runs, |seed| {
        let found = method(k, seed);
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, k.label);
        let terms = found.terms.expect("asked for");
        [&terms.interior, &terms.primary, &terms.secondary].map(|term| k.weighted(term))
    })
}

/// Σ factor · term.
fn combined(terms: &[[f64; 3]], factors: [f64; 3]) -> Estimate {
    estimate(terms.iter().map(|t| t.iter().zip(factors).map(|(t, f)| t * f).sum()))
}

/// What is wrong on purpose, by factors of a method's own three terms.
#[derive(Clone, Copy, Debug)]
enum Control {
    /// Nothing that jumps moves.
    Interior,
    /// What jumps moves on the film only.
    Primary,
    /// All that jumps moves the other way.
    Flipped,
    /// A bias that must be noticed.
    Biased,
}

impl Control {
    fn factors(self) -> [f64; 3] {
        match self {
            Self::Interior => [1.0, 0.0, 0.0],
            Self::Primary => [1.0, 1.0, 0.0],
            Self::Flipped => [1.0, -1.0, -1.0],
            Self::Biased => [1.0 - NOTICED; 3],
        }
    }
}

/// Where only what is on the film jumps, and where shadows and reflections count.
const ALL: &[Control] = &[Control::Interior, Control::Primary, Control::Flipped, Control::Biased];
const FILM: &[Control] = &[Control::Interior, Control::Flipped, Control::Biased];

/// How far a mean is off, and how far it may be: printed.
struct Distance {
    off: f64,
    tolerance: f64,
}

fn distance(name: &str, found: Estimate, reference: Estimate, slack: f64, runs: u64) -> Distance {
    let error = found.standard_error.hypot(reference.standard_error);
    let off = (found.mean - reference.mean).abs();
    // Of two errors the one with fewer runs is taken to be all: the limit is on the safe side.
    let tolerance = student(runs - 1) * error + slack;
    println!(
        "{name}: ratio {:.4} ± {:.4}, z {:.2}, rejects {:.1} %",
        found.mean / reference.mean,
        error / reference.mean.abs(),
        (found.mean - reference.mean) / error,
        100.0 * tolerance / reference.mean.abs()
    );
    Distance { off, tolerance }
}

/// Both methods on a scene, and what each must reject of its own.
fn compare(power: &mut Power, k: Known, step: f64, runs: [u64; 3], controls: &[Control]) {
    let k = weighted(k);
    let start = Instant::now();
    let [difference_runs, edge_runs, warped_runs] = runs;
    let (differences, slack) = differences(&k, step, difference_runs);
    println!(
        "{}: {differences:?}, steps differ by {slack:.1e}, {:.1} s",
        k.label,
        start.elapsed().as_secs_f64()
    );
    let (mut reference, mut slack, mut failures) = (differences, slack, vec![]);
    for ((name, method), count) in METHODS.into_iter().zip([edge_runs, warped_runs]) {
        let start = Instant::now();
        let terms = terms(&k, count, method);
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        let fewest = count.min(difference_runs);
        let compared = |what: &str, factors: [f64; 3]| {
            distance(&format!("{}, {what}", k.label), combined(&terms, factors), reference, slack, fewest)
        };
        let found = compared(name, [1.0; 3]);
        power.add(format!("{}, {name}", k.label), found.tolerance, reference.mean);
        if found.off > found.tolerance {
            failures.push(format!("{name} is off by {:.4}, beyond {:.4}", found.off, found.tolerance));
        }
        for control in controls {
            let found = compared(&format!("{name}, control {control:?}"), control.factors());
            if found.off <= found.tolerance {
                failures.push(format!("{name}: the control {control:?} was not rejected"));
            }
        }
        if name == METHODS[0].0 {
            (reference, slack) = (combined(&terms, [1.0; 3]), 0.0);
        }
    }
    assert!(failures.is_empty(), "{}: {failures:?}", k.label);
}

#[test]
fn direct_light() {
    let mut power = Power::of("space_transport::direct_light");
    let grey = || Material::diffuse("floor", DVec3::splat(0.6));
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.translate(scene, 1, DVec3::new(0.1, 0.2, 0.1));
        change.scale(scene, 1, DVec3::new(0.1, 0.8, -0.3), 1.0);
    };
    compare(
        &mut power,
        known(court(2, grey(), None), fall, "direct light, occluder"),
        3e-2,
        runs([1, 1, 1]),
        ALL,
    );
    let turn = |scene: &Scene, change: &mut Tangent| {
        change.rotate(scene, 2, DVec3::new(0.4, 2.2, -0.6), DVec3::new(0.4, 0.5, -0.6));
        change.scale(scene, 2, DVec3::new(0.2, 2.0, -0.6), 0.5);
    };
    compare(
        &mut power,
        known(court(2, grey(), None), turn, "direct light, lamp"),
        3e-2,
        runs([1, 1, 1]),
        &[Control::Biased],
    );
    let floor = |scene: &Scene, change: &mut Tangent| {
        change.translate(scene, 0, DVec3::new(0.2, 0.5, -0.4));
        change.rotate(scene, 0, DVec3::ZERO, DVec3::new(0.3, 0.0, 0.2));
    };
    compare(
        &mut power,
        known(court(2, grey(), None), floor, "a floor moves under an occluder"),
        3e-2,
        runs([2, 2, 4]),
        ALL,
    );
    power.finish();
}

/// A plate that reflects on both sides, seen from behind and lit from there.
#[test]
fn two_sided_surfaces_from_behind() {
    let mut power = Power::of("space_transport::two_sided_surfaces_from_behind");
    let behind = plate(DVec3::new(0.1, 0.5, -0.1), DVec3::new(0.1, -1.0, -0.3), 0.3);
    let mut d = court(3, Material::diffuse("floor", DVec3::splat(0.6)), Some(behind));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.1, 0.3, -0.1), DVec3::Y, 0.7);
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.translate(scene, 1, DVec3::new(0.3, 0.4, 0.1));
        change.rotate(scene, 1, DVec3::new(0.1, 0.5, -0.1), DVec3::new(0.5, 0.2, 0.3));
    };
    compare(&mut power, known(d, fall, "a plate from behind"), 4.5e-2, runs([3, 1, 1]), ALL);
    power.finish();
}

/// Without normals of its own a sphere is a body of 128 faces, of which every edge is a jump.
#[test]
fn a_flat_shaded_body() {
    let mut power = Power::of("space_transport::a_flat_shaded_body");
    let flat = sphere(DVec3::new(0.05, 0.7, -0.2), 0.3);
    let flat = Mesh::new(flat.positions().to_vec(), flat.triangles().to_vec()).expect("a mesh");
    let mut d = court(2, Material::diffuse("floor", DVec3::splat(0.3)), Some(flat));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.6, -0.2), DVec3::Y, 0.6);
    let turn = |scene: &Scene, change: &mut Tangent| {
        change.rotate(scene, 1, DVec3::new(0.05, 0.7, -0.2), DVec3::new(0.5, 1.0, 0.2));
        change.translate(scene, 1, DVec3::new(0.2, 0.1, 0.1));
    };
    compare(&mut power, known(d, turn, "a flat-shaded body turns"), 4.5e-2, runs([4, 2, 2]), FILM);
    power.finish();
}

/// A floor that sees no lamp: its light comes from a ceiling, past a block that moves and is lit too.
#[test]
fn light_scattered_several_times() {
    let mut power = Power::of("space_transport::light_scattered_several_times");
    let low = plate(DVec3::new(0.1, 0.45, -0.3), DVec3::new(0.1, 1.0, 0.3), 0.35);
    let bounces = pick(2, 4);
    let mut d = court(bounces + 1, Material::diffuse("floor", DVec3::splat(0.7)), Some(low));
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.8)));
    // The lamp shines up to the ceiling.
    d.shapes[2].mesh = plate(DVec3::new(0.3, 1.6, -0.4), DVec3::new(0.1, 1.0, 0.0), 0.4);
    d.shapes[2].radiance = Some(DVec3::splat(20.0));
    d.add_shape("ceiling", plate(DVec3::new(0.0, 2.6, 0.0), DVec3::NEG_Y, 3.0), white);
    d.add_shape("wall", plate(DVec3::new(0.0, 1.3, -2.5), DVec3::Z, 3.0), white);
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.scale(scene, 1, DVec3::new(0.1, 0.45, -0.3), 1.0);
    };
    compare(&mut power, known(d, fall, &format!("{bounces} bounces")), 6e-2, runs([4, 3, 12]), FILM);
    power.finish();
}

#[test]
fn glossy_reflection() {
    let mut power = Power::of("space_transport::glossy_reflection");
    // The first is nearly a mirror: its lobe is 3 degrees wide, and few samples find what they need.
    for (alpha, times) in [(0.03, [3, 4, 4]), (0.1, [2, 1, 1]), (0.3, [1, 1, 1])] {
        if alpha != 0.1 && !thorough() {
            continue;
        }
        let d = court(2, conductor("metal", alpha), None);
        let fall = |scene: &Scene, change: &mut Tangent| {
            change.scale(scene, 1, DVec3::new(0.1, 0.8, -0.3), 1.0);
            change.scale(scene, 2, DVec3::new(0.2, 2.0, -0.6), -0.5);
        };
        let k = known(d, fall, &format!("rough conductor, alpha {alpha}"));
        compare(&mut power, k, 3e-2, runs(times), FILM);
    }
    power.finish();
}

/// A smooth-shaded sphere as occluder and in view, and a floor that tilts under it.
#[test]
fn a_smooth_sphere() {
    let mut power = Power::of("space_transport::a_smooth_sphere");
    let thing = Some(sphere(DVec3::new(0.05, 0.7, -0.2), 0.3));
    let d = court(2, Material::diffuse("floor", DVec3::splat(0.6)), thing.clone());
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.scale(scene, 1, DVec3::new(0.05, 0.7, -0.2), 1.0);
    };
    compare(&mut power, known(d, fall, "shadow of a sphere"), 3e-2, runs([1, 1, 1]), ALL);
    if !thorough() {
        // Differences of what is seen itself are noisy: a smooth cube in view has to do.
        return power.finish();
    }
    let mut d = court(2, Material::diffuse("floor", DVec3::splat(0.1)), thing);
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.7, -0.2), DVec3::Y, 0.5);
    let grow = |scene: &Scene, change: &mut Tangent| {
        change.scale(scene, 1, DVec3::new(0.05, 0.7, -0.2), 0.5);
        change.translate(scene, 1, DVec3::new(0.2, 0.1, 0.1));
    };
    compare(&mut power, known(d, grow, "a sphere in view"), 4.5e-2, runs([3, 2, 1]), FILM);
    power.finish();
}

/// A cube with normals as a ball's, which turns its other side to the camera and to the floor far from any edge.
#[test]
fn a_smooth_cube() {
    let mut power = Power::of("space_transport::a_smooth_cube");
    let turned = DAffine3::from_rotation_translation(
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.2),
        DVec3::new(0.05, 0.4, -0.2),
    );
    let cube = Mesh::cube().smooth().transformed(&(turned * DAffine3::from_scale(DVec3::splat(0.25))));
    let mut d = court(3, Material::diffuse("floor", DVec3::splat(0.6)), Some(cube));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.3, -0.2), DVec3::Y, 0.5);
    let turn = |scene: &Scene, change: &mut Tangent| {
        change.rotate(scene, 1, DVec3::new(0.05, 0.4, -0.2), DVec3::new(0.5, 1.0, 0.2));
        change.scale(scene, 1, DVec3::new(0.05, 0.4, -0.2), 0.5);
    };
    compare(&mut power, known(d, turn, "a smooth cube"), 4.5e-2, runs([3, 1, 2]), FILM);
    power.finish();
}

/// Everything a scene can have: textures, two kinds of facets, smooth normals, all lights that may be warped.
fn everything(sun: f64) -> Description {
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
        kappa: sun,
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

/// ⟨δ, J v⟩ = ⟨Jᵀ δ, v⟩ for every parameter at once and for each family by itself.
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
        let mut d = everything(20.0);
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
        let adjoint = weights(36);
        let method = WarpedArea { samples: 4, seed: 2, ..WarpedArea::default() };
        let active = ActiveParameters::everything(&scene);
        let gradient = pulled(method.reverse(&scene, &adjoint, &active, &Progress::none()).expect("valid"));
        for (name, change) in families {
            let image = method.forward(&scene, &change, &Progress::none()).expect("valid");
            assert!(image.non_finite.is_empty());
            let terms = adjoint.iter().zip(&image.gradient).map(|(w, g)| *w * *g);
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

/// What is not geometry: reflectance, roughness, texels, radiance, light and its pose, against differences of
/// the image with common random numbers, whose paths are the same.
#[test]
fn parameters_that_are_not_geometry() {
    let base = || {
        let mut d = everything(20.0);
        d.integrator.max_depth = Some(pick(3, 6));
        d
    };
    /// A name, a step of differences, how many times the runs, the rate and the displacement.
    type Parameter = (&'static str, f64, u64, fn(&mut Tangent), fn(&mut Description, f64));
    // Of radiance and irradiance the image is a linear function: a step may be as long as it likes. Those of
    // the last two are off by up to a percent.
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
            let image = |scene| render(scene, samples, seed, &Progress::none()).expect("not stopped").pixels;
            let [ahead, behind] = scenes.each_ref().map(image);
            ahead.iter().zip(behind).map(|(a, b)| (*a - b) / (2.0 * step)).collect::<Vec<DVec3>>()
        };
        let k = Known { weights: directed(&difference(2048, 400)), ..k };
        let runs = times * PARAMETER_RUNS * pick(1, 4);
        let reference = estimate(repeated(runs, |seed| k.weighted(&difference(128, 500 + seed))).into_iter());
        let found = estimate(
            repeated(runs, |seed| {
                k.weighted(&k.run(&WarpedArea { samples: 64, seed, ..WarpedArea::default() }).gradient)
            })
            .into_iter(),
        );
        let compared = distance(name, found, reference, 0.01 * reference.mean.abs(), runs);
        assert!(compared.off < compared.tolerance, "{name}: {found:?} for {reference:?}");
        let less = Estimate { mean: (1.0 - NOTICED) * found.mean, ..found };
        let control = distance(name, less, reference, 0.01 * reference.mean.abs(), runs);
        assert!(control.off > control.tolerance, "{name} would pass with a bias of {NOTICED}");
        power.add(name, compared.tolerance, reference.mean);
    }
    power.finish();
}

/// Independent runs of both sides.
const PARAMETER_RUNS: u64 = 64;
