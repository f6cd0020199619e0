//! Unbiasedness of direct light: a diffuse ground lit by polygons past polygons, compared with Lambert's
//! formula over clipped polygons and its derivative, integrated over pixels to a stated error.
//!
//! Emitters, occluders, the ground and the camera move; two in five emitters are two-sided, and some worlds
//! have a uniform environment. The camera sees no edge, so that all discontinuities are over the directions
//! at the ground: the secondary term is tested here.

use std::sync::LazyLock;

use flatland::plane::Filter;
use flatland::warp::{Debias, Warp, Weighting};
use glam::DVec3;
use rayon::prelude::*;
use tests::campaign::{Verdict, halves};
use tests::comparison::Estimate;
use tests::effort::{pick, thorough};
use tests::power::Power;
use tests::space::campaign::{Known, accept, limits, reject};
use tests::space::coverage::{Camera, CameraMotion};
use tests::space::direct::DirectScene;
use tests::space::irradiance::{World, irradiance};
use tests::space::worlds::{
    DirectKind, DirectKnobs, DirectMoving, IrradianceCase, IrradianceKind, IrradianceKnobs, IrradianceMoving,
};
use volume3d::gradient::{EdgeSampling, Field, Progress, WarpedArea};

/// Grounds with penumbras in their pixels.
static PENUMBRAS: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let all = DirectKind::ALL.into_iter().flat_map(|kind| {
        (0..pick(8, 24)).map(move |i| {
            let moving = DirectMoving::ALL[i as usize % DirectMoving::ALL.len()];
            DirectKnobs { moving, ..DirectKnobs::random(71_000 + i, kind) }
        })
    });
    let knobs: Vec<_> = all.collect();
    let known = knobs.par_iter().map(|knobs| {
        let case = knobs.build();
        Known::of_direct(&case.scene, 1e-3, &case.label)
    });
    known.collect()
});

/// The motions tested on points. A ground with a speed of about the world's size moves by a thousand pixels
/// of so small a film: such motions are tested on [`PENUMBRAS`].
const MOVING: [IrradianceMoving; 4] = [
    IrradianceMoving::Emitter,
    IrradianceMoving::Occluders,
    IrradianceMoving::Vertex,
    IrradianceMoving::GroundRotation,
];

/// Receivers the size of a pixel, under up to four occluders.
static POINTS: LazyLock<Vec<Known>> = LazyLock::new(|| points(&IrradianceKind::GENERIC, pick(24, 48)));

/// The pixel's field of view: the visible part of the ground is a sixth of the ground's size, and 1/200 of
/// the distance of everything else.
const FIELD_OF_VIEW: f64 = 0.1;

fn points(kinds: &[IrradianceKind], per_kind: u64) -> Vec<Known> {
    let all: Vec<_> = kinds
        .iter()
        .flat_map(|&kind| {
            (0..per_kind).map(move |i| {
                let moving = MOVING[i as usize % MOVING.len()];
                IrradianceKnobs { moving, ..IrradianceKnobs::random(72_000 + i, kind) }
            })
        })
        .collect();
    all.par_iter()
        .map(|knobs| {
            let case = knobs.build();
            Known::of_direct(&seen(&case), 1e-4, &case.label)
        })
        .collect()
}

/// A film of one pixel around the receiver.
fn seen(case: &IrradianceCase) -> DirectScene {
    let ray = &case.ray;
    let (forward, length) = (ray.direction.normalize(), ray.direction.length());
    let right = forward.any_orthonormal_vector();
    let camera = Camera {
        origin: ray.origin,
        right,
        up: right.cross(forward),
        forward,
        field_of_view: FIELD_OF_VIEW,
        width: 1,
        height: 1,
    };
    let angular = forward.cross(ray.direction_rate / length);
    let camera_motion = CameraMotion { origin: ray.origin_velocity, angular, field_of_view: 0.0 };
    DirectScene {
        world: case.world.clone(),
        ground: case.ground,
        albedo: DVec3::new(0.8, 0.7, 0.6),
        camera,
        camera_motion,
        filter: Filter::Box,
    }
}

/// Samples per pixel in each run.
const SAMPLES: usize = 32;

fn warped() -> WarpedArea {
    WarpedArea { samples: SAMPLES, ..WarpedArea::default() }
}

/// For films of one pixel.
fn pixel() -> WarpedArea {
    WarpedArea { samples: 4 * SAMPLES, ..warped() }
}

fn with(warp: Warp) -> WarpedArea {
    WarpedArea { field: Field::AuxiliaryRays, warp, ..pixel() }
}

fn edges(samples: usize) -> EdgeSampling {
    EdgeSampling {
        samples,
        primary: samples,
        secondary: 4 * samples,
        bounces: 4 * samples,
        seed: 0,
        allow_missing: vec![],
    }
}

/// A method on a set of scenes: the verdict on all scenes and, if there are enough, on each kind of motion,
/// as a bias of one kind must not hide among the others.
fn judge(
    power: &mut Power,
    name: &str,
    known: &[Known],
    motions: &[&str],
    estimate: impl Fn(&Known, u64) -> Estimate + Sync,
) {
    let found = halves(known, estimate);
    let of = |motion: &str| {
        let moves = |k: &Known| motion.is_empty() || k.label.contains(&format!("moving: {motion},"));
        Verdict::on(known.iter().zip(&found).filter(|(k, _)| moves(k)))
    };
    of("").accept(power, name, limits());
    for motion in motions.iter().filter(|_| thorough()) {
        of(motion).accept(power, &format!("{name}, {motion}"), limits());
    }
}

const PENUMBRA_MOTIONS: [&str; 6] = ["Ground", "GroundRotation", "Camera", "Emitters", "Occluders", "Mixed"];
const POINT_MOTIONS: [&str; 4] = ["Emitter", "Occluders", "Vertex", "GroundRotation"];

#[test]
fn pixels_with_penumbras() {
    let mut power = Power::of("space_irradiance::pixels_with_penumbras");
    judge(&mut power, "warped area", &PENUMBRAS, &PENUMBRA_MOTIONS, |k, half| {
        k.estimate(half, &WarpedArea { samples: pick(1, 4) * SAMPLES, ..warped() })
    });
    judge(&mut power, "edge sampling", &PENUMBRAS, &PENUMBRA_MOTIONS, |k, half| {
        k.estimate(half, &edges(pick(1, 5) * SAMPLES))
    });
}

/// Edge sampling rarely samples receivers this small, and is judged by penumbras alone.
#[test]
fn receivers() {
    let mut power = Power::of("space_irradiance::receivers");
    judge(&mut power, "warped area", &POINTS, &POINT_MOTIONS, |k, half| k.estimate(half, &pixel()));
}

/// Kinds that are hard to sample, each by itself.
#[test]
fn degenerate_kinds() {
    let mut power = Power::of("space_irradiance::degenerate_kinds");
    for kind in IrradianceKind::DEGENERATE {
        // Most tiny emitters are occluded, or affected by no motion: many scenes, and long runs to confirm a
        // zero, are needed.
        let (count, times) = match kind {
            IrradianceKind::TinyEmitter => (pick(0, 72), 12),
            _ => (12, 1),
        };
        if count == 0 {
            continue;
        }
        let known = points(&[kind], count);
        let method = WarpedArea { samples: times * pixel().samples, ..pixel() };
        accept(&mut power, &format!("{kind:?}"), &known, &method);
    }
}

/// The reference itself: the pixel's quadrature agrees with the irradiance at its centre up to the size of
/// the pixel.
#[test]
fn pixels_are_nearly_points() {
    let mut worst = 0.0_f64;
    for seed in 0..10 {
        let case = IrradianceKnobs {
            moving: IrradianceMoving::Emitter,
            ..IrradianceKnobs::random(seed, IrradianceKind::Open)
        };
        let case = case.build();
        let mut scene = seen(&case);
        scene.camera.field_of_view = 1e-4;
        let light = irradiance(&case.world, &case.receiver).expect("valid").outgoing(scene.albedo);
        let pixel = scene.image(1e-6).expect("valid")[0];
        let error = (pixel.derivative - light.derivative).abs().max_element();
        let error = error / light.derivative.abs().max_element().max(light.value.max_element());
        worst = worst.max(error);
    }
    println!("pixels of 1e-4 rad against points: {worst:.1e}");
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn reverse_mode_is_the_transpose() {
    let method = WarpedArea { samples: 4, seed: 3, ..WarpedArea::default() };
    let some = PENUMBRAS.iter().step_by(2).chain(POINTS.iter().step_by(2));
    let worst = some.map(|k| k.assert_transposed(&method, &k.everything(false))).fold(0.0, f64::max);
    println!("forward against reverse: worst {worst:.1e}");
}

#[test]
fn controls_are_rejected() {
    // Scenes with occluders, without which only sampled lights have discontinuities.
    let (first, count) = (POINTS.len() / 3, 6);
    let some: &[Known] = &POINTS[first..first + count];
    reject("sign flipped", some, |k, half| k.estimate(half, &pixel()).scaled(-1.0));
    let still = WarpedArea { warps: false, ..pixel() };
    reject("interior only", some, |k, half| k.estimate(half, &still));
    let terms = |k: &Known, half: u64, sum: &dyn Fn(&volume3d::gradient::Terms, usize) -> DVec3| {
        k.repeated(half, |seed| {
            let method = WarpedArea { seed, ..pixel() };
            let found = method.forward_terms(&k.scene, &k.change, &Progress::none()).expect("valid");
            let terms = found.terms.expect("asked for");
            let pixels: Vec<DVec3> = (0..k.weights.len()).map(|i| sum(&terms, i)).collect();
            k.weighted(&pixels)
        })
    };
    reject("no secondary term", some, |k, half| {
        terms(k, half, &|t, i| t.interior.pixels[i] + t.primary.pixels[i])
    });
    reject("the secondary term's sign flipped", some, |k, half| {
        terms(k, half, &|t, i| t.interior.pixels[i] + t.primary.pixels[i] - t.secondary.pixels[i])
    });
    // The sum of the three terms is the derivative.
    let whole = Verdict::of(some, |k, half| {
        terms(k, half, &|t, i| t.interior.pixels[i] + t.primary.pixels[i] + t.secondary.pixels[i])
    });
    assert!(whole.passes(limits()), "{whole:?}");
    let gaussian = with(Warp { weighting: Weighting::Gaussian, radial_exponent: 1.0, ..Warp::default() });
    reject("Gaussian weights", some, |k, half| k.estimate(half, &gaussian));
    for rays in [2, 4] {
        let few = with(Warp { debias: Debias::Consistent { rays }, ..Warp::default() });
        reject(&format!("{rays} rays as they are"), some, |k, half| k.estimate(half, &few));
    }
}

/// Light from a uniform environment past moving occluders: there is no emitter to sample.
#[test]
fn an_environment_behind_occluders() {
    let mut power = Power::of("space_irradiance::an_environment_behind_occluders");
    let known: Vec<Known> = (0..24)
        .into_par_iter()
        .map(|i| {
            let moving = MOVING[i as usize % 3];
            let knobs = IrradianceKnobs::random(73_000 + i, IrradianceKind::Glowing);
            let mut case = IrradianceKnobs { moving, occluders: 2, ..knobs }.build();
            let dark = case
                .world
                .surfaces
                .iter()
                .map(|s| tests::space::irradiance::Surface { radiance: DVec3::ZERO, ..s.clone() });
            case.world = World { surfaces: dark.collect(), environment: DVec3::new(1.0, 2.0, 3.0) };
            Known::of_direct(&seen(&case), 1e-4, &format!("{} in the dark", case.label))
        })
        .collect();
    // Its light has no kernel narrower than the diffuse one, and thus more noise than an emitter's.
    accept(&mut power, "environment", &known, &WarpedArea { samples: pick(64, 128) * SAMPLES, ..warped() });
    let still = WarpedArea { warps: false, ..warped() };
    reject("environment, interior only", &known, |k, half| k.estimate(half, &still));
}
