//! Scenes whose derivative has a closed form, or is 0 whatever the shape.

use std::f64::consts::PI;

use flatland::plane;
use glam::{DQuat, DVec3};
use tests::comparison::Estimate;
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, directed, warped, weights};
use tests::space::constants::{furnace_room, furnace_up_to};
use tests::space::coverage;
use tests::space::scenes::{Stage, film, plate};
use volume3d::geometry::Mesh;
use volume3d::gradient::{
    EdgeSampling, FiniteDifference, GradientError, GradientImage, Progress, Tangent, Terms, WarpedArea,
    render,
};
use volume3d::scene::{Camera, Description, Filter, Integrator, Light, Material, Scene};

use super::{FILTERS, accept, agree, cube, gradient, known, repeated, sky};

#[test]
fn a_lit_plane_slides_under_itself() {
    let mut power = Power::of("space_known::a_lit_plane_slides_under_itself");
    for filter in FILTERS {
        let camera = Camera::look_at(DVec3::new(0.0, 1.0, 1.0), DVec3::ZERO, DVec3::Y, 0.7);
        let mut d = Description::new(camera, film(4, filter));
        let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.6)));
        d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 1e3), grey);
        d.environment = sky(DVec3::new(1.0, 2.0, 3.0));
        let scene = Scene::new(d).expect("a scene");
        for turns in [false, true] {
            let mut change = Tangent::still(&scene);
            if turns {
                change.rotate(&scene, 0, DVec3::new(0.2, 0.0, 0.1), DVec3::Y);
            } else {
                change.translate(&scene, 0, DVec3::new(0.3, 0.0, -0.5));
            }
            let scene = Scene::new(scene.description().clone()).expect("a scene");
            let k = known(scene, change, 0.0, &format!("slides under itself, turning: {turns}, {filter:?}"));
            accept(&mut power, &k, &warped(16));
        }
    }
}

fn furnace(albedo: f64, emission: f64, bounces: usize) -> Description {
    let camera = Camera::look_at(DVec3::new(0.2, 0.1, 0.3), DVec3::new(1.0, 0.4, 0.2), DVec3::Y, 1.2);
    let mut d = Description::new(camera, film(4, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(bounces + 1), rr_depth: 100 };
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(albedo)));
    let room = furnace_room(DVec3::splat(-2.0), DVec3::splat(2.0), emission);
    let triangles = room.triangles.iter().map(|t| t.map(|v| v as u32)).collect();
    let shape = d.add_shape("room", Mesh::new(room.positions, triangles).expect("a mesh"), grey);
    d.shapes[shape].radiance = Some(DVec3::splat(emission));
    // An object in view that is indistinguishable from the room.
    let shape = d.add_shape("block", cube(DVec3::new(1.2, 0.5, 0.1), 0.4, DQuat::from_rotation_z(0.5)), grey);
    d.shapes[shape].radiance = Some(DVec3::splat(emission));
    d
}

/// In a furnace every motion is invisible; the derivatives by albedo and emission follow from the series.
#[test]
fn a_white_furnace() {
    let mut power = Power::of("space_known::a_white_furnace");
    let (albedo, emission) = (0.6, 1.5);
    for bounces in [1, 3] {
        let scene = || Scene::new(furnace(albedo, emission, bounces)).expect("a scene");
        let sum: f64 = weights(16).iter().map(|w| w.element_sum()).sum();
        let level = furnace_up_to(albedo, emission, bounces as i32);
        let image = render(&scene(), 1024, 0, &Progress::none()).expect("not stopped");
        for (pixel, error) in image.image.pixels.iter().zip(&image.standard_error.pixels) {
            let z = (pixel.x - level).abs() / error.x.max(1e-9);
            // Eight groups of samples: Student's distribution with seven degrees of freedom.
            assert!(z < 30.0 && error.x < 0.01 * level, "{} ± {} for {level}", pixel.x, error.x);
        }
        let mut by_albedo = Tangent::still(&scene());
        by_albedo.reflectance[0] = DVec3::ONE;
        let rate: f64 = (1..=bounces as i32).map(|j| emission * f64::from(j) * albedo.powi(j - 1)).sum();
        let mut by_emission = Tangent::still(&scene());
        by_emission.radiance.fill(DVec3::ONE);
        let mut cases = vec![
            ("by albedo", by_albedo, sum * rate),
            ("by emission", by_emission, sum * furnace_up_to(albedo, 1.0, bounces as i32)),
        ];
        // With more bounces, concave corners make the noise of motions too large for a verdict.
        if bounces == 1 {
            let mut moves = Tangent::still(&scene());
            moves.rotate(&scene(), 1, DVec3::new(1.2, 0.5, 0.1), DVec3::new(1.0, 0.5, 0.3));
            moves.scale(&scene(), 0, DVec3::new(0.3, 0.2, 0.1), 0.3);
            moves.camera.rotation = DVec3::new(0.1, 0.2, 0.3);
            cases.push(("that moves", moves, 0.0));
        }
        for (what, change, exact) in cases {
            let k = known(scene(), change, exact, &format!("furnace {what}, {bounces}"));
            accept(&mut power, &k, &warped(pick(16, 32)));
        }
    }
}

/// A floor under a sky of radiance L reflects a L: the derivative by L is a, and by a it is L.
#[test]
fn a_sky_over_a_floor() {
    let mut power = Power::of("space_known::a_sky_over_a_floor");
    let (albedo, radiance) = (DVec3::new(0.6, 0.4, 0.2), DVec3::new(1.0, 2.0, 3.0));
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 0.5), DVec3::ZERO, DVec3::Z, 0.7);
    let mut d = Description::new(camera, film(3, Filter::Box));
    let grey = d.add_material(Material::diffuse("floor", albedo));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 1e2), grey);
    d.environment = sky(radiance);
    let scene = || Scene::new(d.clone()).expect("a scene");
    let total: DVec3 = weights(9).into_iter().sum();
    let mut by_sky = Tangent::still(&scene());
    by_sky.environment = DVec3::ONE;
    accept(&mut power, &known(scene(), by_sky, total.dot(albedo), "floor by its sky"), &warped(64));
    let mut by_albedo = Tangent::still(&scene());
    by_albedo.reflectance[grey] = DVec3::ONE;
    accept(&mut power, &known(scene(), by_albedo, total.dot(radiance), "floor by its albedo"), &warped(64));
}

/// A cube with the same radiance from everywhere, lit by a sky or emitting, and its exact derivative.
fn lonely_cube(filter: plane::Filter, shines: bool) -> Known {
    let camera = Camera::look_at(DVec3::new(2.0, 1.5, 3.0), DVec3::ZERO, DVec3::Y, 0.7);
    let mesh = cube(DVec3::ZERO, 0.6, DQuat::from_rotation_y(0.3));
    let (radiance, background) = if shines { (2.0, 0.0) } else { (0.5 * 4.0, 4.0) };
    let (radiance, background) = (DVec3::splat(radiance), DVec3::splat(background));
    let (angular, velocity) = (DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.2, 0.1, 0.3));
    let positions = mesh.positions().iter().map(|p| angular.cross(*p) + *p + velocity);
    let motion = coverage::Motion { positions: positions.collect(), ..coverage::Motion::default() };
    let triangles = mesh.triangles().iter().map(|t| t.map(|v| v as usize));
    let flat = coverage::Mesh {
        positions: mesh.positions().to_vec(),
        triangles: triangles.collect(),
        radiance: vec![radiance; 12],
        background,
    };
    let Camera { origin, right, up, forward, field_of_view, .. } = camera;
    let eye = coverage::Camera { origin, right, up, forward, field_of_view, width: 5, height: 5 };
    let exact = coverage::ProjectedScene::new(&flat, &eye, &motion, filter).and_then(|p| p.derivative());
    let exact = exact.expect("a derivative");
    let mut stage = Stage::new(&eye, &motion.camera, filter);
    let grey = stage.description.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    let vertices: Vec<_> = flat.positions.iter().copied().zip(motion.positions).collect();
    stage.add(&vertices, mesh.triangles().to_vec(), Some(grey), shines.then_some(radiance));
    stage.surround(background);
    let moving = stage.finish();
    let mut k =
        known(moving.scene, moving.change, 0.0, &format!("a cube alone, {filter:?}, shining: {shines}"));
    k.weights = directed(exact.pixels());
    k.exact = k.weighted(exact.pixels());
    k
}

/// Primary and secondary term of a cube alone, by both methods.
fn terms_of_cube(k: &Known) -> [[Estimate; 2]; 2] {
    type Run<'a> = &'a (dyn Fn(u64) -> Result<GradientImage, GradientError> + Sync);
    let none = &Progress::none();
    let terms = |run: Run<'_>| {
        let term = |pick: fn(&Terms) -> &Vec<DVec3>| {
            repeated(k, |seed| k.weighted(pick(&run(seed).expect("valid").terms.expect("asked for"))))
        };
        [term(|t| &t.primary.pixels), term(|t| &t.secondary.pixels)]
    };
    let area = |seed| WarpedArea { seed, ..warped(pick(9, 16)) }.forward_terms(&k.scene, &k.change, none);
    let edges = |seed| {
        let method =
            EdgeSampling { samples: 2, primary: 16, secondary: 16, bounces: 16, seed, allow_missing: vec![] };
        method.forward_terms(&k.scene, &k.change, none)
    };
    [terms(&area), terms(&edges)]
}

/// A convex object alone sees nothing that moves: its secondary term is 0 (unlike in Mitsuba 3, issue 1895),
/// and its primary term is the whole derivative.
fn a_cube_alone_has_no_secondary_term(mut power: Power, shines: bool) {
    for filter in [plane::Filter::Box, plane::Filter::Tent, plane::Filter::Gaussian] {
        let k = lonely_cube(filter, shines);
        for [primary, secondary] in terms_of_cube(&k) {
            agree(&mut power, &k.label, primary, Estimate::exact(k.exact), [0.0, k.exact]);
            assert!(secondary.mean == 0.0 && secondary.standard_error == 0.0, "{secondary:?}");
        }
    }
}

#[test]
fn a_shining_cube_alone_has_no_secondary_term() {
    let power = Power::of("space_known::a_shining_cube_alone_has_no_secondary_term");
    a_cube_alone_has_no_secondary_term(power, true);
}

#[test]
fn a_lit_cube_alone_has_no_secondary_term() {
    let power = Power::of("space_known::a_lit_cube_alone_has_no_secondary_term");
    a_cube_alone_has_no_secondary_term(power, false);
}

/// A floor that fills the view under a point light, a broad lobe of light, or a sky: there are no
/// discontinuities, only distances and cosines change. With and without a warp, the derivative equals the
/// closed form.
#[test]
fn a_floor_under_a_point_of_light() {
    let mut power = Power::of("space_known::a_floor_under_a_point_of_light");
    let (intensity, albedo, at) = (DVec3::new(3.0, 2.0, 1.0), 0.7, DVec3::new(0.2, 1.1, -0.1));
    let camera = Camera::look_at(DVec3::new(0.1, 1.2, 0.9), DVec3::ZERO, DVec3::Y, 0.02);
    let mut d = Description::new(camera.clone(), film(1, Filter::Box));
    d.integrator = Integrator { max_depth: Some(2), rr_depth: 100 };
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(albedo)));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 50.0), grey);
    d.lights.push(Light::Point { id: "bulb".to_owned(), position: at, intensity });
    let scene = || Scene::new(d.clone()).expect("a scene");
    // L = ρ/π I n·d/|d|³ where the middle ray meets the floor; the pixel is 0.02 rad wide: 1e-4 of L.
    let radiance = |height: f64, tilt: f64, light: DVec3| {
        let normal = DQuat::from_rotation_z(tilt) * DVec3::Y;
        let t = normal.dot(DVec3::Y * height - camera.origin) / normal.dot(camera.forward);
        let d = light - (camera.origin + t * camera.forward);
        albedo / PI * normal.dot(d) / d.length().powi(3)
    };
    let h = 1e-6;
    let rises = (radiance(h, 0.0, at) - radiance(-h, 0.0, at)) / (2.0 * h);
    let tilts = (radiance(0.0, h, at) - radiance(0.0, -h, at)) / (2.0 * h);
    let lamp =
        (radiance(0.0, 0.0, at + h * DVec3::ONE) - radiance(0.0, 0.0, at - h * DVec3::ONE)) / (2.0 * h);
    let still = Tangent::still(&scene());
    let mut changes = [(still.clone(), rises), (still.clone(), tilts), (still, lamp)];
    changes[0].0.translate(&scene(), 0, DVec3::Y);
    changes[1].0.rotate(&scene(), 0, DVec3::ZERO, DVec3::Z);
    changes[2].0.pose[0] = DVec3::ONE;
    for (i, (change, rate)) in changes.into_iter().enumerate() {
        let exact = weights(1)[0].dot(intensity) * rate;
        let method = WarpedArea { warps: false, ..warped(64) };
        let k = known(scene(), change, exact, &format!("point of light, change {i}"));
        let found = gradient(&k, &method);
        agree(&mut power, &k.label, found, Estimate::exact(exact), [1e-3 * exact.abs(), exact]);
    }
}

/// The same under a lobe of light, where a warp may be used: the number is the same with and without it.
#[test]
fn a_floor_under_a_lobe_of_light() {
    let mut power = Power::of("space_known::a_floor_under_a_lobe_of_light");
    for filter in FILTERS {
        let camera = Camera::look_at(DVec3::new(0.1, 1.2, 0.9), DVec3::ZERO, DVec3::Y, 0.6);
        let mut d = Description::new(camera, film(3, filter));
        d.integrator = Integrator { max_depth: Some(2), rr_depth: 100 };
        let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.7)));
        d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 50.0), grey);
        d.lights.push(Light::Directional {
            id: "sun".to_owned(),
            direction: DVec3::new(0.4, -0.8, 0.3).normalize(),
            irradiance: DVec3::new(3.0, 2.0, 1.0),
            kappa: 15.0,
        });
        let scene = Scene::new(d).expect("a scene");
        let mut change = Tangent::still(&scene);
        change.rotate(&scene, 0, DVec3::ZERO, DVec3::new(0.5, 0.0, 0.8));
        change.translate(&scene, 0, DVec3::new(0.0, 0.3, 0.0));
        change.camera.rotation = DVec3::new(0.1, 0.0, 0.05);
        let k = known(scene, change, 0.0, &format!("lobe of light, {filter:?}"));
        let [still, moved] =
            [false, true].map(|warps| gradient(&k, &WarpedArea { warps, seed: 9, ..warped(64) }));
        let (differences, slack) =
            k.differences::<2>(FiniteDifference { samples: 128, step: 1e-2, seed: 1000 }, 64);
        agree(&mut power, &format!("{}, still", k.label), still, differences, [slack, still.mean]);
        agree(&mut power, &format!("{}, warped", k.label), moved, differences, [slack, still.mean]);
    }
}
