//! Whole paths against central differences with common random numbers, where there is no closed form, and forward
//! against reverse mode for every parameter.
//!
//! Every scene is one number: its gradient image in the weights of a rough, independent estimate of it, so that parts
//! of opposite sign do not cancel and every pixel counts as it should. Differences are biased by the square of their
//! step. They are extrapolated from two steps (Richardson), and what the two differ by is allowed as error, beside the
//! standard errors of both sides. Edge sampling, whose samples have light tails, is compared with them; it is then
//! what the other methods are compared with. A method is one row of [`METHODS`].

use flatland::random::{open01, stream};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;
use tests::campaign::Estimate;
use tests::space::campaign::{Known, limit, pulled, weights};
use tests::statistics::Moments;
use volume3d::geometry::Mesh;
use volume3d::gradient::{
    CameraChange, Change, EdgeSampling, FiniteDifference, GradientImage, Progress, Terms, Wanted, WarpedArea,
    render,
};
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Integrator, Light, Material, Microfacets,
    Reflectance, Scene, Texture, Wrap,
};

fn film(size: usize) -> Film {
    Film { width: size, height: size, crop: None, filter: Filter::Tent { radius: 1.0 } }
}

fn placed(mesh: Mesh, centre: DVec3, normal: DVec3, scale: DVec3) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    mesh.transformed(&DAffine3::from_scale_rotation_translation(scale, turn, centre))
}

fn plate(centre: DVec3, normal: DVec3, half: f64) -> Mesh {
    placed(Mesh::rectangle(), centre, normal, DVec3::splat(half))
}

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
    let mut d = Description::new(camera, film(3));
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

fn known(d: Description, moves: impl Fn(&Scene, &mut Change), label: &str) -> Known {
    let scene = Scene::new(d).expect("a scene");
    let mut change = Change::still(&scene);
    moves(&scene, &mut change);
    let (width, height) = scene.size();
    let weights = weights(width * height);
    Known { scene, change, weights, exact: 0.0, error: 0.0, value: 0.0, label: label.to_owned() }
}

/// The scene moved by θ: shapes and camera. Computed normals follow.
fn displaced(k: &Known, theta: f64) -> Scene {
    let mut d = k.scene.description().clone();
    for (i, shape) in d.shapes.iter_mut().enumerate() {
        let moved = shape.mesh.positions().iter().zip(k.change.positions_of(&k.scene, i));
        let moved: Vec<DVec3> = moved.map(|(p, v)| *p + theta * *v).collect();
        let mesh = Mesh::new(moved, shape.mesh.triangles().to_vec()).expect("a mesh");
        assert_eq!(mesh.positions().len(), shape.mesh.positions().len(), "vertices have met");
        shape.mesh = mesh.with_normals(shape.mesh.normals().clone()).expect("normals");
    }
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(theta * k.change.camera.rotation));
    d.camera.origin += theta * k.change.camera.translation;
    for axis in [&mut d.camera.right, &mut d.camera.up, &mut d.camera.forward] {
        *axis = turn * *axis;
    }
    Scene::new(d).expect("a scene")
}

/// Central differences at two steps, extrapolated, and how far apart the two are.
fn differences(k: &Known, step: f64) -> (Estimate, f64) {
    let scenes = [2.0, 1.0, -1.0, -2.0].map(|m| displaced(k, m * step));
    let runs: Vec<[f64; 2]> = (0..DIFFERENCES)
        .into_par_iter()
        .map(|seed| {
            let sums = scenes.each_ref().map(|scene| {
                let image = render(scene, DIFFERENCE_SAMPLES, 9000 + seed, &Progress::none());
                k.weighted(&image.expect("not stopped").pixels)
            });
            let (wide, narrow) = ((sums[0] - sums[3]) / (4.0 * step), (sums[1] - sums[2]) / (2.0 * step));
            [(4.0 * narrow - wide) / 3.0, (narrow - wide) / 3.0]
        })
        .collect();
    let [extrapolated, apart] = [0, 1].map(|i| runs.iter().map(|r| r[i]).collect::<Moments>());
    let estimate = Estimate { mean: extrapolated.mean(), standard_error: extrapolated.standard_error() };
    (estimate, apart.mean().abs())
}

/// Independent runs of differences, and their samples a pixel.
const DIFFERENCES: u64 = 64;
const DIFFERENCE_SAMPLES: usize = 1024;

/// The same scene in the weights of a rough gradient.
fn focused(k: Known, step: f64) -> Known {
    let rough = FiniteDifference { samples: 2048, step: 2.0 * step, seed: 77 };
    let weights = rough.forward(&k.scene, &k.change, &Progress::none()).expect("valid").gradient;
    // Scaled so that the sum is about 1.
    let scale: f64 = weights.iter().map(|w| w.length_squared()).sum();
    Known { weights: weights.into_iter().map(|w| w / scale).collect(), ..k }
}

/// A method, and how well these scenes must tell whether it is biased.
struct Row {
    name: &'static str,
    run: fn(&Known, u64) -> GradientImage,
    /// The largest standard error of its ratio to the reference that a comparison may have.
    bound: f64,
    /// Why it is not smaller.
    reason: &'static str,
}

const METHODS: [Row; 2] = [
    Row {
        name: "edge sampling",
        run: |k, seed| edges(seed).forward(&k.scene, &k.change, &Progress::none()).expect("valid"),
        bound: 0.07,
        reason: "the noise of differences: 1 or 2% in shadows and reflections, 5% where the body that moves is in view",
    },
    Row {
        name: "warped area",
        run: |k, seed| k.run(&WarpedArea { samples: 160, seed, ..WarpedArea::default() }),
        bound: 0.15,
        reason: "its samples have heavier tails where jumps of different motion are near to one another: 10% after four bounces",
    },
];

fn edges(seed: u64) -> EdgeSampling {
    EdgeSampling { samples: 128, primary: 128, secondary: 512, seed }
}

fn repeated(k: &Known, run: fn(&Known, u64) -> GradientImage) -> Estimate {
    k.repeated(0, |seed| {
        let found = run(k, seed);
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, k.label);
        k.weighted(&found.gradient)
    })
}

/// What edge sampling finds of a scene, in terms: interior, primary and secondary.
fn terms(k: &Known, pick: impl Fn(&Terms, usize) -> DVec3) -> Estimate {
    k.repeated(0, |seed| {
        let found = edges(seed).forward_terms(&k.scene, &k.change, &Progress::none()).expect("valid");
        let terms = found.terms.expect("asked for");
        k.weighted(&(0..k.weights.len()).map(|i| pick(&terms, i)).collect::<Vec<_>>())
    })
}

/// How far apart two estimates are, and the error of that; printed.
fn apart(k: &Known, name: &str, found: Estimate, reference: Estimate) -> (f64, f64) {
    let error = found.standard_error.hypot(reference.standard_error);
    println!(
        "{}, {name}: ratio {:.4} ± {:.4}, z {:.2}",
        k.label,
        found.mean / reference.mean,
        error / reference.mean.abs(),
        (found.mean - reference.mean) / error
    );
    ((found.mean - reference.mean).abs(), error)
}

/// All methods on a scene, and what must be rejected there: the interior term alone, and, where it counts, all but
/// the secondary term.
fn compare(k: Known, step: f64, controls: &[Control]) {
    let k = focused(k, step);
    let (differences, slack) = differences(&k, step);
    println!("{}: {differences:?}, steps differ by {slack:.1e}", k.label);
    let (mut reference, mut slack, mut failures) = (differences, slack, vec![]);
    for (i, row) in METHODS.iter().enumerate() {
        let found = repeated(&k, row.run);
        let (off, error) = apart(&k, row.name, found, reference);
        if off > limit() * error + slack {
            failures.push(format!("{} is off by {off:.4} ± {error:.4}", row.name));
        }
        if error + slack > row.bound * reference.mean.abs() {
            failures.push(format!("{}: ± {error:.4} + {slack:.4} (bound: {})", row.name, row.reason));
        }
        if i == 0 {
            (reference, slack) = (found, 0.0);
        }
    }
    for control in controls {
        let found = match control {
            Control::Interior => terms(&k, |t, i| t.interior[i]),
            Control::Primary => terms(&k, |t, i| t.interior[i] + t.primary[i]),
            Control::DirectLight => repeated(&shallow(&k), METHODS[0].run),
        };
        let (off, error) = apart(&k, &format!("control {control:?}"), found, reference);
        if off <= limit() * error {
            failures.push(format!("the control {control:?} was not rejected"));
        }
    }
    assert!(failures.is_empty(), "{}: {failures:?}", k.label);
}

/// What is wrong on purpose.
#[derive(Clone, Copy, Debug)]
enum Control {
    /// Nothing that jumps moves.
    Interior,
    /// What jumps moves on the film only.
    Primary,
    /// Light that is reflected once only.
    DirectLight,
}

/// The same scene with light that is reflected once.
fn shallow(k: &Known) -> Known {
    let mut d = k.scene.description().clone();
    d.integrator.max_depth = Some(2);
    let scene = Scene::new(d).expect("a scene");
    Known { scene, change: k.change.clone(), weights: k.weights.clone(), label: k.label.clone(), ..*k }
}

#[test]
fn direct_light() {
    let grey = || Material::diffuse("floor", DVec3::splat(0.6));
    let fall = |scene: &Scene, change: &mut Change| {
        change.translate(scene, 1, DVec3::new(0.1, 0.2, 0.1));
        change.scale(scene, 1, DVec3::new(0.1, 0.8, -0.3), 1.0);
    };
    let both = &[Control::Interior, Control::Primary];
    compare(known(court(2, grey(), None), fall, "direct light, occluder"), 1e-2, both);
    let turn = |scene: &Scene, change: &mut Change| {
        change.rotate(scene, 2, DVec3::new(0.4, 2.2, -0.6), DVec3::new(0.4, 0.5, -0.6));
        change.scale(scene, 2, DVec3::new(0.2, 2.0, -0.6), 0.5);
    };
    compare(known(court(2, grey(), None), turn, "direct light, lamp"), 1e-2, both);
    let floor = |scene: &Scene, change: &mut Change| {
        change.translate(scene, 0, DVec3::new(0.2, 0.5, -0.4));
        change.rotate(scene, 0, DVec3::ZERO, DVec3::new(0.3, 0.0, 0.2));
    };
    compare(known(court(2, grey(), None), floor, "a floor moves under an occluder"), 1e-2, both);
}

/// A plate that reflects on both sides, seen from behind and lit from there.
#[test]
fn two_sided_surfaces_from_behind() {
    let behind = plate(DVec3::new(0.1, 0.5, -0.1), DVec3::new(0.1, -1.0, -0.3), 0.3);
    let mut d = court(3, Material::diffuse("floor", DVec3::splat(0.6)), Some(behind));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.1, 0.3, -0.1), DVec3::Y, 0.7);
    let fall = |scene: &Scene, change: &mut Change| {
        change.translate(scene, 1, DVec3::new(0.3, 0.4, 0.1));
        change.rotate(scene, 1, DVec3::new(0.1, 0.5, -0.1), DVec3::new(0.5, 0.2, 0.3));
    };
    compare(known(d, fall, "a plate from behind"), 1e-2, &[Control::Interior, Control::Primary]);
}

/// Without normals of its own a sphere is a body of 128 faces, of which every edge is a jump.
#[test]
fn a_flat_shaded_body() {
    let flat = sphere(DVec3::new(0.05, 0.7, -0.2), 0.3);
    let flat = Mesh::new(flat.positions().to_vec(), flat.triangles().to_vec()).expect("a mesh");
    let mut d = court(2, Material::diffuse("floor", DVec3::splat(0.3)), Some(flat));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.6, -0.2), DVec3::Y, 0.6);
    let turn = |scene: &Scene, change: &mut Change| {
        change.rotate(scene, 1, DVec3::new(0.05, 0.7, -0.2), DVec3::new(0.5, 1.0, 0.2));
        change.translate(scene, 1, DVec3::new(0.2, 0.1, 0.1));
    };
    compare(known(d, turn, "a flat-shaded body turns"), 5e-3, &[Control::Interior]);
}

/// A floor that sees no lamp: its light comes from a ceiling, past a block that moves and is lit too.
#[test]
fn light_scattered_up_to_four_times() {
    let low = plate(DVec3::new(0.1, 0.45, -0.3), DVec3::new(0.1, 1.0, 0.3), 0.35);
    let mut d = court(5, Material::diffuse("floor", DVec3::splat(0.7)), Some(low));
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.8)));
    // The lamp shines up to the ceiling.
    d.shapes[2].mesh = plate(DVec3::new(0.3, 1.6, -0.4), DVec3::new(0.1, 1.0, 0.0), 0.4);
    d.shapes[2].radiance = Some(DVec3::splat(20.0));
    d.add_shape("ceiling", plate(DVec3::new(0.0, 2.6, 0.0), DVec3::NEG_Y, 3.0), white);
    d.add_shape("wall", plate(DVec3::new(0.0, 1.3, -2.5), DVec3::Z, 3.0), white);
    let fall = |scene: &Scene, change: &mut Change| {
        change.scale(scene, 1, DVec3::new(0.1, 0.45, -0.3), 1.0);
    };
    compare(known(d, fall, "four bounces"), 1e-2, &[Control::Interior, Control::DirectLight]);
}

#[test]
fn glossy_reflection() {
    // The first is nearly a mirror: its lobe is 3 degrees wide.
    for alpha in [0.03, 0.1, 0.3] {
        let d = court(2, conductor("metal", alpha), None);
        let fall = |scene: &Scene, change: &mut Change| {
            change.scale(scene, 1, DVec3::new(0.1, 0.8, -0.3), 1.0);
            change.scale(scene, 2, DVec3::new(0.2, 2.0, -0.6), -0.5);
        };
        compare(known(d, fall, &format!("rough conductor, alpha {alpha}")), 1e-2, &[Control::Interior]);
    }
}

/// A smooth-shaded sphere as occluder and in view, and a floor that tilts under it.
#[test]
fn a_smooth_sphere() {
    let thing = Some(sphere(DVec3::new(0.05, 0.7, -0.2), 0.3));
    let d = court(2, Material::diffuse("floor", DVec3::splat(0.6)), thing.clone());
    let fall = |scene: &Scene, change: &mut Change| {
        change.scale(scene, 1, DVec3::new(0.05, 0.7, -0.2), 1.0);
    };
    compare(known(d, fall, "shadow of a sphere"), 1e-2, &[Control::Interior, Control::Primary]);
    let mut d = court(2, Material::diffuse("floor", DVec3::splat(0.1)), thing);
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.7, -0.2), DVec3::Y, 0.5);
    let grow = |scene: &Scene, change: &mut Change| {
        change.scale(scene, 1, DVec3::new(0.05, 0.7, -0.2), 0.5);
        change.translate(scene, 1, DVec3::new(0.2, 0.1, 0.1));
    };
    compare(known(d, grow, "a sphere in view"), 1e-2, &[Control::Interior]);
}

/// A cube with normals as a ball's, which turns its other side to the camera and to the floor far from any edge.
#[test]
fn a_smooth_cube() {
    let turned = DAffine3::from_rotation_translation(
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.2),
        DVec3::new(0.05, 0.4, -0.2),
    );
    let cube = Mesh::cube().smooth().transformed(&(turned * DAffine3::from_scale(DVec3::splat(0.25))));
    let mut d = court(3, Material::diffuse("floor", DVec3::splat(0.6)), Some(cube));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.3, -0.2), DVec3::Y, 0.5);
    let turn = |scene: &Scene, change: &mut Change| {
        change.rotate(scene, 1, DVec3::new(0.05, 0.4, -0.2), DVec3::new(0.5, 1.0, 0.2));
        change.scale(scene, 1, DVec3::new(0.05, 0.4, -0.2), 0.5);
    };
    compare(known(d, turn, "a smooth cube"), 5e-3, &[Control::Interior, Control::Primary]);
}

/// Everything a scene can have: textures, two kinds of facets, smooth normals, all lights that may be warped.
fn everything(sun: f64) -> Description {
    let mut d = court(6, conductor("metal", 0.25), Some(sphere(DVec3::new(0.05, 0.7, -0.2), 0.3)));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.4, -0.2), DVec3::Y, 0.9);
    d.film = film(6);
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

fn random_change(scene: &Scene, seed: u64) -> Change {
    let mut rng = stream(seed, &[]);
    let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
    let mut change = Change::still(scene);
    change.positions.iter_mut().for_each(|p| *p = random());
    change.reflectance.iter_mut().for_each(|p| *p = random());
    change.roughness.iter_mut().for_each(|p| *p = random().x);
    change.texels.iter_mut().flatten().for_each(|p| *p = random());
    change.radiance.iter_mut().for_each(|p| *p = random());
    change.intensity.iter_mut().for_each(|p| *p = random());
    change.pose.iter_mut().for_each(|p| *p = random());
    change.environment_rotation = random();
    change.camera = CameraChange { translation: random(), rotation: random(), field_of_view: random().x };
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
        let all = random_change(&scene, seed as u64);
        let still = Change::still(&scene);
        let families = [
            ("all", all.clone()),
            ("positions", Change { positions: all.positions.clone(), ..still.clone() }),
            ("camera", Change { camera: all.camera, ..still.clone() }),
            ("reflectance", Change { reflectance: all.reflectance.clone(), ..still.clone() }),
            ("roughness", Change { roughness: all.roughness.clone(), ..still.clone() }),
            ("texels", Change { texels: all.texels.clone(), ..still.clone() }),
            ("radiance", Change { radiance: all.radiance.clone(), ..still.clone() }),
            ("intensity", Change { intensity: all.intensity.clone(), ..still.clone() }),
            ("pose", Change { pose: all.pose.clone(), ..still.clone() }),
            ("environment's rotation", Change { environment_rotation: all.environment_rotation, ..still }),
        ];
        let adjoint = weights(36);
        let method = WarpedArea { samples: 4, seed: 2, ..WarpedArea::default() };
        let wanted = Wanted::everything(&scene);
        let gradient = pulled(method.reverse(&scene, &adjoint, &wanted, &Progress::none()).expect("valid"));
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
    let base = || everything(20.0);
    /// A name, a step of differences, the rate and the displacement.
    type Parameter = (&'static str, f64, fn(&mut Change), fn(&mut Description, f64));
    // Of radiance and irradiance the image is a linear function: a step may be as long as it likes. Those of
    // the last two are off by up to a percent.
    let edits: [Parameter; 5] = [
        (
            "texels",
            1e-3,
            |c| c.texels[0].fill(DVec3::ONE),
            |d, t| d.textures[0].texels.iter_mut().for_each(|x| *x += t),
        ),
        (
            "radiance",
            1.0,
            |c| c.radiance[2] = DVec3::ONE,
            |d, t| d.shapes[2].radiance = d.shapes[2].radiance.map(|r| r + t),
        ),
        (
            "irradiance",
            0.5,
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
            |c| c.roughness[0] = 1.0,
            |d, t| {
                if let Bsdf::RoughConductor { alpha, .. } = &mut d.materials[0].bsdf {
                    *alpha += t;
                }
            },
        ),
    ];
    for (name, step, change, edit) in edits {
        let k = known(base(), |_, c| change(c), name);
        let found = k.estimate(0, &WarpedArea { samples: 96, ..WarpedArea::default() });
        let scenes = [step, -step].map(|theta| {
            let mut d = base();
            edit(&mut d, theta);
            Scene::new(d).expect("a scene")
        });
        let runs: Moments = (0..48)
            .map(|seed| {
                let [a, b] = scenes.each_ref().map(|scene| {
                    k.weighted(
                        &render(scene, 128, 500 + seed, &Progress::none()).expect("not stopped").pixels,
                    )
                });
                (a - b) / (2.0 * step)
            })
            .collect();
        let error = found.standard_error.hypot(runs.standard_error());
        let z = (found.mean - runs.mean()).abs() / error;
        println!(
            "{name}: {found:?}, differences {:.5} ± {:.5}, z {z:.2}",
            runs.mean(),
            runs.standard_error()
        );
        assert!((found.mean - runs.mean()).abs() < limit() * error + 0.01 * found.mean.abs(), "{name}");
        assert!(error < 0.25 * found.mean.abs(), "{name}: {error}");
    }
}
