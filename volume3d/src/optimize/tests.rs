use glam::{DAffine3, DQuat, DVec3};

use super::*;
use crate::Image;
use crate::geometry::{Attribute, Mesh, Normals};
use crate::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Light, Material, Microfacets, Reflectance, Scene,
    Texture, Wrap,
};

/// Something of every kind.
pub(super) fn scene() -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO, DVec3::Y, 0.7);
    let film =
        Film { width: 8, height: 8, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } };
    let mut d = Description::new(camera, film);
    let texels = (0..6).map(|i| DVec3::splat(0.1 * f64::from(i))).collect();
    let (wrap, to_uv) = (Wrap::Clamp, glam::DAffine2::IDENTITY);
    let texture = d.add_texture(Texture { id: "paper".to_owned(), width: 3, height: 2, texels, wrap, to_uv });
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.7)));
    let reflectance = Reflectance::Texture(texture);
    let printed =
        Material { bsdf: Bsdf::Diffuse { reflectance }, ..Material::diffuse("printed", DVec3::ONE) };
    let printed = d.add_material(printed);
    let metal = d.add_material(Material {
        bsdf: Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha: 0.3,
            stretch: 1.0,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance: Reflectance::Constant(DVec3::ONE),
        },
        ..Material::diffuse("metal", DVec3::ONE)
    });
    let corners = Mesh::cube().triangles().to_vec();
    let values = Mesh::cube().positions().iter().map(|p| p.normalize()).collect();
    let round = Normals::Given(Attribute { values, triangles: corners });
    d.add_shape("block", Mesh::cube().with_normals(round).unwrap(), white);
    let aside = DAffine3::from_translation(DVec3::new(-2.0, 0.3, 0.0));
    d.add_shape("page", Mesh::rectangle().transformed(&aside), printed);
    d.add_shape("ball", Mesh::cube().smooth().transformed(&aside.inverse()), metal);
    let above = DAffine3::from_translation(4.0 * DVec3::Y) * DAffine3::from_rotation_x(1.57);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&above), DVec3::splat(4.0));
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::splat(0.2) });
    let intensity = DVec3::ONE;
    d.lights.push(Light::Point { id: "bulb".to_owned(), position: DVec3::splat(5.0), intensity });
    Scene::new(d).unwrap()
}

const ALL: [&str; 14] = [
    "block.vertex_positions",
    "block.translation",
    "block.rotation",
    "block.scale",
    "ball.rotation",
    "lamp.radiance",
    "sky.radiance",
    "bulb.intensity",
    "white.reflectance",
    "metal.roughness",
    "printed.texture",
    "camera.translation",
    "camera.rotation",
    "camera.fov",
];

/// Numbers of no pattern, of the size `size`.
fn numbers(count: usize, seed: u64, size: f64) -> Vec<f64> {
    let mut rng = flatland::random::stream(seed, &[]);
    (0..count).map(|_| size * (flatland::random::open01(&mut rng) - 0.5)).collect()
}

/// A scene some way from where it was, and its parameters there.
fn moved() -> (Scene, Parameters, Vec<f64>) {
    let mut scene = scene();
    let parameters = Parameters::new(&scene, &ALL).unwrap();
    let mut x = parameters.values(&scene);
    parameters.retract(&mut x, &numbers(parameters.len(), 1, 0.2));
    parameters.apply(&x, &mut scene).unwrap();
    (scene, parameters, x)
}

#[test]
fn values_go_to_a_scene_and_come_back() {
    let mut scene = scene();
    let before = scene.description().clone();
    let parameters = Parameters::new(&scene, &ALL).unwrap();
    let x = parameters.values(&scene);
    parameters.apply(&x, &mut scene).unwrap();
    let near =
        |a: &Mesh, b: &Mesh| a.positions().iter().zip(b.positions()).all(|(a, b)| (*a - *b).length() < 1e-15);
    let after = scene.description();
    assert!(before.shapes.iter().zip(&after.shapes).all(|(a, b)| near(&a.mesh, &b.mesh)));
    assert_eq!((&before.materials, &before.lights), (&after.materials, &after.lights));
    assert_eq!((&before.textures, &before.environment), (&after.textures, &after.environment));
    let (moved, parameters, x) = moved();
    let again = Parameters::new(&moved, &["white.reflectance", "printed.texture", "camera.fov"]).unwrap();
    let of = |name: &str| {
        let group = parameters.groups().iter().find(|g| g.name == name).unwrap();
        x[group.range.clone()].to_vec()
    };
    let expected = ["white.reflectance", "printed.texture", "camera.fov"].map(of).concat();
    assert_eq!(again.values(&moved), expected);
}

#[test]
fn tangents_are_the_derivative_of_what_is_applied() {
    let (scene, parameters, x) = moved();
    let direction = numbers(x.len(), 2, 1.0);
    let tangent = parameters.tangent(&scene, &x, &direction);
    let at = |h: f64| {
        let (mut there, mut moved) = (x.clone(), self::scene());
        let step: Vec<f64> = direction.iter().map(|d| h * d).collect();
        parameters.retract(&mut there, &step);
        parameters.apply(&there, &mut moved).unwrap();
        moved
    };
    let (plus, minus) = (at(1e-5), at(-1e-5));
    let slope = |a: DVec3, b: DVec3| (a - b) / 2e-5;
    for i in 0..scene.positions.len() {
        let difference = slope(plus.positions[i], minus.positions[i]);
        assert!((difference - tangent.positions[i]).length() < 1e-8, "{i} {difference}");
    }
    for i in scene.normal_range(0) {
        assert!((slope(plus.normals[i], minus.normals[i]) - tangent.normals[i]).length() < 1e-8, "{i}");
    }
    let [p, m] = [&plus, &minus].map(|s| s.description().camera.clone());
    let camera = &scene.description().camera;
    assert!((slope(p.origin, m.origin) - tangent.camera.translation).length() < 1e-9);
    let turn = tangent.camera.rotation.cross(camera.forward);
    assert!((slope(p.forward, m.forward) - turn).length() < 1e-8);
}

#[test]
fn gradients_are_the_transpose_of_tangents() {
    let (scene, parameters, x) = moved();
    let direction = numbers(x.len(), 3, 1.0);
    let tangent = parameters.tangent(&scene, &x, &direction);
    // A covector of everything that may be active.
    let everything = numbers(1, 4, 1.0)[0];
    let mut covector = tangent.clone();
    for (i, p) in covector.positions.iter_mut().chain(&mut covector.normals).enumerate() {
        *p = DVec3::new((i as f64).sin(), (2.0 * i as f64).cos(), everything);
    }
    for i in scene.normal_range(2) {
        // Computed normals are no parameters: a gradient has nothing for them.
        covector.normals[i] = DVec3::ZERO;
    }
    covector.camera.rotation = DVec3::new(0.3, -0.2, 0.9);
    covector.texels[0].iter_mut().for_each(|t| *t = DVec3::new(1.0, 2.0, -0.5));
    let pulled = parameters.gradient(&scene, &x, &covector);
    let (forward, reverse) =
        (tangent.dot(&covector), pulled.iter().zip(&direction).map(|(a, b)| a * b).sum::<f64>());
    assert!((forward - reverse).abs() < 1e-12 * forward.abs().max(1.0), "{forward} {reverse}");
}

#[test]
fn turns_are_composed_about_the_moving_centre() {
    let mut scene = scene();
    let parameters = Parameters::new(&scene, &["block.translation", "block.rotation"]).unwrap();
    let mut x = parameters.values(&scene);
    parameters.retract(&mut x, &[1.0, 2.0, 3.0, 0.0, 0.0, 3.0]);
    parameters.retract(&mut x, &[0.0, 0.0, 0.0, 0.0, 0.7, 0.0]);
    parameters.apply(&x, &mut scene).unwrap();
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_z(3.0);
    for (p, q) in Mesh::cube().positions().iter().zip(scene.description().shapes[0].mesh.positions()) {
        assert!((turn * *p + DVec3::new(1.0, 2.0, 3.0) - *q).length() < 1e-14);
    }
}

#[test]
fn small_turns_add_up() {
    let scene = scene();
    let parameters = Parameters::new(&scene, &["block.rotation"]).unwrap();
    let mut x = parameters.values(&scene);
    for _ in 0..1000 {
        parameters.retract(&mut x, &[0.0, 1e-11, 0.0]);
    }
    assert!((x[1] - 1e-8).abs() < 1e-14, "{x:?}");
}

#[test]
fn a_camera_keeps_what_is_no_parameter() {
    let mut scene = scene();
    let parameters = Parameters::new(&scene, &["camera.fov"]).unwrap();
    let elsewhere = Camera::look_at(DVec3::new(3.0, 1.0, 2.0), DVec3::X, DVec3::Y, 0.5);
    scene.set_camera(elsewhere.clone()).unwrap();
    parameters.apply(&[0.9], &mut scene).unwrap();
    assert_eq!(scene.description().camera, Camera { field_of_view: 0.9, ..elsewhere });
}

#[test]
fn steps_stay_within_bounds() {
    let scene = scene();
    let names = ["white.reflectance", "metal.roughness", "lamp.radiance"];
    let parameters = Parameters::new(&scene, &names).unwrap().with_bounds(2, [1.0, 2.0]);
    let mut x = parameters.values(&scene);
    parameters.retract(&mut x, &[9.0, -9.0, 0.1, -9.0, 9.0, -9.0, 0.0]);
    assert_eq!(x, [1.0, 0.0, 0.1 + 0.7, 1e-3, 2.0, 1.0, 2.0]);
}

#[test]
fn names_of_nothing_are_refused_with_what_may_have_been_meant() {
    let scene = scene();
    let message = |names: &[&str]| Parameters::new(&scene, names).unwrap_err().to_string();
    let cases = [
        (
            &["blok.translation"][..],
            "`blok.translation`: there is no shape `blok`; closest first, there are: `block`",
        ),
        (&["block.rotatoin"], "the nearest form is SHAPE.rotation"),
        (&["camera.transation"], "the nearest form is camera.translation"),
        (&["translation"], "the nearest form is SHAPE.translation"),
        (&["white.roughness"], "has no roughness; materials with one: `metal`"),
        (&["printed.reflectance"], "has a texture, not one reflectance"),
        (&["block.radiance"], "emits nothing; shapes that emit: `lamp`"),
        (&["block.scale", "block.scale"], "is the same parameter as `block.scale`"),
    ];
    for (names, part) in cases {
        assert!(message(names).contains(part), "{}", message(names));
    }
}

#[test]
fn what_cannot_be_applied_is_refused() {
    let mut scene = scene();
    let parameters = Parameters::new(&scene, &["block.vertex_positions", "lamp.radiance"]).unwrap();
    let mut x = parameters.values(&scene);
    x[4] = f64::NAN;
    let error = parameters.apply(&x, &mut scene).unwrap_err();
    assert_eq!(error.to_string(), "shape `block`: position 1 is not finite");
    let pose = Parameters::new(&scene, &["block.translation"]).unwrap();
    assert!(pose.apply(&[f64::NAN, 0.0, 0.0], &mut scene).unwrap_err().to_string().contains("is not finite"));
    x = parameters.values(&scene);
    *x.last_mut().unwrap() = -1.0;
    assert!(parameters.apply(&x, &mut scene).unwrap_err().to_string().contains("radiance of `lamp` is -1"));
}

#[test]
fn adjoints_are_the_derivative_of_losses() {
    let image = |seed| {
        let pixels = numbers(45, seed, 1.0).chunks_exact(3).map(|c| DVec3::from_slice(c) + 0.6).collect();
        Image { width: 5, height: 3, pixels }
    };
    let (image, target) = (image(5), image(6));
    let losses = [
        Loss::L2,
        Loss::L1,
        Loss::Relative { epsilon: 0.1 },
        Loss::Multiscale { levels: 9 },
        Loss::Multiscale { levels: 1 },
    ];
    for loss in losses {
        let (value, adjoint) = loss.of(&image, &target).unwrap();
        assert!(value > 0.0);
        assert_eq!(loss.of(&target, &target).unwrap(), (0.0, Image::constant(5, 3, DVec3::ZERO)), "{loss:?}");
        for i in 0..15 {
            let at = |h: f64| {
                let mut moved = image.clone();
                moved.pixels[i].y += h;
                loss.of(&moved, &target).unwrap().0
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!(
                (difference - adjoint.pixels[i].y).abs() < 1e-9,
                "{loss:?} {i} {difference} {}",
                adjoint.pixels[i].y
            );
        }
    }
    let (l2, one) = (Loss::L2.of(&image, &target), Loss::Multiscale { levels: 1 }.of(&image, &target));
    assert!((l2.unwrap().0 - one.unwrap().0).abs() < 1e-15);
    let larger = Image::constant(5, 4, DVec3::ONE);
    assert!(matches!(Loss::L2.of(&larger, &target), Err(LossError::Size { .. })));
    let mut noisy = image.clone();
    noisy.pixels[0].x = f64::INFINITY;
    assert_eq!(Loss::L2.of(&noisy, &target), Err(LossError::NotFinite { what: "image", x: 0, y: 0 }));
    let nothing = Loss::Relative { epsilon: 0.0 }.of(&image, &target);
    assert_eq!(nothing, Err(LossError::Epsilon { epsilon: 0.0 }));
    let mut holed = target;
    holed.pixels[7].z = f64::NAN;
    assert_eq!(Loss::L2.of(&image, &holed), Err(LossError::NotFinite { what: "target", x: 2, y: 1 }));
}

#[test]
fn adam_takes_the_steps_of_its_definition() {
    let mut adam = Adam::new(0.1);
    // The first step is the rate, whatever the gradient: m̂ = g and v̂ = g².
    let first = adam.step(&[3.0, -1e-3]);
    assert!((first[0] + 0.1).abs() < 1e-9 && (first[1] - 0.1).abs() < 1e-5, "{first:?}");
    let second = adam.step(&[1.0, 0.0]);
    let (m, v) =
        ((0.9 * 0.1 * 3.0 + 0.1) / (1.0 - 0.81), (0.999 * 0.001 * 9.0 + 0.001) / (1.0 - 0.999_f64.powi(2)));
    assert!((second[0] + 0.1 * m / v.sqrt()).abs() < 1e-9);
    // With one v, small gradients make small steps.
    let step = Adam::new(0.1).uniform().step(&[3.0, -1e-3]);
    assert!((step[1] / step[0] + 1e-3 / 3.0).abs() < 1e-12);
    // A quadratic valley of two widths.
    let (mut x, mut adam) = ([4.0, -3.0], Adam::new(0.1));
    for t in 0..2000 {
        adam.rate = 0.1 * (1.0 - f64::from(t) / 2000.0);
        let step = adam.step(&[100.0 * x[0], 0.1 * (x[1] - 1.0)]);
        x.iter_mut().zip(step).for_each(|(x, s)| *x += s);
    }
    assert!(x[0].abs() < 1e-3 && (x[1] - 1.0).abs() < 1e-3, "{x:?}");
}
