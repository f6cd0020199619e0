//! Tests of softened fields with lights of all kinds, against edge sampling and differences.

use super::*;
use crate::gradient::Field;
use crate::scene::{Environment, Light};

/// A ground and a plate in front of it in view of the camera, under an emitting block that hides a second one
/// and the sun from parts of the ground.
fn scene() -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 0.3, 3.0), DVec3::ZERO, DVec3::Y, 0.4);
    let mut d = Description::new(camera, film(3, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let paper = d.add_material(Material::diffuse("paper", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("ground", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 1.5)), paper);
    let turned = DAffine3::from_rotation_y(0.5) * DAffine3::from_rotation_x(-0.3);
    d.add_shape("plate", Mesh::rectangle().transformed(&(at(0.25, 0.1, 0.5, 0.25) * turned)), paper);
    let block = |x: f64, y: f64, z: f64| Mesh::cube().transformed(&(at(x, y, z, 0.2) * turned));
    d.add_emitter("block", block(0.6, 0.5, 1.2), DVec3::splat(8.0));
    d.add_emitter("behind", block(1.0, 0.8, 1.9), DVec3::splat(20.0));
    let lamp = Mesh::rectangle().transformed(&(at(-0.9, 0.4, 1.5, 0.3) * DAffine3::from_rotation_y(2.4)));
    d.add_emitter("lamp", lamp, DVec3::splat(6.0));
    let direction = DVec3::new(-0.4, -0.5, -1.0).normalize();
    d.lights.push(Light::Directional { id: "sun".into(), direction, irradiance: DVec3::ONE, kappa: 40.0 });
    d
}

#[test]
fn softened_fields_follow_shadows_and_outlines_of_all_lights() {
    let scene = Scene::new(scene()).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.5, 0.2, -0.3));
    for shape in 2..5 {
        change.translate(&scene, shape, DVec3::new(-0.5, -0.3, -1.0));
    }
    let none = Progress::none();
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 3) as f64)).collect()
    };
    let softened = |shadows: usize, warps: bool| {
        let field =
            Field::Softened { film: 1.2, lobe: 0.5, softness: 0.4, silhouettes: 64, shadows, bounces: 0 };
        total(|seed| {
            let method = WarpedArea { samples: 64, seed, field, warps, ..WarpedArea::default() };
            weighted(method.forward(&scene, &change, &none).unwrap().gradient)
        })
    };
    let edges = total(|seed| {
        let method = EdgeSampling {
            samples: 32,
            primary: 64,
            secondary: 256,
            bounces: 256,
            seed,
            allow_missing: vec![],
        };
        weighted(method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let mut comparisons = Comparisons::of("softened_fields_follow_shadows_and_outlines_of_all_lights");
    comparisons.add("softened".into(), softened(256, true), edges, 0.0, edges.0);
    comparisons.add("softened, exact shadows".into(), softened(0, true), edges, 0.0, edges.0);
    comparisons.reject("interior only", softened(0, false), edges);
    comparisons.finish();
}

/// An octahedron, immersed in a plane up to its ring of edges, moves in it. The waterline is an intersection
/// along folds, and no silhouette where both faces of a fold face the camera.
#[test]
fn softened_fields_leave_waterlines_to_curves() {
    let camera = Camera::look_at(DVec3::new(0.3, -2.6, 2.2), DVec3::new(0.0, 0.0, 1.0), DVec3::Z, 0.55);
    let mut d = Description::new(camera, film(5, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(1);
    d.add_emitter("plane", Mesh::rectangle().transformed(&at(0.0, 0.0, 1.0, 2.0)), DVec3::splat(0.3));
    let ring = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y];
    let places = [&ring[..], &[DVec3::Z, DVec3::NEG_Z]].concat();
    let sides = (0..4).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]).collect();
    let places = places.iter().map(|p| 0.5 * *p + DVec3::Z).collect();
    d.add_emitter("body", Mesh::new(places, sides).unwrap(), DVec3::ONE);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.3, -1.0, 0.0));
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * ((i / 5) as f64 - 1.0)).collect()
    };
    let run = |field: Field| {
        total(|seed| {
            let method = WarpedArea { samples: 192, seed, field, ..WarpedArea::default() };
            weighted(method.forward(&scene, &change, &Progress::none()).unwrap().gradient)
        })
    };
    let softened = |silhouettes: usize| {
        run(Field::Softened { film: 1.2, lobe: 0.5, softness: 0.4, silhouettes, shadows: 0, bounces: 0 })
    };
    let exact = run(Field::default());
    let mut comparisons = Comparisons::of("softened_fields_leave_waterlines_to_curves");
    comparisons.add("softened".into(), softened(192), exact, 0.0, exact.0);
    comparisons.reject("silhouettes left out", softened(0), exact);
    comparisons.finish();
}

/// A ground with a wall at its side, under a sky and a faint lamp, with a block and a plate above the visible
/// part of the ground: radiance after bounces is discontinuous at both, in front of the wall and of the sky.
fn room() -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, -0.6, 0.45), DVec3::new(0.0, -0.1, 0.0), DVec3::Z, 0.6);
    let mut d = Description::new(camera, film(3, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(3);
    d.environment = Some(Environment::Constant { id: "sky".into(), radiance: DVec3::new(0.8, 1.0, 1.4) });
    let paper = d.add_material(Material::diffuse("paper", DVec3::new(0.8, 0.7, 0.6)));
    let red = d.add_material(Material::diffuse("red", DVec3::new(0.9, 0.3, 0.2)));
    d.add_shape("ground", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 1.5)), paper);
    let wall = at(-0.9, 0.0, 0.7, 0.9) * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    d.add_shape("wall", Mesh::rectangle().transformed(&wall), red);
    let turned = DAffine3::from_rotation_y(0.5) * DAffine3::from_rotation_x(-0.3);
    d.add_shape("block", Mesh::cube().transformed(&(at(0.3, 0.1, 0.9, 0.2) * turned)), paper);
    d.add_shape("plate", Mesh::rectangle().transformed(&(at(-0.3, -0.1, 0.75, 0.25) * turned)), red);
    let lamp = at(0.9, -0.4, 1.5, 0.4) * DAffine3::from_rotation_y(-2.4);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::ONE);
    Scene::new(d).unwrap()
}

/// Bounce terms with and without samples of the softened field's residual, against the exact mean.
#[test]
fn softened_fields_follow_what_bounces_see() {
    let (scene, none) = (room(), Progress::none());
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 2, DVec3::new(0.1, 0.1, -0.6));
    change.translate(&scene, 3, DVec3::new(0.2, -0.2, -0.8));
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 3) as f64)).collect()
    };
    let field = |softness: f64, bounces: usize| Field::Softened {
        film: 1.2,
        lobe: 0.5,
        softness,
        silhouettes: 32,
        shadows: 400,
        bounces,
    };
    let method = |softness: f64, bounces: usize, seed: u64| WarpedArea {
        samples: 1024,
        seed,
        field: field(softness, bounces),
        ..WarpedArea::default()
    };
    let softened = |softness: f64| {
        let run = |seed| method(softness, 8000, seed).forward(&scene, &change, &none).unwrap().gradient;
        total(|seed| weighted(run(seed)))
    };
    // The field of a method with curve samples, used without them.
    let left_out = total(|seed| {
        let construction = method(f64::INFINITY, 1, seed).construction(&scene);
        let without = method(f64::INFINITY, 0, seed);
        weighted(without.image::<1, 6>(&scene, &change, construction, &none).unwrap().gradient)
    });
    let exact = total(|seed| {
        let method = WarpedArea { samples: 1024, seed: 1000 + seed, ..WarpedArea::default() };
        weighted(method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let mut comparisons = Comparisons::of("softened_fields_follow_what_bounces_see");
    for softness in [0.4, f64::INFINITY] {
        comparisons.add(format!("ε = {softness}"), softened(softness), exact, 0.0, exact.0);
    }
    comparisons.reject("what bounces see left out", left_out, exact);
    comparisons.finish();
}

/// The transpose of the same terms, to rounding.
#[test]
fn softened_fields_of_bounces_are_transposed() {
    let (scene, none) = (room(), Progress::none());
    let mut change = Tangent::still(&scene);
    change.rotate(&scene, 2, DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.4, 0.1, 0.3));
    let field =
        Field::Softened { film: 1.2, lobe: 0.5, softness: 0.4, silhouettes: 2, shadows: 4, bounces: 4 };
    let method = WarpedArea { samples: 8, seed: 5, field, ..WarpedArea::default() };
    let forward = method.forward(&scene, &change, &none).unwrap().gradient;
    let adjoint = Image {
        pixels: (0..forward.pixels.len()).map(|i| DVec3::new(1.0, 0.3, (i as f64).sin())).collect(),
        ..forward.clone()
    };
    let mut active = ActiveParameters::nothing(&scene);
    active.shapes[2] = true;
    let gradient = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
    let along: f64 = gradient.positions.iter().zip(&change.positions).map(|(g, v)| g.dot(*v)).sum();
    let across: f64 = forward.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| g.dot(*a)).sum();
    assert!((along - across).abs() < 1e-9 * across.abs(), "{along} {across}");
}
