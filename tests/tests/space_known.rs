//! What is known by an argument: derivatives that are 0, furnaces, symmetries, scenes without a jump, bits
//! that must not depend on threads or on whether a gradient is taken, and extremes.

use std::f64::consts::PI;

use flatland::plane;
use flatland::warp::{Debias, Warp};
use glam::{DAffine3, DQuat, DVec2, DVec3};
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, Sampler, directed, limit, pulled, warped, weights};
use tests::space::constants::{furnace_room, furnace_up_to};
use tests::space::coverage;
use tests::space::scenes::{Stage, film, plate};
use volume3d::geometry::{Attribute, Mesh};
use volume3d::gradient::{
    CameraTangent, EdgeSampling, Field, FiniteDifference, GradientError, GradientImage, Progress, Tangent,
    Terms, WarpedArea, render,
};
use volume3d::scene::{
    Camera, Description, Environment, Filter, Integrator, Light, Material, Reflectance, Scene, Texture, Wrap,
};

const FILTERS: [Filter; 3] = [Filter::Box, Filter::Tent { radius: 1.0 }, Filter::Gaussian { deviation: 0.5 }];

fn sky(radiance: DVec3) -> Option<Environment> {
    Some(Environment::Constant { id: "sky".to_owned(), radiance })
}

fn cube(centre: DVec3, half: f64, turn: DQuat) -> Mesh {
    Mesh::cube().transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, centre))
}

/// A scene whose derivative is known. Where that is 0, errors are measured by the image, as if it changed by itself.
fn known(scene: Scene, change: Tangent, exact: f64, label: &str) -> Known {
    let mut k = Known::given(scene, change, exact, label);
    k.scale = k.weighted(&render(&k.scene, 64, 1, &Progress::none()).expect("not stopped").pixels);
    k
}

/// A fixed number of rays, which is biased but has no heavy tail: for what holds of that bias too.
fn consistent(samples: usize) -> WarpedArea {
    let warp = Warp { debias: Debias::Consistent { rays: 16 }, ..Warp::default() };
    WarpedArea { field: Field::AuxiliaryRays, warp, ..warped(samples) }
}

/// The mean of all repetitions.
fn repeated(k: &Known, run: impl Fn(u64) -> f64 + Sync) -> Estimate {
    let [a, b] = [0, 1].map(|half| k.repeated(half, &run));
    a.plus(b).scaled(0.5)
}

fn gradient(k: &Known, method: &impl Sampler) -> Estimate {
    repeated(k, |seed| k.sample(&method.reseeded(seed)))
}

fn edges(samples: usize) -> EdgeSampling {
    EdgeSampling { samples, primary: samples, secondary: samples, seed: 0 }
}

/// Asserts that an estimate is its reference but for its noise and the slack, and that it would not be with a bias that
/// must be noticed. Of a reference of 0, noise is measured by `scale`.
fn agree(power: &mut Power, label: &str, found: Estimate, reference: Estimate, [slack, scale]: [f64; 2]) {
    Comparison { found, reference, limit: limit(), slack }.accept(power, label, scale);
}

/// A number that is known, against warped area.
fn accept(power: &mut Power, k: &Known, method: &WarpedArea) {
    let scale = if k.exact == 0.0 { k.scale } else { k.exact };
    agree(power, &k.label, gradient(k, method), Estimate::exact(k.exact), [1e-9, scale]);
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
fn block_moves(scene: &Scene, scale: f64, place: DVec3) -> Tangent {
    let centre = place + scale * DVec3::new(-0.2, 0.65, 0.1);
    let mut change = Tangent::still(scene);
    change.rotate(scene, 1, centre, DVec3::new(0.3, 0.7, -0.4));
    change.scale(scene, 1, centre, 1.0);
    change
}

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

#[test]
fn everything_moves_together() {
    let mut power = Power::of("space_known::everything_moves_together");
    for filter in FILTERS {
        let scene = Scene::new(court(filter, 1.0, DVec3::ZERO)).expect("a scene");
        let mut change = Tangent::still(&scene);
        let (velocity, turn) = (DVec3::new(0.2, -0.1, 0.3), DVec3::new(0.1, 0.5, -0.2));
        for shape in 0..3 {
            change.rotate(&scene, shape, DVec3::ZERO, turn);
            change.translate(&scene, shape, velocity);
        }
        let translation = velocity + turn.cross(scene.description().camera.origin);
        change.camera = CameraTangent { translation, rotation: turn, field_of_view: 0.0 };
        accept(&mut power, &known(scene, change, 0.0, &format!("moved as one, {filter:?}")), &warped(32));
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
    let mut power = Power::of("space_known::a_white_furnace");
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
        let mut by_albedo = Tangent::still(&scene());
        by_albedo.reflectance[0] = DVec3::ONE;
        let rate: f64 = (1..=bounces as i32).map(|j| emission * f64::from(j) * albedo.powi(j - 1)).sum();
        accept(
            &mut power,
            &known(scene(), by_albedo, sum * rate, &format!("furnace by albedo, {bounces}")),
            &warped(pick(16, 64)),
        );
        let mut by_emission = Tangent::still(&scene());
        by_emission.radiance.fill(DVec3::ONE);
        let rate = furnace_up_to(albedo, 1.0, bounces as i32);
        accept(
            &mut power,
            &known(scene(), by_emission, sum * rate, &format!("furnace by emission, {bounces}")),
            &warped(pick(16, 64)),
        );
        if bounces > 1 {
            // Concave corners make the noise of what moves there too large to say anything.
            continue;
        }
        let mut moves = Tangent::still(&scene());
        moves.rotate(&scene(), 1, DVec3::new(1.2, 0.5, 0.1), DVec3::new(1.0, 0.5, 0.3));
        moves.scale(&scene(), 0, DVec3::new(0.3, 0.2, 0.1), 0.3);
        moves.camera.rotation = DVec3::new(0.1, 0.2, 0.3);
        accept(
            &mut power,
            &known(scene(), moves, 0.0, &format!("furnace that moves, {bounces}")),
            &warped(pick(16, 64)),
        );
    }
}

/// A floor under a sky reflects a L: by L, it is a; by a, L.
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
        [term(|t| &t.primary), term(|t| &t.secondary)]
    };
    let area = |seed| WarpedArea { seed, ..warped(pick(9, 16)) }.forward_terms(&k.scene, &k.change, none);
    let edges = |seed| {
        let method = EdgeSampling { samples: 2, primary: 16, secondary: 16, seed };
        method.forward_terms(&k.scene, &k.change, none)
    };
    [terms(&area), terms(&edges)]
}

/// Convex and alone, a cube sees nothing that moves: the secondary term is 0 (as it was not in Mitsuba 3,
/// whose tracker has it under number 1895), and the primary term is the whole.
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
    let mut power = Power::of("space_known::a_seam_of_texture_coordinates_does_not_tear_the_surface");
    let seamless = scene(false);
    let change = block_moves(&seamless, 1.0, DVec3::ZERO);
    let weights = known(seamless, change, 0.0, "seamless").focused(512).weights;
    let of = |seamed| {
        let scene = scene(seamed);
        assert_eq!(scene.description().shapes[1].mesh.positions().len(), 8);
        let change = block_moves(&scene, 1.0, DVec3::ZERO);
        let k = known(scene, change, 0.0, if seamed { "seamed" } else { "seamless" });
        let k = Known { weights: weights.clone(), ..k };
        [gradient(&k, &consistent(pick(160, 256))), gradient(&k, &edges(pick(40, 64)))]
    };
    // A fixed number of rays, which has a bias of its own, and edges.
    for ((seamless, seamed), name) in of(false).into_iter().zip(of(true)).zip(["16 rays", "edges"]) {
        agree(&mut power, name, seamed, seamless, [0.0, seamless.mean]);
    }
}

/// A floor beyond the view under a point, or under a broad lobe of light, or under a sky: nothing jumps, only
/// distances and cosines change. With a warp and without, the derivative is that of the closed form.
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

/// The same under a lobe of light, where a warp may be asked for: with it and without it is the same number.
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

#[test]
fn bits_do_not_depend_on_threads() {
    let scene = Scene::new(court(Filter::Gaussian { deviation: 0.5 }, 1.0, DVec3::ZERO)).expect("a scene");
    let change = block_moves(&scene, 1.0, DVec3::ZERO);
    let active = volume3d::gradient::ActiveParameters::everything(&scene);
    let adjoint = weights(16);
    let at = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let method = WarpedArea { seed: 5, ..warped(16) };
            let none = Progress::none();
            let forward = method.forward_terms(&scene, &change, &none).expect("valid");
            let reverse = pulled(method.reverse(&scene, &adjoint, &active, &none).expect("valid"));
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
    let mut power = Power::of("space_known::scenes_of_any_size_and_anywhere");
    let at = |scale: f64, place: DVec3| {
        let scene = Scene::new(court(filter, scale, place)).expect("a scene");
        let change = block_moves(&scene, scale, place);
        known(scene, change, 0.0, &format!("scale {scale:e} at {place}"))
    };
    let unit = at(1.0, DVec3::ZERO).focused(512);
    let found = gradient(&unit, &WarpedArea { seed: 1000, ..warped(SIZED) });
    let far = DVec3::new(1.0, -0.7, 0.4);
    let places = [(1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, 1e3 * far), (1.0, 1e6 * far)];
    for (scale, place) in places {
        let k = Known { weights: unit.weights.clone(), ..at(scale, place) };
        agree(&mut power, &k.label, gradient(&k, &warped(SIZED)), found, [0.0, found.mean]);
    }
}

/// Samples a pixel in each run.
const SIZED: usize = 192;

/// A camera within a mesh, a lamp that stands on the floor, a view along the floor: finite differences agree.
#[test]
fn awkward_places() {
    let mut power = Power::of("space_known::awkward_places");
    let filter = Filter::Tent { radius: 1.0 };
    let still = |d: Description| Scene::new(d).expect("a scene");
    let mut inside = court(filter, 1.0, DVec3::ZERO);
    let grey = inside.shapes[0].material;
    inside.add_shape("shell", cube(DVec3::new(0.3, 1.4, 2.6), 8.0, DQuat::IDENTITY), grey);
    let mut touching = court(filter, 1.0, DVec3::ZERO);
    touching.shapes[2].mesh = plate(DVec3::new(0.6, 0.3, -0.4), DVec3::new(-0.3, 0.0, 1.0), 0.3);
    let mut along = court(filter, 1.0, DVec3::ZERO);
    along.camera = Camera::look_at(DVec3::new(0.2, 0.01, 2.6), DVec3::new(0.0, 0.1, 0.0), DVec3::Y, 0.8);
    // With how many times the runs of differences, and how many the samples: in the shell everything is lit by
    // everything, and a lamp that touches the floor is near its own border.
    let places = [
        ("lamp on the floor", touching, 2, 8),
        ("along the floor", along, 1, 1),
        ("camera in a shell", inside, 4, 1),
    ];
    for (name, d, runs, samples) in places.into_iter().take(pick(2, 3)) {
        let scene = still(d);
        let change = block_moves(&scene, 1.0, DVec3::ZERO);
        let k = known(scene, change, 0.0, name).focused(512);
        let narrowest = FiniteDifference { samples: 512, step: 2e-2, seed: 1000 };
        let (differences, slack) = k.differences::<2>(narrowest, runs * pick(96, 192));
        let found = gradient(&k, &warped(samples * pick(128, 256)));
        agree(&mut power, name, found, differences, [slack, differences.mean]);
    }
}
