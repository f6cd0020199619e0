//! Lights that move and textures that change, where no shadow does.

use flatland::random::{open01, stream};
use glam::{DAffine2, DMat3};

use super::*;
use crate::gradient::hard_shadows::casts_shadows;
use crate::scene::{Bsdf, Light, Microfacets, Principled, Reflectance, Texture, Value, Wrap};

/// Texels from `low` to `high`, of no pattern, with a border of 0 if it is to be.
fn texture(id: &str, seed: u64, [low, high]: [f64; 2], has_border: bool) -> Texture {
    let mut rng = stream(seed, &[]);
    let (width, height) = (5, 4);
    let texel = |i: usize| {
        let is_outer = [0, width - 1].contains(&(i % width)) || i < width || i >= width * (height - 1);
        let value = DVec3::from_array(std::array::from_fn(|_| low + (high - low) * open01(&mut rng)));
        if is_outer && has_border { DVec3::ZERO } else { value }
    };
    let texels = (0..width * height).map(texel).collect();
    Texture { id: id.to_owned(), width, height, texels, wrap: Wrap::Clamp, to_uv: DAffine2::IDENTITY }
}

/// A floor that fills the film, and nothing else.
fn floor(bsdf: Bsdf) -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 1.5, 1.0), DVec3::ZERO, DVec3::Y, 0.4);
    let mut d = Description::new(camera, film(4, Filter::Box));
    d.integrator.max_depth = Some(2);
    let paint = d.add_material(Material::new("paint", bsdf, true));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 1.0) * down())), paint);
    d
}

fn grey() -> Bsdf {
    Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::new(0.6, 0.5, 0.4)) }
}

fn metal(alpha: f64) -> Bsdf {
    Bsdf::RoughConductor {
        distribution: Microfacets::Ggx,
        alpha,
        stretch: 1.0,
        eta: DVec3::new(0.2, 0.9, 1.1),
        k: DVec3::new(3.9, 2.4, 2.2),
        specular_reflectance: Reflectance::Constant(DVec3::splat(0.9)),
    }
}

fn principled(roughness: Value, metallic: Value) -> Bsdf {
    let zero = Value::Constant(0.0);
    Bsdf::Principled(Principled {
        base_color: Reflectance::Constant(DVec3::new(0.7, 0.5, 0.3)),
        roughness,
        anisotropic: zero,
        metallic,
        eta: 1.5,
        spec_tint: zero,
        spec_trans: zero,
        sheen: zero,
        sheen_tint: zero,
        flatness: zero,
        clearcoat: zero,
        clearcoat_gloss: zero,
    })
}

/// A name, a scene and what changes in it.
type Case = (&'static str, Description, fn(&mut Tangent));

/// Lights above the floor: a lit floor for each, with a name, and the change of it.
fn lights() -> Vec<Case> {
    let intensity = DVec3::new(2.0, 3.0, 1.0);
    let above = DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(1.4);
    let position = DVec3::new(0.1, 1.2, -0.1);
    let with = |light: Light, texture: Option<Texture>| {
        let mut d = floor(grey());
        d.lights.push(light);
        d.textures.extend(texture);
        d
    };
    let id = || "lamp".to_owned();
    let point = Light::Point { id: id(), position, intensity };
    let spot = Light::Spot {
        id: id(),
        position,
        to_world: above,
        intensity,
        cutoff: 0.5,
        beam: 0.2,
        texture: Some(0),
    };
    let (field_of_view, aspect) = (0.6, 1.3);
    let slide = Some(0);
    let projector = Light::Projector {
        id: id(),
        position,
        to_world: above,
        intensity,
        field_of_view,
        aspect,
        texture: slide,
    };
    // Its rim is beyond the floor. As it turns, its falloff changes alone.
    let clear = Light::Projector {
        id: id(),
        position,
        to_world: above,
        intensity,
        field_of_view: 2.4,
        aspect,
        texture: None,
    };
    let direction = DVec3::new(0.4, -0.8, 0.3).normalize();
    let sun = |kappa| Light::Directional { id: id(), direction, irradiance: intensity, kappa };
    let moves: fn(&mut Tangent) = |c| c.pose[0] = DVec3::new(-0.6, 1.0, 0.8);
    let turns: fn(&mut Tangent) = |c| c.light_rotation[0] = DVec3::new(0.6, 0.5, 0.3);
    let fades: fn(&mut Tangent) = |c| {
        c.texels[0].iter_mut().enumerate().for_each(|(i, t)| *t = DVec3::splat(1.0 + (i % 3) as f64));
    };
    let beam = texture("slide", 3, [0.5, 1.0], false);
    let bordered = texture("slide", 4, [0.5, 1.0], true);
    let painted = |bsdf: Bsdf, range: [f64; 2]| {
        let mut d = floor(bsdf);
        d.textures.push(texture("paint", 5, range, false));
        d.lights.push(sun(20.0));
        d
    };
    let mut conductor = painted(metal(1.0), [0.3, 0.7]);
    conductor.materials[0].roughness_textures = [Some(0); 2];
    let mut lamp = floor(grey());
    lamp.textures.push(texture("panel", 6, [0.5, 1.0], false));
    let panel = Mesh::rectangle().transformed(&(at(0.1, 1.3, -0.1, 0.3) * up()));
    lamp.add_emitter("panel", panel, intensity);
    lamp.shapes[1].radiance_texture = Some(0);
    // A map that is black in half of its texels, and something that hides parts of it.
    let mut map = floor(metal(0.4));
    let mut sky = texture("sky", 7, [0.2, 1.5], false);
    sky.texels.iter_mut().step_by(2).for_each(|texel| *texel = DVec3::ZERO);
    map.textures.push(sky);
    map.add_shape("lid", Mesh::rectangle().transformed(&(at(0.4, 0.3, 0.0, 0.3) * down())), 0);
    let (id, to_world) = ("sky".to_owned(), DMat3::from_rotation_y(0.4));
    map.environment = Some(Environment::Map { id, texture: 0, scale: 1.3, to_world });
    vec![
        ("a point moves", with(point, None), moves),
        ("a spot moves", with(spot.clone(), Some(beam.clone())), moves),
        ("a spot turns", with(spot.clone(), Some(beam.clone())), turns),
        ("texels of a spot", with(spot, Some(beam)), fades),
        ("a projector moves", with(projector.clone(), Some(bordered.clone())), moves),
        ("a projector turns", with(projector.clone(), Some(bordered.clone())), turns),
        ("a projector without a slide turns", with(clear, None), turns),
        ("texels of a slide", with(projector, Some(bordered)), fades),
        ("parallel light turns", with(sun(f64::INFINITY), None), moves),
        ("a lobe of light turns", with(sun(20.0), None), moves),
        ("texels of a roughness", conductor, fades),
        (
            "texels of a principled roughness",
            painted(principled(Value::Texture(0), Value::Constant(0.5)), [0.4, 0.7]),
            fades,
        ),
        ("texels of metal", painted(principled(Value::Constant(0.6), Value::Texture(0)), [0.2, 0.8]), fades),
        ("texels of a panel", lamp, fades),
        ("texels of a map", map.clone(), fades),
        ("a map turns", map, |c| c.environment_rotation = DVec3::new(0.5, 1.0, 0.3)),
    ]
}

/// Against differences, whose densities follow lights and texels where the gradient's are held; and forward
/// against reverse.
#[test]
fn lights_move_and_textures_change() {
    let mut comparisons = Comparisons::of("lights_move_and_textures_change");
    let none = Progress::none();
    for (name, description, change_of) in lights() {
        let scene = Scene::new(description).unwrap();
        let mut change = Tangent::still(&scene);
        change_of(&mut change);
        // Mixtures of metal are linear but for what samples choose, and the map in each of its texels.
        let step = if ["texels of metal", "a map turns"].contains(&name) { 1e-2 } else { 2e-3 };
        let difference = |samples: usize, seed: u64| {
            let method = FiniteDifference { samples, step, seed };
            method.forward(&scene, &change, &none).unwrap().gradient.pixels
        };
        // By a rough estimate, so that parts of opposite sign do not cancel.
        let rough = difference(512, 1000);
        let size = (rough.iter().map(|p| p.length_squared()).sum::<f64>() / rough.len() as f64).sqrt();
        let weighted = |pixels: Vec<DVec3>| -> Vec<DVec3> {
            pixels
                .iter()
                .zip(&rough)
                .map(|(g, w)| *g * (*w / size).clamp(DVec3::NEG_ONE, DVec3::ONE))
                .collect()
        };
        // Lobes and mixtures are sampled where they are brightest, not where they change.
        let samples = match name {
            "a map turns" => 1024,
            _ if ["lobe", "metal", "principled", "map"].iter().any(|part| name.contains(part)) => 256,
            _ => 48,
        };
        let found = total(|seed| {
            let method = WarpedArea { samples, seed, ..WarpedArea::default() };
            weighted(method.forward(&scene, &change, &none).unwrap().gradient.pixels)
        });
        let differences = total(|seed| weighted(difference(2 * samples, seed)));
        // Differences are off by the square of their step.
        comparisons.add(name.to_owned(), found, differences, 1e-3 * differences.0.abs(), differences.0);
        let method = WarpedArea { samples: 4, ..WarpedArea::default() };
        let adjoint = random_adjoint(scene.size());
        let image = method.forward(&scene, &change, &none).unwrap().gradient;
        let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
        let mut active = ActiveParameters::nothing(&scene);
        active.poses.fill(true);
        (active.lights, active.environment_rotation) = (true, true);
        active.materials.fill(true);
        let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
        assert!((forward - reverse).abs() < 1e-9 * forward.abs(), "{name}: {forward} {reverse}");
    }
    comparisons.finish();
}

#[test]
fn beams_that_end_abruptly_are_refused() {
    let (id, position, intensity) = ("lamp".to_owned(), DVec3::new(0.0, 3.0, 0.0), DVec3::ONE);
    let to_world = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let projector = |field_of_view: f64, texture: Option<usize>| {
        let (id, aspect) = (id.clone(), 1.0);
        Light::Projector { id, position, to_world, intensity, field_of_view, aspect, texture }
    };
    let spot = |cutoff: f64, beam: f64| Light::Spot {
        id: id.clone(),
        position,
        to_world,
        intensity,
        cutoff,
        beam,
        texture: None,
    };
    let cases = [
        ("a clear slide on a floor", projector(0.4, None), true),
        ("a clear slide beyond it", projector(1.2, None), false),
        ("a slide with a dark border", projector(0.4, Some(0)), false),
        ("a slide without one", projector(0.4, Some(1)), true),
        ("a cone with a margin", spot(0.2, 0.1), false),
        ("a cone without", spot(0.2, 0.2), true),
        ("a cone beyond the floor", spot(0.6, 0.6), false),
    ];
    for (name, light, expected) in cases {
        let mut d = floor(grey());
        d.textures = vec![texture("dark", 4, [0.5, 1.0], true), texture("light", 4, [0.5, 1.0], false)];
        d.lights.push(light);
        let scene = Scene::new(d).unwrap();
        for rates in
            [|c: &mut Tangent| c.pose[0] = DVec3::X, |c: &mut Tangent| c.light_rotation[0] = DVec3::X]
        {
            let mut change = Tangent::still(&scene);
            rates(&mut change);
            let method = WarpedArea { samples: 1, ..WarpedArea::default() };
            let found = method.forward(&scene, &change, &Progress::none()).err();
            let beam = Unsupported::Beam { light: "lamp".to_owned() };
            let refused = expected.then_some(GradientError::Unsupported(beam));
            assert_eq!(found, refused, "{name}");
        }
    }
}

fn bulb(position: DVec3) -> Light {
    Light::Point { id: "bulb".to_owned(), position, intensity: DVec3::ONE }
}

fn sun(direction: DVec3) -> Light {
    let (id, direction) = ("sun".to_owned(), direction.normalize());
    Light::Directional { id, direction, irradiance: DVec3::ONE, kappa: f64::INFINITY }
}

/// Many squares side by side.
fn tiles() -> Mesh {
    let n = 6_u32;
    let place = |k: u32| DVec3::new(f64::from(k % n) / 7.0 - 0.3, 0.0, f64::from(k / n) / 3.0);
    let square = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
    let corners = (0..n * (n - 1)).filter(|k| k % n + 1 < n).flat_map(square).collect();
    Mesh::new((0..n * n).map(place).collect(), corners).unwrap()
}

#[test]
fn shadows_are_found_where_there_are_any() {
    let floor = || Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 2.0) * down()));
    let block = |height: f64| Mesh::cube().transformed(&at(0.1, height, 0.2, 0.3));
    let wall = |turn: DAffine3| Mesh::rectangle().transformed(&(turn * at(0.0, 0.0, -1.0, 1.0)));
    let quarter = std::f64::consts::FRAC_PI_2;
    let room: Vec<Mesh> = (0..4)
        .map(|k| wall(DAffine3::from_rotation_y(quarter * f64::from(k))))
        .chain([-1.0, 1.0].map(|sign| wall(DAffine3::from_rotation_x(sign * quarter))))
        .collect();
    let (high, slanted) = (bulb(DVec3::new(0.57, 3.0, 0.23)), sun(DVec3::new(0.3, -1.0, 0.2)));
    let beside = bulb(DVec3::new(-3.0, 1.5, 0.23));
    let inside = bulb(DVec3::new(0.2, 0.3, -0.1));
    let cases: Vec<(&str, Vec<Mesh>, &Light, bool)> = vec![
        ("a floor", vec![floor()], &high, false),
        ("a floor in the sun", vec![floor()], &slanted, false),
        ("tiles", vec![tiles()], &high, false),
        ("tiles in the sun", vec![tiles()], &slanted, false),
        ("a block", vec![block(1.0)], &high, false),
        ("a block in the sun", vec![block(1.0)], &slanted, false),
        ("a round block", vec![block(1.0).smooth()], &high, true),
        ("a block above a floor", vec![floor(), block(1.0)], &high, true),
        ("a block above a floor in the sun", vec![floor(), block(1.0)], &slanted, true),
        ("a block on a floor", vec![floor(), block(0.3)], &high, true),
        ("a block in the dark below a floor", vec![block(-1.0), floor()], &high, false),
        ("a room", room.clone(), &inside, false),
        (
            "a furnished room",
            [room, vec![Mesh::cube().transformed(&at(0.0, -0.8, 0.5, 0.2))]].concat(),
            &inside,
            true,
        ),
        (
            "a block beside a block",
            vec![block(1.0), Mesh::cube().transformed(&at(1.1, 1.0, 0.2, 0.3))],
            &beside,
            true,
        ),
        (
            "blocks side by side below the light",
            vec![block(1.0), Mesh::cube().transformed(&at(-2.0, 1.0, 0.2, 0.3))],
            &high,
            false,
        ),
    ];
    for (name, meshes, light, expected) in cases {
        let scene = of_meshes(meshes, light);
        assert_eq!(casts_shadows(&scene, &scene.lights()[0]), expected, "{name}");
        let mut change = Tangent::still(&scene);
        change.pose[0] = DVec3::X;
        let edges = EdgeSampling { samples: 1, primary: 1, secondary: 1, ..EdgeSampling::default() };
        assert_eq!(edges.forward(&scene, &change, &Progress::none()).is_err(), expected, "{name}");
        let warped = WarpedArea { samples: 1, ..WarpedArea::default() };
        assert!(warped.forward(&scene, &change, &Progress::none()).is_ok(), "{name}");
    }
}

fn of_meshes(meshes: Vec<Mesh>, light: &Light) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 5.0, 9.0), DVec3::ZERO, DVec3::Y, 0.7);
    let mut d = Description::new(camera, film(2, Filter::Box));
    d.integrator.max_depth = Some(2);
    let grey = d.add_material(Material::new("grey", grey(), true));
    for (i, mesh) in meshes.into_iter().enumerate() {
        d.add_shape(&format!("shape{i}"), mesh, grey);
    }
    d.lights.push(light.clone());
    Scene::new(d).unwrap()
}

/// Triangles of no pattern: where no shadow is found, each is lit all over or not at all; where one is found,
/// there is one, unless others hide it.
#[test]
fn no_triangle_is_lit_in_part_without_a_shadow() {
    let mut rng = stream(11, &[]);
    let (mut without, mut with, mut seen) = (0, 0, 0);
    for k in 0..400 {
        let mut random = || DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(&mut rng) - 1.0));
        let count = 2 + k % 2;
        let size = if k % 3 == 0 { 0.3 } else { 0.8 };
        let triangles: Vec<Mesh> = (0..count)
            .map(|_| {
                let centre = random();
                let corners = (0..3).map(|_| centre + size * random()).collect();
                Mesh::new(corners, vec![[0, 1, 2]]).unwrap()
            })
            .collect();
        let light = if k % 4 == 0 { sun(random()) } else { bulb(1.5 * random()) };
        let scene = of_meshes(triangles, &light);
        let is_lit = |x: DVec3, triangle: u32| {
            let from = crate::scene::Surface::Triangle(triangle);
            match &scene.lights()[0] {
                Light::Point { position, .. } => {
                    let way = *position - x;
                    !scene.shadowed(x, from, way.normalize(), way.length())
                }
                Light::Directional { direction, .. } => !scene.shadowed(x, from, -*direction, f64::INFINITY),
                _ => true,
            }
        };
        let parted = (0..count as u32).any(|t| {
            let [a, b, c] = scene.corners(t);
            let mut lit = (0..300).map(|_| {
                let [u, v] = [open01(&mut rng).sqrt(), open01(&mut rng)];
                is_lit(a + u * ((b - a) * (1.0 - v) + (c - a) * v), t)
            });
            let first = lit.next();
            lit.any(|other| Some(other) != first)
        });
        if casts_shadows(&scene, &scene.lights()[0]) {
            with += 1;
            seen += usize::from(parted);
        } else {
            without += 1;
            assert!(!parted, "scene {k}");
        }
    }
    println!("{without} scenes without shadows, {with} with, of which {seen} were seen");
    assert!(without > 50 && with > 50 && 10 * seen > 7 * with, "{without} {with} {seen}");
}
