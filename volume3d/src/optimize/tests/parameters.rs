//! Parameters by name: values, derivatives and errors.

use glam::{DMat3, DQuat, DVec3};

use super::{numbers, scene};
use crate::geometry::Mesh;
use crate::gradient::Tangent;
use crate::optimize::{ParameterError, Parameters};
use crate::scene::{Camera, Description, Environment, Light, Scene, SceneError};

/// The scene under an environment map.
fn under_a_map() -> Scene {
    let mut d = scene().description().clone();
    let to_world = DMat3::from_rotation_y(0.4);
    d.environment = Some(Environment::Map { id: "sky".to_owned(), texture: 0, scale: 1.0, to_world });
    Scene::new(d).unwrap()
}

const ALL: [&str; 19] = [
    "block.vertex_positions",
    "block.translation",
    "block.rotation",
    "block.scale",
    "ball.rotation",
    "lamp.radiance",
    "sky.radiance",
    "bulb.intensity",
    "bulb.translation",
    "beam.translation",
    "beam.rotation",
    "beam.texture",
    "sun.rotation",
    "white.reflectance",
    "metal.roughness",
    "printed.texture",
    "camera.translation",
    "camera.rotation",
    "camera.fov",
];

/// Collections that move together, and single components.
const OTHERS: [&[&str]; 5] = [
    &["all.translation", "all.rotation", "all.scale", "sky.rotation", "beam.rotation"],
    &["lights.translation", "lights.rotation"],
    &["pair.translation", "pair.rotation", "pair.scale", "sky.texture", "page.rotation.z"],
    &[
        "block.translation.x",
        "block.rotation.y",
        "block.vertex_positions.z",
        "sky.rotation.x",
        "camera.rotation.y",
    ],
    &["lamp.radiance.r", "lamp.radiance.b", "printed.texture.g", "bulb.translation.z", "sun.rotation.x"],
];

/// All of these lists with scenes that have them.
fn lists() -> Vec<(Scene, Vec<&'static str>)> {
    let others = OTHERS.iter().map(|names| (under_a_map(), names.to_vec()));
    std::iter::once((scene(), ALL.to_vec())).chain(others).collect()
}

#[test]
fn all_names_are_listed() {
    let mut d = scene().description().clone();
    // Names that the camera and a collection have, too.
    d.add_shape("camera", Mesh::cube(), 0);
    d.add_shape("lights", Mesh::cube(), 0);
    let ball = flatland::sdf::shapes::Ball::new(DVec3::splat(9.0), 0.5).unwrap();
    d.add_implicit("drop", ball, 0);
    let scene = Scene::new(d).unwrap();
    let names = Parameters::names(&scene);
    let expected = "all.rotation all.translation ball.rotation ball.scale ball.translation ball.vertex_positions \
        beam.intensity beam.rotation beam.texture beam.translation block.rotation block.scale block.translation \
        block.vertex_positions bulb.intensity bulb.translation camera.fov camera.rotation camera.translation \
        chalk.reflectance drop.rotation drop.sdf drop.translation lamp.radiance lamp.reflectance lamp.rotation lamp.scale \
        lamp.translation lamp.vertex_positions lights.rotation lights.scale lights.translation lights.vertex_positions \
        metal.reflectance metal.roughness page.rotation page.scale page.translation page.vertex_positions \
        pair.rotation pair.scale pair.translation printed.texture sky.radiance sun.irradiance sun.rotation \
        white.reflectance";
    assert_eq!(names, expected.split_whitespace().collect::<Vec<_>>());
    for name in &names {
        Parameters::new(&scene, &[name]).unwrap();
    }
    let map = Parameters::names(&under_a_map());
    assert!(
        ["sky.rotation", "sky.texture", "lights.rotation"].iter().all(|n| map.contains(&(*n).to_owned()))
    );
}

/// A scene moved some way from rest, and its parameters there.
fn moved(mut scene: Scene, names: &[&str]) -> (Scene, Parameters, Vec<f64>) {
    let parameters = Parameters::new(&scene, names).unwrap();
    let mut x = parameters.values(&scene);
    parameters.retract(&mut x, &numbers(parameters.len(), 1, 0.2));
    parameters.apply(&x, &mut scene).unwrap();
    (scene, parameters, x)
}

#[test]
fn values_go_to_a_scene_and_come_back() {
    for (mut scene, names) in lists() {
        let before = scene.description().clone();
        let parameters = Parameters::new(&scene, &names).unwrap();
        let x = parameters.values(&scene);
        parameters.apply(&x, &mut scene).unwrap();
        let near = |a: &Mesh, b: &Mesh| {
            a.positions().iter().zip(b.positions()).all(|(a, b)| (*a - *b).length() < 1e-14)
        };
        let after = scene.description();
        assert!(before.shapes.iter().zip(&after.shapes).all(|(a, b)| near(&a.mesh, &b.mesh)));
        assert_eq!((&before.materials, &before.textures), (&after.materials, &after.textures));
        assert_eq!(before.environment, after.environment);
        let place = |l: &Light| l.position().unwrap_or(DVec3::ZERO);
        assert!(before.lights.iter().zip(&after.lights).all(|(a, b)| (place(a) - place(b)).length() < 1e-14));
    }
    let (moved, parameters, x) = moved(scene(), &ALL);
    let again = Parameters::new(&moved, &["white.reflectance", "printed.texture", "camera.fov"]).unwrap();
    let of = |name: &str| {
        let group = parameters.groups().iter().find(|g| g.name == name).unwrap();
        x[group.range.clone()].to_vec()
    };
    let expected = ["white.reflectance", "printed.texture", "camera.fov"].map(of).concat();
    assert_eq!(again.values(&moved), expected);
}

/// Rates of all quantities that may move: by the tangent and by differences.
fn rates(
    scene: &Scene,
    tangent: &Tangent,
    [plus, minus]: [&Scene; 2],
    step: f64,
) -> Vec<(String, DVec3, DVec3)> {
    let slope = |a: DVec3, b: DVec3| (a - b) / (2.0 * step);
    let mut found = vec![];
    for i in 0..scene.positions.len() {
        found.push((
            format!("position {i}"),
            tangent.positions[i],
            slope(plus.positions[i], minus.positions[i]),
        ));
    }
    for i in scene.normal_range(0) {
        found.push((format!("normal {i}"), tangent.normals[i], slope(plus.normals[i], minus.normals[i])));
    }
    let [now, p, m] = [scene, plus, minus].map(Scene::description);
    for (l, light) in now.lights.iter().enumerate() {
        // The offset of a scene may move with its contents.
        let frame = |light: &Light| match light {
            Light::Point { position, .. } => (*position, DVec3::ZERO),
            Light::Spot { position, to_world, .. } | Light::Projector { position, to_world, .. } => {
                (*position, *to_world * DVec3::new(0.3, 0.5, 0.9))
            }
            Light::Directional { direction, .. } => (DVec3::ZERO, *direction),
        };
        let [(_, now), (at, to), (from, before)] = [light, &p.lights[l], &m.lights[l]].map(frame);
        let is_parallel = light.position().is_none();
        let turn = if is_parallel { tangent.pose[l] } else { tangent.light_rotation[l] };
        found.push((format!("direction of light {l}"), turn.cross(now), slope(to, before)));
        let shift = if is_parallel { DVec3::ZERO } else { tangent.pose[l] };
        found.push((format!("light {l}"), shift, slope(at, from)));
        found.push((
            format!("power {l}"),
            tangent.intensity[l],
            slope(p.lights[l].power(), m.lights[l].power()),
        ));
    }
    let radiance = |d: &Description, s: usize| d.shapes[s].radiance.unwrap_or(DVec3::ZERO);
    for s in 0..now.shapes.len() {
        found.push((format!("radiance {s}"), tangent.radiance[s], slope(radiance(p, s), radiance(m, s))));
    }
    for (t, texture) in now.textures.iter().enumerate() {
        for i in 0..texture.texels.len() {
            let difference = slope(p.textures[t].texels[i], m.textures[t].texels[i]);
            found.push((format!("texel {i} of {t}"), tangent.texels[t][i], difference));
        }
    }
    let map = |d: &Description| match &d.environment {
        Some(Environment::Map { to_world, .. }) => *to_world * DVec3::new(0.3, 0.5, 0.9),
        _ => DVec3::ZERO,
    };
    found.push(("map".to_owned(), tangent.environment_rotation.cross(map(now)), slope(map(p), map(m))));
    found.push(("camera".to_owned(), tangent.camera.translation, slope(p.camera.origin, m.camera.origin)));
    let turn = tangent.camera.rotation.cross(now.camera.forward);
    found.push(("camera's turn".to_owned(), turn, slope(p.camera.forward, m.camera.forward)));
    found
}

#[test]
fn tangents_are_the_derivative_of_what_is_applied() {
    for (rest, names) in lists() {
        let description = rest.description().clone();
        let (scene, parameters, x) = moved(rest, &names);
        let direction = numbers(x.len(), 2, 1.0);
        let tangent = parameters.tangent(&scene, &x, &direction);
        assert_ne!(tangent, Tangent::still(&scene));
        let at = |h: f64| {
            let (mut there, mut moved) = (x.clone(), Scene::new(description.clone()).unwrap());
            let step: Vec<f64> = direction.iter().map(|d| h * d).collect();
            parameters.retract(&mut there, &step);
            parameters.apply(&there, &mut moved).unwrap();
            moved
        };
        for (what, rate, difference) in rates(&scene, &tangent, [&at(1e-5), &at(-1e-5)], 1e-5) {
            assert!((rate - difference).length() < 2e-8, "{names:?}: {what}: {rate} {difference}");
        }
    }
}

#[test]
fn gradients_are_the_transpose_of_tangents() {
    for (rest, names) in lists() {
        let (scene, parameters, x) = moved(rest, &names);
        let direction = numbers(x.len(), 3, 1.0);
        let tangent = parameters.tangent(&scene, &x, &direction);
        // A covector of all quantities that may be active.
        let everything = numbers(1, 4, 1.0)[0];
        let mut covector = tangent.clone();
        let Tangent { positions, normals, pose, light_rotation, intensity, radiance, .. } = &mut covector;
        let lists = [positions, normals, pose, light_rotation, intensity, radiance];
        for (i, p) in lists.into_iter().flatten().enumerate() {
            *p = DVec3::new((i as f64).sin(), (2.0 * i as f64).cos(), everything);
        }
        for i in scene.normal_range(2) {
            // Computed normals are not parameters: a gradient has no entry for them.
            covector.normals[i] = DVec3::ZERO;
        }
        covector.camera.rotation = DVec3::new(0.3, -0.2, 0.9);
        covector.environment_rotation = DVec3::new(-0.3, 0.5, 0.4);
        covector.texels.iter_mut().flatten().for_each(|t| *t = DVec3::new(1.0, 2.0, -0.5));
        let pulled = parameters.gradient(&scene, &x, &covector);
        let (forward, reverse) =
            (tangent.dot(&covector), pulled.iter().zip(&direction).map(|(a, b)| a * b).sum::<f64>());
        assert!((forward - reverse).abs() < 1e-12 * forward.abs().max(1.0), "{names:?}: {forward} {reverse}");
        // The parameters that a sweep reports are all that the gradient needs.
        let active = parameters.active(&scene);
        let is_asked = |l: usize| tangent.pose[l] == DVec3::ZERO || active.poses[l];
        assert!((0..tangent.pose.len()).all(is_asked), "{names:?}");
        assert!(tangent.environment_rotation == DVec3::ZERO || active.environment_rotation, "{names:?}");
    }
}

/// Tied parameters share their values, and the derivative by these is the sum of theirs.
#[test]
fn ties_add_up() {
    let mut scene = scene();
    let tie = |names: &[&[&str]]| Parameters::tied(&super::scene(), names);
    let names = [&["lamp.radiance", "bulb.intensity"][..], &["block.translation.x", "bulb.translation.y"]];
    let parameters = Parameters::tied(&scene, &names).unwrap();
    let mut x = parameters.values(&scene);
    assert_eq!(x, [4.0, 4.0, 4.0, 0.0]);
    parameters.retract(&mut x, &[1.0, 2.0, 3.0, 0.5]);
    parameters.apply(&x, &mut scene).unwrap();
    let d = scene.description();
    let shared = DVec3::new(5.0, 6.0, 7.0);
    assert_eq!((d.shapes[3].radiance, d.lights[0].power()), (Some(shared), shared));
    assert_eq!(d.lights[0].position(), Some(DVec3::new(5.0, 5.5, 5.0)));
    let mut covector = Tangent::still(&scene);
    covector.radiance[3] = DVec3::new(1.0, 2.0, 3.0);
    covector.intensity[0] = DVec3::new(10.0, 20.0, 30.0);
    covector.pose[0] = DVec3::new(5.0, 7.0, 9.0);
    covector.positions_of_mut(&scene, 0)[0] = DVec3::new(0.25, 9.0, 9.0);
    assert_eq!(parameters.gradient(&scene, &x, &covector), [11.0, 22.0, 33.0, 7.25]);
    let direction = [1.0, 2.0, 3.0, 4.0];
    let tangent = parameters.tangent(&scene, &x, &direction);
    let product: f64 = direction.iter().zip([11.0, 22.0, 33.0, 7.25]).map(|(a, b)| a * b).sum();
    assert!((tangent.dot(&covector) - product).abs() < 1e-12);
    let message = |names: &[&str]| tie(&[names]).unwrap_err().to_string();
    for (names, words) in [
        (["lamp.radiance", "metal.roughness"], "they are 1 and 3 numbers"),
        (["lamp.radiance", "white.reflectance"], "one is from 0 to 1, the other from 0 to inf"),
        (["block.translation", "block.rotation"], "only one of them is a rotation"),
        (["lamp.radiance", "lamp.radiance"], "is given twice"),
    ] {
        assert!(message(&names).contains(words), "{}", message(&names));
    }
    assert_eq!(tie(&[&["lamp.radiance"], &[]]).unwrap_err(), ParameterError::Empty { index: 1 });
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

/// Rotation about a user-defined pivot, with the translation fitted beside it.
#[test]
fn pivots_stay_where_they_are_put() {
    let mut scene = scene();
    let before = scene.description().clone();
    let pivot = DVec3::new(1.0, -2.0, 0.5);
    let names = ["all.translation", "all.rotation", "all.scale"];
    let parameters = Parameters::new(&scene, &names).unwrap().with_pivot(1, pivot);
    let shift = DVec3::new(0.1, 0.2, 0.3);
    let x = [0.1, 0.2, 0.3, 0.0, 0.7, 0.0, 2.0];
    parameters.apply(&x, &mut scene).unwrap();
    for (old, new) in before.shapes.iter().zip(&scene.description().shapes) {
        for (p, q) in old.mesh.positions().iter().zip(new.mesh.positions()) {
            let expected = pivot + shift + 2.0 * (DQuat::from_rotation_y(0.7) * (*p - pivot));
            assert!((expected - *q).length() < 1e-13, "{p} {q} {expected}");
        }
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
            "`blok.translation`: nothing is called `blok`; did you mean `block`, a shape that emits nothing?; closest \
             first, objects with a parameter `translation`: `block`",
        ),
        (&["block.rotatoin"], "did you mean `block.rotation`?"),
        (&["block.position"], "did you mean `block.translation`?"),
        (&["block.Color"], "did you mean `block.reflectance`?"),
        (&["block.pose"], "a pose is two parameters, `block.translation` and `block.rotation`"),
        (&["block"], "an object, a dot and a kind, such as `block.translation`"),
        (&["camera.transation"], "did you mean `camera.translation`?"),
        (&["translation"], "the nearest form is SHAPE.translation"),
        (&["block.translation.w"], "`w` is not a component: vectors have x, y and z"),
        (
            &["white.roughness"],
            "`white` is a material (diffuse), whose parameters are `white.reflectance`; closest first, objects with a parameter \
             `roughness`: `metal`",
        ),
        (&["printed.reflectance"], "whose parameters are `printed.texture`"),
        (
            &["block.radiance"],
            "`block` is a shape that emits nothing, whose parameters are `block.vertex_positions`",
        ),
        (&["block.reflectance"], "what belongs to it has `white.reflectance`"),
        (
            &["bulb.radiance"],
            "is a point light, whose parameters are `bulb.intensity`, `bulb.translation`; closest",
        ),
        (&["bulb.rotation"], "is a point light"),
        (&["lamp.intensity"], "is a shape that emits, whose parameters are"),
        (
            &["sun.translation"],
            "is a directional light, whose parameters are `sun.irradiance`, `sun.rotation`",
        ),
        (&["slide.texture"], "is a texture without parameters; what belongs to it has `beam.texture`"),
        (&["pair.radiance"], "is an instance or a group of shapes, whose parameters are `pair.translation`"),
        (&["camera.vertex_positions"], "`camera.vertex_positions` names no parameter; forms are: "),
        (&["block.scale", "block.scale"], "`block.scale` is given twice"),
        (&["white.reflectance", "chalk.reflectance"], "is the same parameter as `white.reflectance`"),
        (&["lamp.radiance.r", "lamp.radiance"], "is the same parameter as `lamp.radiance.r`"),
        (&["lamp.radiance.x"], "has the components r, g and b"),
        (&["block.scale.x"], "`block.scale` has no components"),
        (&["block.rotation.x", "block.rotation.y"], "are of one rotation, whose components do not add up"),
        (&["all.translation", "block.rotation"], "both move `block`"),
        (&["lights.rotation", "sun.rotation"], "both move `sun`"),
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
    assert!(error.to_string().starts_with("number 4 of `block.vertex_positions` is NaN"), "{error}");
    let pose = Parameters::new(&scene, &["block.translation"]).unwrap();
    assert!(
        pose.apply(&[f64::NAN, 0.0, 0.0], &mut scene).unwrap_err().to_string().contains("must be finite")
    );
    x = parameters.values(&scene);
    *x.last_mut().unwrap() = -1.0;
    assert!(
        parameters
            .apply(&x, &mut scene)
            .unwrap_err()
            .to_string()
            .contains("number 2 of `lamp.radiance` is -1")
    );
}

/// A refused vector changes nothing, wherever it is wrong.
#[test]
fn applying_is_atomic() {
    let mut d = scene().description().clone();
    let ball = flatland::sdf::shapes::Ball::new(DVec3::new(0.0, 0.0, -9.0), 0.5).unwrap();
    d.add_implicit("drop", ball, 0);
    let mut scene = Scene::new(d).unwrap();
    let names = [&ALL[..], &["drop.translation", "ball.scale"]].concat();
    let parameters = Parameters::new(&scene, &names).unwrap();
    let mut x = parameters.values(&scene);
    parameters.retract(&mut x, &numbers(parameters.len(), 1, 0.2));
    let before = scene.description().clone();
    let at = |name: &str| parameters.groups().iter().find(|g| g.name == name).unwrap().range.clone();
    let camera = scene.description().camera.origin + DVec3::from_slice(&x[at("camera.translation")]);
    for (name, values, words) in [
        ("ball.scale", vec![0.0], "number 0 of `ball.scale` is 0, but must be finite and from 0.001 to inf"),
        ("white.reflectance", vec![0.5, 2.0, 0.5], "number 1 of `white.reflectance` is 2,"),
        ("block.scale", vec![f64::MAX], "not finite"),
        ("drop.translation", (camera + 9.0 * DVec3::Z).to_array().to_vec(), "the camera is inside"),
    ] {
        let mut bad = x.clone();
        bad[at(name)].copy_from_slice(&values);
        let error = parameters.apply(&bad, &mut scene).unwrap_err().to_string();
        assert!(error.contains(words), "{name}: {error}");
        assert_eq!(*scene.description(), before, "{name}");
    }
    let error = parameters.apply(&x[1..], &mut scene).unwrap_err();
    assert_eq!(error, SceneError::Parameters { found: x.len() - 1, expected: x.len() });
    let mut other = scene.description().clone();
    other.shapes[0].mesh = Mesh::rectangle();
    let error = parameters.apply(&x, &mut Scene::new(other).unwrap()).unwrap_err();
    assert_eq!(error, SceneError::OtherScene { name: "block.vertex_positions".to_owned() });
    let fresh =
        crate::gradient::render(&Scene::new(before).unwrap(), 2, 0, &crate::gradient::Progress::none());
    let again = crate::gradient::render(&scene, 2, 0, &crate::gradient::Progress::none());
    assert_eq!(fresh.unwrap().image, again.unwrap().image);
}
