//! A request to stop a computation takes effect within a sample or two, not a cell: one pixel may have
//! millions of samples.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::DVec3;
use tests::space::scenes::{film, plate};
use volume3d::Image;
use volume3d::gradient::{
    ActiveParameters, EdgeSampling, FiniteDifference, GradientError, Progress, Rotation, Tangent, WarpedArea,
    render,
};
use volume3d::scene::{Camera, Description, Filter, Integrator, Material, Scene};

/// One pixel that shows a floor under a plate and a lamp.
fn scene() -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::ZERO, DVec3::Y, 0.35);
    let mut d = Description::new(camera, film(1, Filter::Box));
    d.integrator = Integrator { max_depth: Some(3), rr_depth: 100 };
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.7)));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 3.0), white);
    d.add_shape("plate", plate(0.8 * DVec3::Y, DVec3::Y, 0.3), white);
    d.add_emitter("lamp", plate(2.0 * DVec3::Y, -DVec3::Y, 0.5), DVec3::splat(6.0));
    Scene::new(d).expect("a scene")
}

/// A number of samples that takes many seconds.
const MANY: usize = 1 << 22;

/// Time of the request to stop, and the allowed delay. The delay is one or two samples; the rest is for
/// machines that are busy with other work.
const AFTER: Duration = Duration::from_millis(100);
const PATIENCE: Duration = Duration::from_millis(900);

type Run = fn(&Scene, &Tangent, &Progress) -> bool;

fn is_stop<T>(result: &Result<T, GradientError>) -> bool {
    matches!(result, Err(GradientError::Stopped(_)))
}

fn warped() -> WarpedArea {
    WarpedArea { samples: MANY, control_variate: 0, ..WarpedArea::default() }
}

fn rotation() -> Rotation {
    Rotation { samples: MANY, ..Rotation::default() }
}

fn edges() -> EdgeSampling {
    EdgeSampling {
        samples: 1,
        primary: 16 * MANY,
        secondary: 16 * MANY,
        bounces: 16 * MANY,
        seed: 0,
        allow_missing: vec![],
    }
}

/// The adjoint of a film of one pixel.
fn adjoint() -> Image {
    Image::constant(1, 1, DVec3::ONE)
}

const METHODS: [(&str, Run); 9] = [
    ("image", |s, _, p| render(s, 4 * MANY, 0, p).is_err()),
    ("finite differences", |s, c, p| {
        is_stop(&FiniteDifference { samples: 4 * MANY, ..FiniteDifference::default() }.forward(s, c, p))
    }),
    ("edges forward", |s, c, p| is_stop(&edges().forward(s, c, p))),
    ("edges reverse", |s, _, p| {
        is_stop(&edges().reverse(s, &adjoint(), &ActiveParameters::everything(s), p))
    }),
    ("interior of edge sampling", |s, c, p| {
        is_stop(&EdgeSampling { samples: 4 * MANY, ..EdgeSampling::default() }.forward(s, c, p))
    }),
    ("warped area forward", |s, c, p| is_stop(&warped().forward(s, c, p))),
    ("warped area reverse", |s, _, p| {
        is_stop(&warped().reverse(s, &adjoint(), &ActiveParameters::everything(s), p))
    }),
    ("rotation forward", |s, c, p| is_stop(&rotation().forward(s, c, p))),
    ("rotation reverse", |s, _, p| {
        is_stop(&rotation().reverse(s, &adjoint(), &ActiveParameters::everything(s), p))
    }),
];

#[test]
fn every_method_stops_within_a_cell() {
    let scene = scene();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.5, 0.3, 0.1));
    let mut failures = vec![];
    for (name, run) in METHODS {
        let flag = Arc::new(AtomicBool::new(false));
        let set = Arc::clone(&flag);
        let asks = std::thread::spawn(move || {
            std::thread::sleep(AFTER);
            set.store(true, Ordering::Relaxed);
        });
        let start = Instant::now();
        let stopped = run(&scene, &change, &Progress::none().until(move || flag.load(Ordering::Relaxed)));
        let late = start.elapsed().saturating_sub(AFTER);
        asks.join().expect("no panic");
        println!("{name}: stopped {stopped}, {:.0} ms after", 1e3 * late.as_secs_f64());
        if !stopped || late > PATIENCE {
            failures.push(name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
