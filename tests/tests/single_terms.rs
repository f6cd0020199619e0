//! Terms of flatland's estimators, each in a scene of its own: many samples of one scene in which the term is
//! most of the derivative.
//!
//! A slope over a hundred scenes reveals a bias that they share. A tenth of one term is a hundredth of the
//! derivative in most scenes; here the term is a large part, and a bias of it of a few percent is rejected.

use flatland::estimator::transport::{self, EdgeChoice};
use flatland::estimator::{Construction, EdgeSampling, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::plane::{Attachment, Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::stream;
use flatland::transport::{self as flat, Camera, Material, Tangent, World, fields};
use flatland::warp::{Field, WarpField as _};
use glam::{DVec2, DVec3};
use tests::campaign::{Known, Sampler};
use tests::comparison::{Comparison, Estimate};
use tests::power::Power;
use tests::scenes::Case;
use tests::statistics::suite_threshold;
use tests::transport::campaign as flat_campaign;
use tests::transport::worlds as flat_worlds;

fn square(low: [f64; 2], high: [f64; 2], shade: Shade) -> Shape {
    let corners =
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(DVec2::from);
    Shape::new(Polygon::simple(corners).expect("simple"), shade)
}

fn shade(attachment: Attachment) -> Shade {
    let gradient = [DVec2::new(0.5, 0.2), DVec2::new(-0.3, 0.6), DVec2::new(0.4, -0.5)];
    Shade::linear(DVec2::ONE, DVec3::new(1.0, 1.2, 0.8), gradient, attachment)
}

/// Two by two pixels.
fn film(filter: Filter) -> Film {
    Film::new(2, 2, filter).expect("a film")
}

/// The film shows only the inside of a shape, with a shade that moves with the material.
fn inside() -> Known {
    let scene = Scene::new(DVec3::ZERO, vec![square([-9.0; 2], [9.0; 2], shade(Attachment::Material))]);
    let motion = Motion::translate([0], DVec2::new(1.0, 0.4));
    Known::new(Case {
        scene: scene.expect("a scene"),
        motion,
        film: film(Filter::Tent),
        label: "inside".to_owned(),
    })
}

fn before_brighter(shade: Shade, motion: Motion, filter: Filter, label: &str) -> Known {
    let scene = Scene::new(DVec3::splat(4.0), vec![square([0.6, 0.7], [9.0; 2], shade)]);
    let label = format!("{label}, {filter:?}");
    Known::new(Case { scene: scene.expect("a scene"), motion, film: film(filter), label })
}

/// A corner in front of a brighter background, with a static shade.
fn corner(filter: Filter) -> Known {
    let motion = Motion::translate([0], DVec2::new(1.0, 0.4));
    before_brighter(shade(Attachment::Image), motion, filter, "a corner")
}

/// The same with a shade so steep that the field's motion of the shade contributes as much as the edges.
fn steep_corner() -> Known {
    let gradient = [DVec2::new(8.0, 3.0), DVec2::new(6.0, -4.0), DVec2::new(7.0, 5.0)];
    let shade = Shade::linear(DVec2::ONE, DVec3::ONE, gradient, Attachment::Image);
    let motion = Motion::translate([0], DVec2::new(1.0, 0.4));
    before_brighter(shade, motion, Filter::Tent, "a corner of a steep shade")
}

fn accept(power: &mut Power, k: &Known, label: &str, method: &impl Sampler) {
    let start = std::time::Instant::now();
    let (found, reference) = (k.run(5, method), Estimate::exact(k.exact));
    let label = format!("{}, {label}", k.case.label);
    println!("{label}: {:.2} s", start.elapsed().as_secs_f64());
    Comparison { found, reference, limit: suite_threshold(), slack: 0.0 }.accept(power, &label, k.exact);
}

fn warped(samples: usize, construction: Construction) -> WarpedArea {
    WarpedArea { samples, construction, ..WarpedArea::default() }
}

/// The terms of the plane: the interior term, the three parts of ∇·(V h f), the flux through the edges of box
/// pixels, points on edges, and the residual of a softened field.
#[test]
fn terms_of_the_plane() {
    let mut power = Power::of("single_terms::terms_of_the_plane").noticing(0.025);
    let jumps = Construction::JumpMean { reach: 0.6 };
    let inside = inside();
    accept(&mut power, &inside, "mean over jumps", &warped(80_000, jumps));
    accept(&mut power, &inside, "edge sampling", &EdgeSampling { samples: 80_000, seed: 0 });
    accept(&mut power, &steep_corner(), "mean over jumps", &warped(320_000, jumps));
    for filter in [Filter::Tent, Filter::Box] {
        let corner = corner(filter);
        accept(&mut power, &corner, "mean over jumps", &warped(150_000, jumps));
        for softness in [0.4, f64::INFINITY] {
            let softened = Construction::Softened { reach: 1.2, softness };
            accept(&mut power, &corner, &format!("softened, ε = {softness}"), &warped(150_000, softened));
        }
        accept(&mut power, &corner, "edge sampling", &EdgeSampling { samples: 60_000, seed: 0 });
    }
}

/// A floor under a lamp, with a moving plate that shadows the floor, or that is in front of the camera.
fn shaded(before: bool, filter: Filter) -> flat_campaign::Known {
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let plate = if before { [p(-1.1, 0.5), p(-0.75, 0.75)] } else { [p(-0.6, 1.5), p(0.2, 1.6)] };
    let shapes = vec![
        flat::Shape::open([p(-6.0, 0.0), p(6.0, 0.0)], Material::diffuse(0.8)),
        flat::Shape::open([p(-0.5, 3.0), p(0.7, 3.1)], Material::emitter(8.0)),
        flat::Shape::open(plate, Material::default()),
    ];
    let world = World::new(0.0, shapes).expect("a world");
    let film = flat::Film { pixels: 1, filter };
    // In the middle of a tent, whose support is wider; a box there shows only the plate.
    let angle = if filter == Filter::Box { -0.4 } else { -0.588 };
    let camera = Camera { position: p(-1.5, 1.0), angle, field_of_view: 0.3, film };
    let change = Tangent::moving(&world, [2], |_| p(1.0, 0.2));
    let label = if before { "a plate before the camera" } else { "a shadow" }.to_owned();
    flat_campaign::Known::new(flat_worlds::Case { world, camera, change, label }, 1)
}

fn accept_flat(
    power: &mut Power,
    k: &flat_campaign::Known,
    label: &str,
    method: &impl flat_campaign::Sampler,
) {
    let start = std::time::Instant::now();
    let (found, reference) = (k.total(5, method), Estimate::exact(k.exact));
    let label = format!("{}, {label}", k.case.label);
    println!("{label}: {:.2} s", start.elapsed().as_secs_f64());
    Comparison { found, reference, limit: suite_threshold(), slack: 0.0 }.accept(power, &label, k.exact);
}

/// The terms of flat worlds: discontinuities around surfaces and on the film, selected in both ways, and the
/// residual of softened fields.
#[test]
fn terms_of_flat_worlds() {
    let mut power = Power::of("single_terms::terms_of_flat_worlds").noticing(0.08);
    let reach = 8.0;
    let warped =
        |samples, construction| transport::WarpedArea { samples, construction, ..Default::default() };
    for k in [shaded(false, Filter::Tent), shaded(true, Filter::Tent)] {
        for (choice, samples) in [(EdgeChoice::Importance, 150_000), (EdgeChoice::Uniform, 400_000)] {
            let edges = transport::EdgeSampling { samples, choice, ..Default::default() };
            accept_flat(&mut power, &k, &format!("edge sampling, {choice:?}"), &edges);
        }
        for softness in [0.25 * reach, f64::INFINITY] {
            let softened = fields::Construction::Softened { reach, softness };
            accept_flat(&mut power, &k, &format!("softened, ε = {softness}"), &warped(150_000, softened));
        }
        for construction in [fields::Construction::JumpMean { reach }, fields::Construction::Harmonic] {
            let label = format!("{construction:?}");
            accept_flat(&mut power, &k, &label, &warped(300_000, construction));
        }
    }
    // With little softening, the field moves nearly as the discontinuities do: most of the residual is the
    // field's own motion.
    let softened = fields::Construction::Softened { reach, softness: 0.02 * reach };
    accept_flat(&mut power, &shaded(false, Filter::Tent), "softened little", &warped(150_000, softened));
    // With a reach of many pixels the field hardly varies within one, and the flux through the ends of a box
    // is nearly the whole derivative.
    let construction = fields::Construction::JumpMean { reach: 64.0 };
    accept_flat(&mut power, &shaded(true, Filter::Box), "a far reach", &warped(100_000, construction));
}

/// Russian roulette: surviving paths represent all paths.
#[test]
fn roulette_in_flat_worlds() {
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let mut power = Power::of("single_terms::roulette_in_flat_worlds").noticing(0.03);
    let room = [p(-2.0, -2.0), p(2.0, -2.0), p(2.0, 2.0), p(-2.0, 2.0)];
    let wall = Material { emission: 1.0, ..Material::diffuse(0.6) };
    let world = World::new(0.0, vec![flat::Shape::closed(room, wall)]).expect("a world");
    let film = flat::Film { pixels: 1, filter: Filter::Tent };
    let camera = Camera { position: p(0.3, 0.1), angle: 0.4, field_of_view: 0.5, film };
    // 1 + ρ + ρ² + ρ³.
    let exact = 1.0 + 0.6 + 0.36 + 0.216;
    let paths = flat::Paths { bounces: 3, roulette_after: 0 };
    let [mean, standard_error] = paths.image(&world, &camera, 60_000, 3).expect("an image")[0];
    let (found, reference) = (Estimate { mean, standard_error }, Estimate::exact(exact));
    Comparison { found, reference, limit: suite_threshold(), slack: 0.0 }.accept(
        &mut power,
        "a furnace",
        exact,
    );
}

/// A name, the exact value, and its estimate from a draw of a field.
type Quantity = (&'static str, f64, fn(&Field<DVec2>) -> f64);

/// Harmonic fields of the plane: within a square that grows about c the field is u − c, with divergence 2.
#[test]
fn harmonic_fields() {
    let mut power = Power::of("single_terms::harmonic_fields").noticing(0.1);
    let still = shade(Attachment::Image);
    let scene = Scene::new(DVec3::ZERO, vec![square([0.3, 0.4], [1.6, 1.5], still)]).expect("a scene");
    let centre = DVec2::new(0.2, 0.1);
    let velocities = Motion::scale([0], centre).velocities(&scene).expect("a motion");
    let film = film(Filter::Tent);
    let arrangement = Arrangement::new(&scene, &film).expect("a scene");
    let field = arrangement.harmonic(&velocities, 1e-6);
    let mut rng = stream(3, &[]);
    for u in [DVec2::new(0.8, 0.9), DVec2::new(1.3, 0.6)] {
        let drawn: Vec<_> = (0..20_000).map(|_| field.at(u, &mut rng).0).collect();
        let quantities: [Quantity; 3] = [
            ("divergence", 2.0, |f| f.divergence),
            ("x", (u - centre).x, |f| f.value.x),
            ("y", (u - centre).y, |f| f.value.y),
        ];
        for (name, exact, of) in quantities {
            let (found, reference) = (Estimate::of(drawn.iter().map(of)), Estimate::exact(exact));
            let comparison = Comparison { found, reference, limit: suite_threshold(), slack: 1e-5 };
            comparison.accept(&mut power, &format!("{name} at {u}"), exact);
        }
    }
}
