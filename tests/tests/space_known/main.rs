//! Values known by an argument: derivatives that are 0, furnaces, symmetries, scenes without discontinuities,
//! bits that do not depend on threads or on whether a gradient is computed, and extremes.

mod closed;

use flatland::warp::{Debias, Warp};
use glam::{DAffine3, DQuat, DVec2, DVec3};
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, Sampler, limit, pulled, warped, weights};
use tests::space::scenes::{film, plate};
use volume3d::Image;
use volume3d::geometry::{Attribute, Mesh};
use volume3d::gradient::{
    ActiveParameters, CameraTangent, EdgeSampling, Field, FiniteDifference, Progress, Tangent, WarpedArea,
    render,
};
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Filter, Integrator, Material, Reflectance, Scene, Texture, Wrap,
};

const FILTERS: [Filter; 3] = [Filter::Box, Filter::Tent { radius: 1.0 }, Filter::Gaussian { deviation: 0.5 }];

fn sky(radiance: DVec3) -> Option<Environment> {
    Some(Environment::Constant { id: "sky".to_owned(), radiance })
}

fn cube(centre: DVec3, half: f64, turn: DQuat) -> Mesh {
    Mesh::cube().transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, centre))
}

/// A scene whose derivative is known. If it is 0, errors are relative to the image, as if the image changed
/// at a rate equal to itself.
fn known(scene: Scene, change: Tangent, exact: f64, label: &str) -> Known {
    let mut k = Known::given(scene, change, exact, label);
    k.scale = k.weighted(&render(&k.scene, 64, 1, &Progress::none()).expect("not stopped").image.pixels);
    k
}

/// A fixed number of rays, which is biased but has no heavy tails: for properties of that bias too.
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
    EdgeSampling {
        samples,
        primary: samples,
        secondary: samples,
        bounces: samples,
        seed: 0,
        allow_missing: vec![],
    }
}

/// Asserts that an estimate equals its reference up to its noise and the slack, and that it would not with
/// the bias that must be noticed. For a reference of 0, noise is relative to `scale`.
fn agree(power: &mut Power, label: &str, found: Estimate, reference: Estimate, [slack, scale]: [f64; 2]) {
    Comparison { found, reference, limit: limit(), slack }.accept(power, label, scale);
}

/// Compares warped area with a known value.
fn accept(power: &mut Power, k: &Known, method: &WarpedArea) {
    let scale = if k.exact == 0.0 { k.scale } else { k.exact };
    agree(power, &k.label, gradient(k, method), Estimate::exact(k.exact), [1e-9, scale]);
}

/// A floor with a lamp and a block above it, under a sky; of unit size, at a given place and scale.
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

/// The block grows and rotates, at a speed of about the scene's size.
fn block_moves(scene: &Scene, scale: f64, place: DVec3) -> Tangent {
    let centre = place + scale * DVec3::new(-0.2, 0.65, 0.1);
    let mut change = Tangent::still(scene);
    change.rotate(scene, 1, centre, DVec3::new(0.3, 0.7, -0.4));
    change.scale(scene, 1, centre, 1.0);
    change
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

/// A texture of one colour shows no seam. Vertices duplicated for texture coordinates count as one.
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
        paint.bsdf = Bsdf::Diffuse { reflectance: Reflectance::Texture(index) };
        let block = d.shapes[1].mesh.clone();
        // Three separate vertices per triangle, or the shared vertices of the cube.
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
    let weights = known(seamless, change, 0.0, "seamless").focused(8192, 4e-2).weights;
    let of = |seamed| {
        let scene = scene(seamed);
        assert_eq!(scene.description().shapes[1].mesh.positions().len(), 8);
        let change = block_moves(&scene, 1.0, DVec3::ZERO);
        let k = known(scene, change, 0.0, if seamed { "seamed" } else { "seamless" });
        let k = Known { weights: weights.clone(), ..k };
        [gradient(&k, &consistent(400)), gradient(&k, &edges(40))]
    };
    // A fixed number of rays, which is biased, and edge sampling.
    for ((seamless, seamed), name) in of(false).into_iter().zip(of(true)).zip(["16 rays", "edges"]) {
        agree(&mut power, name, seamed, seamless, [0.0, seamless.mean]);
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let scene = Scene::new(court(Filter::Gaussian { deviation: 0.5 }, 1.0, DVec3::ZERO)).expect("a scene");
    let change = block_moves(&scene, 1.0, DVec3::ZERO);
    let active = ActiveParameters::everything(&scene);
    let adjoint = Image { width: 4, height: 4, pixels: weights(16) };
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

/// The derivative of a scene of any size at any place equals that of the scene of size 1 at the origin.
#[test]
fn scenes_of_any_size_and_anywhere() {
    let filter = Filter::Tent { radius: 1.0 };
    let mut power = Power::of("space_known::scenes_of_any_size_and_anywhere");
    let at = |scale: f64, place: DVec3| {
        let scene = Scene::new(court(filter, scale, place)).expect("a scene");
        let change = block_moves(&scene, scale, place);
        known(scene, change, 0.0, &format!("scale {scale:e} at {place}"))
    };
    let unit = at(1.0, DVec3::ZERO).focused(8192, 4e-2);
    let found = gradient(&unit, &WarpedArea { seed: 1000, ..warped(SIZED) });
    let far = DVec3::new(1.0, -0.7, 0.4);
    let places = [(1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, 1e3 * far), (1.0, 1e6 * far)];
    for (scale, place) in places {
        let k = Known { weights: unit.weights.clone(), ..at(scale, place) };
        agree(&mut power, &k.label, gradient(&k, &warped(SIZED)), found, [0.0, found.mean]);
    }
}

/// Samples per pixel in each run.
const SIZED: usize = 256;

/// A camera within a mesh, a lamp that stands on the floor, a view along the floor: comparison with finite
/// differences.
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
    // Factors on the runs of differences and on the samples: in the shell all surfaces light one another, and
    // a lamp that touches the floor is near its own border.
    let places = [
        ("lamp on the floor", touching, 2, 8),
        ("along the floor", along, 1, 1),
        ("camera in a shell", inside, 4, 1),
    ];
    for (name, d, runs, samples) in places.into_iter().take(pick(2, 3)) {
        let scene = still(d);
        let change = block_moves(&scene, 1.0, DVec3::ZERO);
        let k = known(scene, change, 0.0, name).focused(8192, 4e-2);
        let narrowest = FiniteDifference { samples: 512, step: 2e-2, seed: 1000 };
        let (differences, slack) = k.differences::<2>(narrowest, runs * pick(96, 144));
        let found = gradient(&k, &warped(samples * pick(128, 192)));
        agree(&mut power, name, found, differences, [slack, differences.mean]);
    }
}
