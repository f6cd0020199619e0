//! What is known by an argument: derivatives that are 0, furnaces, symmetries, scenes without a jump, bits
//! that must not depend on threads or on whether a gradient is taken, and extremes.

use std::f64::consts::PI;

use flatland::plane;
use flatland::warp::{Debias, Warp};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use tests::campaign::Estimate;
use tests::space::campaign::{Known, limit, pulled, weights};
use tests::space::constants::{furnace_room, furnace_up_to};
use tests::space::coverage;
use tests::space::scenes::Stage;
use volume3d::geometry::{Attribute, Mesh};
use volume3d::gradient::{
    CameraChange, Change, EdgeSampling, Field, GradientError, GradientImage, Progress, Terms, WarpedArea,
    render,
};
use volume3d::scene::{
    Camera, Description, Environment, Film, Filter, Integrator, Light, Material, Reflectance, Scene, Texture,
    Wrap,
};

const FILTERS: [Filter; 3] = [Filter::Box, Filter::Tent { radius: 1.0 }, Filter::Gaussian { deviation: 0.5 }];

fn film(size: usize, filter: Filter) -> Film {
    Film { width: size, height: size, crop: None, filter }
}

fn sky(radiance: DVec3) -> Option<Environment> {
    Some(Environment::Constant { id: "sky".to_owned(), radiance })
}

/// A rectangle of half size `half`, facing `normal`.
fn plate(centre: DVec3, normal: DVec3, half: f64) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    Mesh::rectangle().transformed(&DAffine3::from_scale_rotation_translation(
        DVec3::splat(half),
        turn,
        centre,
    ))
}

fn cube(centre: DVec3, half: f64, turn: DQuat) -> Mesh {
    Mesh::cube().transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, centre))
}

/// A scene whose derivative is known.
fn known(scene: Scene, change: Change, exact: f64, label: &str) -> Known {
    let (width, height) = scene.size();
    Known {
        scene,
        change,
        weights: weights(width * height),
        exact,
        error: 0.0,
        value: 0.0,
        label: label.to_owned(),
    }
}

fn warped(samples: usize) -> WarpedArea {
    WarpedArea { samples, ..WarpedArea::default() }
}

/// A fixed number of rays, which is biased but has no heavy tail: for what holds of that bias too.
fn consistent(samples: usize) -> WarpedArea {
    let warp = Warp { debias: Debias::Consistent { rays: 16 }, ..Warp::default() };
    WarpedArea { field: Field::AuxiliaryRays, warp, ..warped(samples) }
}

/// z of the estimate of one half; differences of rounding count as none.
fn z(k: &Known, found: Estimate, rounding: f64) -> f64 {
    let beyond = ((found.mean - k.exact).abs() - rounding).max(0.0);
    let z = if beyond == 0.0 { 0.0 } else { beyond / found.standard_error };
    println!("{}: {:.4e} ± {:.1e} for {:.4e}, z {z:.2}", k.label, found.mean, found.standard_error, k.exact);
    z
}

fn accept(k: &Known, method: &WarpedArea) -> Estimate {
    let found = k.estimate(0, method);
    let z = z(k, found, 1e-9);
    assert!(z <= limit(), "{}: {found:?} for {}", k.label, k.exact);
    found
}

/// A floor with a lamp and a block over it, under some sky; unit size, somewhere, of some scale.
fn court(filter: Filter, scale: f64, place: DVec3) -> Description {
    let at = |x: f64, y: f64, z: f64| scale * DVec3::new(x, y, z) + place;
    let camera = Camera::look_at(at(0.3, 1.4, 2.6), at(0.0, 0.2, 0.0), DVec3::Y, 0.8);
    let mut d = Description::new(camera, film(4, filter));
    d.integrator = Integrator { max_depth: Some(3), rr_depth: 100 };
    let grey = d.add_material(Material::diffuse("grey", DVec3::new(0.7, 0.6, 0.5)));
    d.add_shape("floor", plate(at(0.0, 0.0, 0.0), DVec3::Y, 1.5 * scale), grey);
    d.add_shape("block", cube(at(-0.2, 0.65, 0.1), 0.3 * scale, DQuat::from_rotation_y(0.4)), grey);
    d.add_emitter(
        "lamp",
        plate(at(0.4, 1.5, 0.2), DVec3::new(-0.2, -1.0, 0.0), 0.4 * scale),
        DVec3::splat(4.0),
    );
    d.environment = sky(DVec3::new(0.2, 0.3, 0.4));
    d
}

/// The block grows and turns, at a speed of the scene's size.
fn block_moves(scene: &Scene, scale: f64, place: DVec3) -> Change {
    let centre = place + scale * DVec3::new(-0.2, 0.65, 0.1);
    let mut change = Change::still(scene);
    change.rotate(scene, 1, centre, DVec3::new(0.3, 0.7, -0.4));
    change.scale(scene, 1, centre, 1.0);
    change
}

#[test]
fn a_lit_plane_slides_under_itself() {
    for filter in FILTERS {
        let camera = Camera::look_at(DVec3::new(0.0, 1.0, 1.0), DVec3::ZERO, DVec3::Y, 0.7);
        let mut d = Description::new(camera, film(4, filter));
        let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.6)));
        d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 1e3), grey);
        d.environment = sky(DVec3::new(1.0, 2.0, 3.0));
        let scene = Scene::new(d).expect("a scene");
        for turns in [false, true] {
            let mut change = Change::still(&scene);
            if turns {
                change.rotate(&scene, 0, DVec3::new(0.2, 0.0, 0.1), DVec3::Y);
            } else {
                change.translate(&scene, 0, DVec3::new(0.3, 0.0, -0.5));
            }
            let scene = Scene::new(scene.description().clone()).expect("a scene");
            let k = known(scene, change, 0.0, &format!("slides under itself, turning: {turns}, {filter:?}"));
            accept(&k, &warped(16));
        }
    }
}

#[test]
fn everything_moves_together() {
    for filter in FILTERS {
        let scene = Scene::new(court(filter, 1.0, DVec3::ZERO)).expect("a scene");
        let mut change = Change::still(&scene);
        let (velocity, turn) = (DVec3::new(0.2, -0.1, 0.3), DVec3::new(0.1, 0.5, -0.2));
        for shape in 0..3 {
            change.rotate(&scene, shape, DVec3::ZERO, turn);
            change.translate(&scene, shape, velocity);
        }
        let translation = velocity + turn.cross(scene.description().camera.origin);
        change.camera = CameraChange { translation, rotation: turn, field_of_view: 0.0 };
        accept(&known(scene, change, 0.0, &format!("moved as one, {filter:?}")), &warped(32));
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
    // Something in the view that is not seen.
    let shape = d.add_shape("block", cube(DVec3::new(1.2, 0.5, 0.1), 0.4, DQuat::from_rotation_z(0.5)), grey);
    d.shapes[shape].radiance = Some(DVec3::splat(emission));
    d
}

/// Nothing is to be seen in a furnace, whatever moves; and by albedo and emission the series says all.
#[test]
fn a_white_furnace() {
    let (albedo, emission) = (0.6, 1.5);
    for bounces in [1, 3] {
        let scene = || Scene::new(furnace(albedo, emission, bounces)).expect("a scene");
        let sum: f64 = weights(16).iter().map(|w| w.element_sum()).sum();
        let level = furnace_up_to(albedo, emission, bounces as i32);
        let image = render(&scene(), 1024, 0, &Progress::none()).expect("not stopped");
        for (pixel, error) in image.pixels.iter().zip(&image.standard_error) {
            let z = (pixel.x - level).abs() / error.x.max(1e-9);
            // Eight groups of samples: Student's distribution with seven degrees of freedom.
            assert!(z < 30.0 && error.x < 0.01 * level, "{} ± {} for {level}", pixel.x, error.x);
        }
        let mut by_albedo = Change::still(&scene());
        by_albedo.reflectance[0] = DVec3::ONE;
        let rate: f64 = (1..=bounces as i32).map(|j| emission * f64::from(j) * albedo.powi(j - 1)).sum();
        accept(&known(scene(), by_albedo, sum * rate, &format!("furnace by albedo, {bounces}")), &warped(64));
        let mut by_emission = Change::still(&scene());
        by_emission.radiance.fill(DVec3::ONE);
        let rate = furnace_up_to(albedo, 1.0, bounces as i32);
        accept(
            &known(scene(), by_emission, sum * rate, &format!("furnace by emission, {bounces}")),
            &warped(64),
        );
        if bounces > 1 {
            // Concave corners make the noise of what moves there too large to say anything.
            continue;
        }
        let mut moves = Change::still(&scene());
        moves.rotate(&scene(), 1, DVec3::new(1.2, 0.5, 0.1), DVec3::new(1.0, 0.5, 0.3));
        moves.scale(&scene(), 0, DVec3::new(0.3, 0.2, 0.1), 0.3);
        moves.camera.rotation = DVec3::new(0.1, 0.2, 0.3);
        accept(&known(scene(), moves, 0.0, &format!("furnace that moves, {bounces}")), &warped(64));
    }
}

/// A floor under a sky reflects a L: by L, it is a; by a, L.
#[test]
fn a_sky_over_a_floor() {
    let (albedo, radiance) = (DVec3::new(0.6, 0.4, 0.2), DVec3::new(1.0, 2.0, 3.0));
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 0.5), DVec3::ZERO, DVec3::Z, 0.7);
    let mut d = Description::new(camera, film(3, Filter::Box));
    let grey = d.add_material(Material::diffuse("floor", albedo));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 1e2), grey);
    d.environment = sky(radiance);
    let scene = || Scene::new(d.clone()).expect("a scene");
    let total: DVec3 = weights(9).into_iter().sum();
    let mut by_sky = Change::still(&scene());
    by_sky.environment = DVec3::ONE;
    accept(&known(scene(), by_sky, total.dot(albedo), "floor by its sky"), &warped(64));
    let mut by_albedo = Change::still(&scene());
    by_albedo.reflectance[grey] = DVec3::ONE;
    accept(&known(scene(), by_albedo, total.dot(radiance), "floor by its albedo"), &warped(64));
}

/// A cube that looks the same from everywhere, lit by a sky or shining by itself, and its exact derivative.
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
    let Camera { origin, right, up, forward, field_of_view } = camera;
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
    k.exact = k.weighted(exact.pixels());
    k
}

/// Primary and secondary term of a cube alone, by both methods.
fn terms_of_cube(k: &Known) -> [[Estimate; 2]; 2] {
    let none = &Progress::none();
    let term = |of: &dyn Fn(u64) -> Result<GradientImage, GradientError>,
                pick: &dyn Fn(&Terms) -> &Vec<DVec3>| {
        k.repeated(0, |seed| k.weighted(pick(&of(seed).expect("valid").terms.expect("asked for"))))
    };
    let area = |seed| WarpedArea { seed, ..warped(128) }.forward_terms(&k.scene, &k.change, none);
    let edges = |seed| {
        let method = EdgeSampling { samples: 2, primary: 64, secondary: 64, seed };
        method.forward_terms(&k.scene, &k.change, none)
    };
    let both = |of: &dyn Fn(u64) -> Result<GradientImage, GradientError>| {
        [term(of, &|t| &t.primary), term(of, &|t| &t.secondary)]
    };
    [both(&area), both(&edges)]
}

const PLANE_FILTERS: [plane::Filter; 3] = [plane::Filter::Box, plane::Filter::Tent, plane::Filter::Gaussian];

/// Convex and alone, a cube sees nothing that moves: the secondary term is 0 (as it was not in Mitsuba 3,
/// whose tracker has it under number 1895), and the primary term is the whole.
#[test]
fn a_shining_cube_alone_has_no_secondary_term() {
    for filter in PLANE_FILTERS {
        let k = lonely_cube(filter, true);
        for [primary, secondary] in terms_of_cube(&k) {
            assert!(z(&k, primary, 0.0) < limit(), "{primary:?}");
            assert!(primary.standard_error < 0.3 * k.exact.abs(), "{primary:?} for {}", k.exact);
            assert!(secondary.mean == 0.0 && secondary.standard_error == 0.0, "{secondary:?}");
        }
    }
}

#[test]
fn a_lit_cube_alone_has_no_secondary_term() {
    for filter in PLANE_FILTERS {
        let k = lonely_cube(filter, false);
        for [primary, secondary] in terms_of_cube(&k) {
            println!("secondary {secondary:?}");
            assert!(z(&k, primary, 0.0) < limit(), "{primary:?}");
            assert!(primary.standard_error < 0.3 * k.exact.abs(), "{primary:?} for {}", k.exact);
            assert_eq!(secondary.mean, 0.0, "{secondary:?}");
        }
    }
}

/// The scene moved by θ: shapes and camera.
fn displaced(scene: &Scene, change: &Change, theta: f64) -> Scene {
    let mut d = scene.description().clone();
    for (i, shape) in d.shapes.iter_mut().enumerate() {
        let moved = shape.mesh.positions().iter().zip(change.positions_of(scene, i));
        let moved = moved.map(|(p, v)| *p + theta * *v).collect();
        let mesh = Mesh::new(moved, shape.mesh.triangles().to_vec()).expect("a mesh");
        assert_eq!(mesh.positions().len(), shape.mesh.positions().len(), "vertices have met");
        let mesh = mesh.with_normals(shape.mesh.normals().clone()).expect("normals");
        shape.mesh = match shape.mesh.uvs() {
            Some(uvs) => mesh.with_uvs(uvs.clone()).expect("coordinates"),
            None => mesh,
        };
    }
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(theta * change.camera.rotation));
    d.camera.origin += theta * change.camera.translation;
    d.camera.field_of_view += theta * change.camera.field_of_view;
    for axis in [&mut d.camera.right, &mut d.camera.up, &mut d.camera.forward] {
        *axis = turn * *axis;
    }
    Scene::new(d).expect("a scene")
}

/// The central difference of Σ weight · I with common random numbers, `runs` times.
fn difference(k: &Known, step: f64, samples: usize, runs: u64) -> Estimate {
    let [ahead, behind] = [step, -step].map(|theta| displaced(&k.scene, &k.change, theta));
    let sum = |scene: &Scene, seed: u64| {
        k.weighted(&render(scene, samples, 1000 + seed, &Progress::none()).expect("not stopped").pixels)
    };
    let runs: tests::statistics::Moments =
        (0..runs).map(|seed| (sum(&ahead, seed) - sum(&behind, seed)) / (2.0 * step)).collect();
    Estimate { mean: runs.mean(), standard_error: runs.standard_error() }
}

/// A texture of one colour shows no seam. What is duplicated for its coordinates is one vertex.
#[test]
fn a_seam_of_texture_coordinates_does_not_tear_the_surface() {
    let texture = Texture {
        id: "paint".to_owned(),
        width: 2,
        height: 2,
        texels: vec![DVec3::new(0.8, 0.5, 0.3); 4],
        wrap: Wrap::Repeat,
        to_uv: glam::DAffine2::IDENTITY,
    };
    let scene = |seamed: bool| {
        let mut d = court(Filter::Tent { radius: 1.0 }, 1.0, DVec3::ZERO);
        let mut paint = Material::diffuse("paint", DVec3::ZERO);
        let index = d.add_texture(texture.clone());
        paint.bsdf = volume3d::scene::Bsdf::Diffuse { reflectance: Reflectance::Texture(index) };
        let block = d.shapes[1].mesh.clone();
        // Every triangle with three vertices of its own, or those of the cube.
        let soup = |t: usize| [0, 1, 2].map(|c| 3 * t as u32 + c);
        let corners: Vec<DVec3> =
            block.triangles().iter().flatten().map(|&v| block.positions()[v as usize]).collect();
        let (positions, triangles): (Vec<DVec3>, Vec<[u32; 3]>) = if seamed {
            (corners.clone(), (0..12).map(soup).collect())
        } else {
            (block.positions().to_vec(), block.triangles().to_vec())
        };
        let coordinate = |p: &DVec3| if seamed { DVec2::new(p.x, p.y + p.z) } else { DVec2::ZERO };
        let uvs =
            Attribute { values: positions.iter().map(coordinate).collect(), triangles: triangles.clone() };
        d.shapes[1].mesh = Mesh::new(positions, triangles).expect("a mesh").with_uvs(uvs).expect("fits");
        d.shapes[1].material = d.add_material(paint);
        Scene::new(d).expect("a scene")
    };
    let gradient = |seamed| {
        let scene = scene(seamed);
        assert_eq!(scene.description().shapes[1].mesh.positions().len(), 8);
        let change = block_moves(&scene, 1.0, DVec3::ZERO);
        let k = known(scene, change, 0.0, if seamed { "seamed" } else { "seamless" });
        let edges = k.repeated(u64::from(seamed), |seed| {
            let method = EdgeSampling { samples: 64, primary: 64, secondary: 64, seed };
            k.weighted(&method.forward(&k.scene, &k.change, &Progress::none()).expect("valid").gradient)
        });
        [k.estimate(u64::from(seamed), &consistent(64)), edges]
    };
    // What is left of the noise of fixed rays, and of edges.
    for ((seamless, seamed), bound) in gradient(false).into_iter().zip(gradient(true)).zip([0.2, 0.05]) {
        let error = seamless.standard_error.hypot(seamed.standard_error);
        println!("seamless {seamless:?}, seamed {seamed:?}");
        assert!((seamless.mean - seamed.mean).abs() < limit() * error && error < bound * seamless.mean.abs());
    }
}

/// A floor beyond the view under a point, or under a broad lobe of light, or under a sky: nothing jumps, only
/// distances and cosines change. With a warp and without, the derivative is that of the closed form.
#[test]
fn a_floor_under_a_point_of_light() {
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
    let still = Change::still(&scene());
    let mut changes = [(still.clone(), rises), (still.clone(), tilts), (still, lamp)];
    changes[0].0.translate(&scene(), 0, DVec3::Y);
    changes[1].0.rotate(&scene(), 0, DVec3::ZERO, DVec3::Z);
    changes[2].0.pose[0] = DVec3::ONE;
    for (i, (change, rate)) in changes.into_iter().enumerate() {
        let exact = weights(1)[0].dot(intensity) * rate;
        let method = WarpedArea { warps: false, ..warped(64) };
        let k = known(scene(), change, exact, &format!("point of light, change {i}"));
        let found = k.estimate(0, &method);
        println!("{}: {found:?} for {exact}", k.label);
        assert!((found.mean - exact).abs() < 1e-3 * exact.abs() + limit() * found.standard_error);
    }
}

/// The same under a lobe of light, where a warp may be asked for: with it and without it is the same number.
#[test]
fn a_floor_under_a_lobe_of_light() {
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
        let mut change = Change::still(&scene);
        change.rotate(&scene, 0, DVec3::ZERO, DVec3::new(0.5, 0.0, 0.8));
        change.translate(&scene, 0, DVec3::new(0.0, 0.3, 0.0));
        change.camera.rotation = DVec3::new(0.1, 0.0, 0.05);
        let k = known(scene, change, 0.0, &format!("lobe of light, {filter:?}"));
        let still = k.estimate(0, &WarpedArea { warps: false, ..warped(256) });
        let moved = k.estimate(1, &warped(256));
        let differences = difference(&k, 1e-3, 1024, 32);
        println!("{}: {still:?}, warped {moved:?}, differences {differences:?}", k.label);
        for (a, b) in [(still, moved), (still, differences)] {
            let error = a.standard_error.hypot(b.standard_error);
            assert!((a.mean - b.mean).abs() < limit() * error + 1e-5 * a.mean.abs(), "{a:?} {b:?}");
        }
        assert!(still.standard_error < 0.02 * still.mean.abs(), "{still:?}");
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let scene = Scene::new(court(Filter::Gaussian { deviation: 0.5 }, 1.0, DVec3::ZERO)).expect("a scene");
    let change = block_moves(&scene, 1.0, DVec3::ZERO);
    let wanted = volume3d::gradient::Wanted::everything(&scene);
    let adjoint = weights(16);
    let at = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let method = WarpedArea { seed: 5, ..warped(16) };
            let none = Progress::none();
            let forward = method.forward_terms(&scene, &change, &none).expect("valid");
            let reverse = pulled(method.reverse(&scene, &adjoint, &wanted, &none).expect("valid"));
            (forward, reverse, render(&scene, 16, 5, &none).expect("not stopped"))
        })
    };
    let one = at(1);
    for threads in [2, 4] {
        let other = at(threads);
        assert!(one == other, "{threads} threads");
    }
}

/// The derivative of a scene of any size, anywhere, is that of the same scene of size 1 at the origin.
#[test]
fn scenes_of_any_size_and_anywhere() {
    let filter = Filter::Tent { radius: 1.0 };
    let run = |scale: f64, place: DVec3, half: u64| {
        let scene = Scene::new(court(filter, scale, place)).expect("a scene");
        let change = block_moves(&scene, scale, place);
        let k = known(scene, change, 0.0, &format!("scale {scale:e} at {place}"));
        let found = k.estimate(half, &warped(64));
        println!("{}: {found:?}", k.label);
        found
    };
    let unit = run(1.0, DVec3::ZERO, 0);
    assert!(unit.standard_error < 0.2 * unit.mean.abs());
    let far = DVec3::new(1.0, -0.7, 0.4);
    let places = [(1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, 1e3 * far), (1.0, 1e6 * far)];
    for (scale, place) in places {
        let other = run(scale, place, 1);
        let error = unit.standard_error.hypot(other.standard_error);
        assert!((unit.mean - other.mean).abs() < limit() * error, "{unit:?} {other:?}");
    }
}

/// A camera within a mesh, a lamp that stands on the floor, a view along the floor: finite differences agree.
#[test]
fn awkward_places() {
    let filter = Filter::Tent { radius: 1.0 };
    let still = |d: Description| Scene::new(d).expect("a scene");
    let mut inside = court(filter, 1.0, DVec3::ZERO);
    let grey = inside.shapes[0].material;
    inside.add_shape("shell", cube(DVec3::new(0.3, 1.4, 2.6), 8.0, DQuat::IDENTITY), grey);
    let mut touching = court(filter, 1.0, DVec3::ZERO);
    touching.shapes[2].mesh = plate(DVec3::new(0.6, 0.3, -0.4), DVec3::new(-0.3, 0.0, 1.0), 0.3);
    let mut along = court(filter, 1.0, DVec3::ZERO);
    along.camera = Camera::look_at(DVec3::new(0.2, 0.01, 2.6), DVec3::new(0.0, 0.1, 0.0), DVec3::Y, 0.8);
    for (name, d) in
        [("camera in a shell", inside), ("lamp on the floor", touching), ("along the floor", along)]
    {
        let scene = still(d);
        let change = block_moves(&scene, 1.0, DVec3::ZERO);
        let k = known(scene, change, 0.0, name);
        let found = k.estimate(0, &warped(128));
        let differences = difference(&k, 1e-2, 1024, 32);
        let error = found.standard_error.hypot(differences.standard_error);
        println!("{name}: {found:?}, differences {differences:?}");
        assert!((found.mean - differences.mean).abs() < limit() * error, "{name}");
        assert!(error < 0.3 * found.mean.abs(), "{name}: {error}");
    }
}
