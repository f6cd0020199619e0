//! Light transport at the extremes: a table of `RESULTS.md` that this test fills.
//!
//! `UPDATE_RESULTS=1 cargo test --release -p tests --test transport_stability` writes it.

use flatland::estimator::transport::{EdgeSampling, Method, WarpedArea};
use flatland::plane::Filter;
use flatland::transport::exact::{Exact, Radiosity};
use flatland::transport::{Camera, Film, Material, Paths, Shape, Tangent, World};
use glam::DVec2;
use tests::results::{self, power_of_ten};
use tests::transport::oracle;

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// Variable parts of the world of the table.
#[derive(Clone, Copy)]
struct Scene {
    floor: Material,
    /// Middle and half extent of the light.
    light: [DVec2; 2],
    /// Whether a block is between light and floor.
    block: bool,
    eye: DVec2,
    /// The moving part: the light, the block or the floor.
    moves: Moves,
    scale: f64,
}

#[derive(Clone, Copy)]
enum Moves {
    Floor,
    Light,
    Block,
}

const SCENE: Scene = Scene {
    floor: Material { reflectance: 0.8, gloss: None, emission: 0.0 },
    light: [DVec2::new(-1.6, 2.8), DVec2::new(0.6, 0.2)],
    block: true,
    eye: DVec2::new(0.4, 2.0),
    moves: Moves::Block,
    scale: 1.0,
};

impl Scene {
    fn build(self) -> (World, Camera, Tangent) {
        let s = self.scale;
        let [middle, half] = self.light;
        // The power does not depend on the length.
        let emitter = Material::emitter(2.0 / half.length());
        let mut shapes = vec![
            Shape::open([s * p(-4.0, 0.0), s * p(3.0, 0.125)], self.floor),
            Shape::open([s * (middle - half), s * (middle + half)], emitter),
        ];
        if self.block {
            let block = [p(-0.9, 0.9), p(-0.3, 1.1), p(-0.6, 1.4)].map(|p| s * p);
            shapes.push(Shape::closed(block, Material::diffuse(0.5)));
        }
        let world = World::new(0.25, shapes).expect("a world");
        let film = Film { pixels: 5, filter: Filter::Tent };
        let camera = Camera { position: s * self.eye, angle: -1.4, field_of_view: 1.0, film };
        let change = match self.moves {
            Moves::Floor => Tangent::rotate(&world, [0], s * p(0.0, 0.0)),
            Moves::Light => Tangent::rotate(&world, [1], s * p(0.0, 1.0)),
            Moves::Block => Tangent::rotate(&world, [2], s * p(0.0, 1.5)),
        };
        (world, camera, change)
    }
}

/// The extreme; the exact engine compared with the oracle; the estimates of warped area and edge sampling.
type Row = [String; 4];

/// The fraction of the exact derivative that the samples find, by regression over all pixels, with its
/// standard error; `held` requires the whole derivative, for scenes without features too small for samples to
/// find.
fn found(
    method: &impl Method,
    (world, camera, change): &(World, Camera, Tangent),
    exact: &[f64],
    held: bool,
) -> String {
    let sampled = method.forward(world, camera, change).expect("valid");
    assert!(sampled.non_finite.is_empty());
    let squares: f64 = exact.iter().map(|x| x * x).sum();
    let product: f64 = exact.iter().zip(sampled.total()).map(|(x, m)| x * m).sum();
    let variance: f64 = exact.iter().zip(&sampled.standard_error.total).map(|(x, e)| (x * e).powi(2)).sum();
    let (found, error) = (product / squares, variance.sqrt() / squares);
    assert!(found.is_finite() && error.is_finite(), "{found} ± {error}");
    assert!(!held || (found - 1.0).abs() < 6.5 * error && error < 0.3, "{found} ± {error}");
    if error > 1.0 {
        return format!("lost in noise, 1e{:.0} of it", error.log10().round());
    }
    format!("finds {:.0}% ± {:.0}% of it", 100.0 * found, 100.0 * error)
}

/// Paths per pixel.
const PATHS: usize = 2000;
/// The same for 32 bounces.
const LONG_PATHS: usize = 10_000;

/// Both methods on one world.
fn both(
    samples: usize,
    paths: Paths,
    all: &(World, Camera, Tangent),
    exact: &[f64],
    held: bool,
) -> [String; 2] {
    let warped = WarpedArea { samples, paths, seed: 5, ..WarpedArea::default() };
    let edges = EdgeSampling { samples, paths, seed: 5, ..EdgeSampling::default() };
    [found(&warped, all, exact, held), found(&edges, all, exact, held)]
}

fn row(extreme: impl Into<String>, scene: Scene, held: bool) -> Row {
    let all = scene.build();
    let (world, camera, change) = &all;
    let oracle = oracle::image(world, camera, change, 1);
    let exact = Exact { bounces: 1, ..Exact::default() };
    let exact = exact.gradient(world, camera, change).expect("differentiable").pixels;
    let exact: Vec<f64> = exact.iter().map(|t| t.total()).collect();
    let size = oracle.iter().map(|o| o.absolute).fold(0.0, f64::max);
    let apart = oracle.iter().zip(&exact).map(|(o, e)| (o.derivative - e).abs()).fold(0.0, f64::max) / size;
    // The ends of a short emitter, seen from a point, are differences that are rounded to ε.
    let length = 2.0 * scene.light[1].length();
    assert!(apart < (10.0 * f64::EPSILON / length).max(1e-6), "{apart:e}");
    let [warped, edges] = both(PATHS, Paths::default(), &all, &exact, held);
    [extreme.into(), power_of_ten(apart), warped, edges]
}

/// Light scattered up to 32 times, compared with the radiosity solution.
fn many_bounces() -> Row {
    let room = [p(-2.0, 0.0), p(2.0, 0.1), p(2.1, 3.0), p(-1.9, 3.1)];
    let shapes = vec![
        Shape::closed(room, Material::diffuse(0.75)),
        Shape::open([p(-0.4, 2.7), p(0.5, 2.75)], Material::emitter(4.0)),
        Shape::closed([p(-0.9, 0.9), p(-0.3, 1.1), p(-0.6, 1.4)], Material::diffuse(0.5)),
    ];
    let world = World::new(0.0, shapes).expect("a world");
    let film = Film { pixels: 5, filter: Filter::Tent };
    let camera = Camera { position: p(1.3, 1.5), angle: -2.2, field_of_view: 1.2, film };
    let change = Tangent::translate(&world, [1], p(1.0, -0.5));
    let radiosity = Radiosity { bounces: Some(32), ..Radiosity::default() };
    let [_, solved] = radiosity.gradient(&world, &camera, &change).expect("diffuse");
    let scale = solved.scales.iter().copied().fold(0.0, f64::max);
    let error = solved.errors.iter().copied().fold(0.0, f64::max) / scale;
    let all = (world, camera, change);
    let paths = Paths { bounces: 32, ..Paths::default() };
    let [warped, edges] = both(LONG_PATHS, paths, &all, &solved.pixels, true);
    let extreme = format!("32 bounces in a closed room, {LONG_PATHS} paths a pixel");
    [extreme, format!("{} (stated)", power_of_ten(error)), warped, edges]
}

#[test]
fn the_table_shows_what_is_measured_at_the_extremes_of_transport() {
    let mut rows = vec![row("a moving block, nothing extreme", SCENE, true)];
    for scale in [1e-6, 1e6] {
        rows.push(row(format!("the world scaled by {scale:e}"), Scene { scale, ..SCENE }, true));
    }
    for length in [1e-3, 1e-6, 1e-12] {
        let light = [p(-1.6, 2.8), 0.5 * length * p(0.8, 0.6)];
        rows.push(row(
            format!("an emitter of length {length:e} that moves"),
            Scene { light, moves: Moves::Light, block: false, ..SCENE },
            false,
        ));
        rows.push(row(
            format!("an emitter of length {length:e} and a moving block"),
            Scene { light, ..SCENE },
            false,
        ));
    }
    for height in [1e-3, 1e-6, 1e-9] {
        // The floor rises by 1/8 over 7.
        let along = p(7.0, 0.125).normalize();
        let light = [p(-0.5, 0.0625) + height * along.perp(), 0.2 * along];
        let scene = Scene { light, moves: Moves::Light, block: false, ..SCENE };
        rows.push(row(format!("a light {height:e} over the floor that turns with it"), scene, false));
    }
    for height in [1e-3, 1e-6, 1e-9] {
        let along = p(7.0, 0.125).normalize();
        let eye = p(-0.5, 0.0625) + height * along.perp();
        rows.push(row(format!("a camera {height:e} from the floor"), Scene { eye, ..SCENE }, true));
    }
    for width in [1e-2, 1e-4, 1e-6] {
        let floor = Material::glossy(0.9, width);
        rows.push(row(format!("a lobe {width:e} wide and a moving block"), Scene { floor, ..SCENE }, false));
        let scene = Scene { floor, moves: Moves::Floor, block: false, ..SCENE };
        rows.push(row(format!("a lobe {width:e} wide on a floor that turns"), scene, false));
    }
    rows.push(many_bounces());
    let header = ["extreme", "exact against the oracle", "warped area", "edge sampling"];
    results::table("transport stability table", header, rows);
}
