//! Unbiasedness of direct light: a diffuse ground lit by polygons past polygons, against Lambert's formula
//! over clipped polygons and its derivative, integrated over pixels to a stated error.
//!
//! Emitters, occluders, the ground and the camera move; two in five emitters shine to both sides, some
//! worlds are surrounded by light. Where the camera sees no edge, all that jumps is seen from the ground: the
//! secondary term is what is tested here.

use std::sync::LazyLock;

use flatland::plane::Filter;
use flatland::warp::{Debias, Warp, Weighting};
use glam::DVec3;
use rayon::prelude::*;
use tests::campaign::{Estimate, Reference, Verdict};
use tests::space::campaign::{Known, passes, pulled, reject, verdict};
use tests::space::coverage::{Camera, CameraMotion};
use tests::space::direct::DirectScene;
use tests::space::irradiance::{World, irradiance};
use tests::space::worlds::{
    DirectKind, DirectKnobs, DirectMoving, IrradianceCase, IrradianceKind, IrradianceKnobs, IrradianceMoving,
};
use tests::statistics::suite_threshold;
use volume3d::gradient::{EdgeSampling, Field, Progress, Wanted, WarpedArea};

/// Grounds in whose pixels penumbras lie.
static PENUMBRAS: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let all = DirectKind::ALL.into_iter().flat_map(|kind| {
        (0..14).map(move |i| {
            let moving = DirectMoving::ALL[i as usize % DirectMoving::ALL.len()];
            DirectKnobs { moving, ..DirectKnobs::random(71_000 + i, kind) }
        })
    });
    let known: Vec<Known> = all
        .collect::<Vec<_>>()
        .par_iter()
        .map(|knobs| {
            let case = knobs.build();
            Known::of_direct(&case.scene, 1e-3, &case.label)
        })
        .collect();
    let known: Vec<_> = known.into_iter().filter(|k| k.exact.abs() > 1e-3 * k.value).collect();
    assert!(known.len() >= 30, "{} scenes", known.len());
    known
});

/// What moves over points. A ground that moves at the speed of the world's size moves a thousand pixels of
/// so small a film: such motions are those of [`PENUMBRAS`].
const MOVING: [IrradianceMoving; 4] = [
    IrradianceMoving::Emitter,
    IrradianceMoving::Occluders,
    IrradianceMoving::Vertex,
    IrradianceMoving::GroundRotation,
];

/// Receivers as small as a pixel, under up to four occluders.
static POINTS: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let known = points(&IrradianceKind::GENERIC, 24);
    assert!(known.len() >= 50, "{} scenes", known.len());
    known
});

/// The pixel's field of view: what it sees of the ground is a sixth of the ground's size, and 1/200 of the
/// distance of everything else.
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
    let known: Vec<Known> = all
        .par_iter()
        .map(|knobs| {
            let case = knobs.build();
            Known::of_direct(&seen(&case), 1e-4, &case.label)
        })
        .collect();
    known.into_iter().filter(|k| k.exact.abs() > 1e-3 * k.value).collect()
}

/// One pixel about the receiver.
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

/// Samples a pixel in each run.
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

fn edges(seed: u64, samples: usize) -> EdgeSampling {
    EdgeSampling { samples, primary: samples, secondary: 4 * samples, seed }
}

/// Both halves of every scene's estimate, for a verdict on all of them and on some.
fn halves(known: &[Known], estimate: impl Fn(&Known, u64) -> Estimate + Sync) -> Vec<[Estimate; 2]> {
    known.par_iter().map(|k| [0, 1].map(|half| estimate(k, half))).collect()
}

struct Borrowed<'k>(&'k Known, [Estimate; 2]);

impl Reference for Borrowed<'_> {
    fn exact(&self) -> f64 {
        self.0.exact
    }

    fn label(&self) -> &str {
        &self.0.label
    }
}

/// A method on a set of scenes: the verdict on all of them, and by what moves, as a bias of one kind of motion must not
/// hide among the others. The slope of all must be known to `bound`, at the threshold of the suite.
fn judge(
    name: &str,
    known: &[Known],
    motions: &[&str],
    bound: f64,
    estimate: impl Fn(&Known, u64) -> Estimate + Sync,
) {
    let found = halves(known, estimate);
    let of = |motion: Option<&str>| {
        let moves = |k: &Known| motion.is_none_or(|m| k.label.contains(&format!("moving: {m},")));
        let some: Vec<_> =
            known.iter().zip(&found).filter(|(k, _)| moves(k)).map(|(k, f)| Borrowed(k, *f)).collect();
        let v = Verdict::of(&some, |k, half| k.1[half as usize]);
        println!(
            "{name}, {}: {} scenes, worst |z| {:.2}, slope {:.4} ± {:.4}",
            motion.unwrap_or("all"),
            v.count,
            v.worst,
            v.slope,
            v.slope_error
        );
        assert!(passes(&v), "{name}, {motion:?}: {v:?}");
        v
    };
    let all = of(None);
    assert!(suite_threshold() * all.slope_error < bound, "{name}: {all:?}");
    motions.iter().for_each(|m| drop(of(Some(m))));
}

const PENUMBRA_MOTIONS: [&str; 6] = ["Ground", "GroundRotation", "Camera", "Emitters", "Occluders", "Mixed"];
const POINT_MOTIONS: [&str; 4] = ["Emitter", "Occluders", "Vertex", "GroundRotation"];

/// Of the bounds: half the derivative would be found out in penumbras, and a third of it at receivers, by warped area,
/// whose samples there have heavy tails; a seventh by edge sampling, which hardly finds receivers as small as those
/// and is judged by penumbras alone.
#[test]
fn pixels_with_penumbras() {
    judge("penumbras, warped area", &PENUMBRAS, &PENUMBRA_MOTIONS, 0.6, |k, half| {
        k.estimate(half, &warped())
    });
}

#[test]
fn pixels_with_penumbras_by_edges() {
    judge("penumbras, edge sampling", &PENUMBRAS, &PENUMBRA_MOTIONS, 0.15, |k, half| {
        by_edges(k, half, 4 * SAMPLES)
    });
}

#[test]
fn receivers() {
    judge("receivers, warped area", &POINTS, &POINT_MOTIONS, 0.3, |k, half| k.estimate(half, &pixel()));
}

fn by_edges(k: &Known, half: u64, samples: usize) -> Estimate {
    k.repeated(half, |seed| {
        let found = edges(seed, samples).forward(&k.scene, &k.change, &Progress::none());
        let found = found.unwrap_or_else(|e| panic!("{e}\n{}", k.label));
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, k.label);
        k.weighted(&found.gradient)
    })
}

/// Kinds in which something is hard to see, each by itself: what is found, is said.
#[test]
fn degenerate_kinds() {
    for kind in IrradianceKind::DEGENERATE {
        let known = points(&[kind], 12);
        let method = pixel();
        let v = verdict(&format!("{kind:?}"), &known, |k, half| k.estimate(half, &method));
        println!("{kind:?}: finds {:.1}% ± {:.1}%", 100.0 * v.slope, 100.0 * v.slope_error);
        assert!(passes(&v), "{kind:?}: {v:?}");
    }
}

/// The reference itself: the pixel's quadrature agrees with the irradiance at its centre to the size of
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
    let mut worst = 0.0_f64;
    for k in PENUMBRAS.iter().step_by(2).chain(POINTS.iter().step_by(2)) {
        let method = WarpedArea { samples: 4, seed: 3, ..WarpedArea::default() };
        let image = k.run(&method);
        let forward = k.weighted(&image.gradient);
        // Black surfaces of which the reflectance is wanted are followed farther.
        let materials = vec![false; k.scene.description().materials.len()];
        let wanted = Wanted { materials, ..Wanted::everything(&k.scene) };
        let reverse =
            pulled(method.reverse(&k.scene, &k.weights, &wanted, &Progress::none()).expect("valid"));
        let pairs = reverse.positions.iter().zip(&k.change.positions);
        let scale: f64 = pairs.map(|(g, r)| (*g * *r).abs().element_sum()).sum();
        let error = (reverse.dot(&k.change) - forward).abs() / scale.max(forward.abs()).max(1e-3);
        assert!(error < 1e-9, "{forward} {} {}", reverse.dot(&k.change), k.label);
        worst = worst.max(error);
    }
    println!("forward against reverse: worst {worst:.1e}");
}

#[test]
fn controls_are_rejected() {
    let some: &[Known] = &POINTS[POINTS.len() / 3..POINTS.len() * 2 / 3];
    reject("zero", some, |k, half| Estimate { mean: 0.0, ..k.estimate(half, &pixel()) });
    reject("sign flipped", some, |k, half| {
        let estimate = k.estimate(half, &pixel());
        Estimate { mean: -estimate.mean, ..estimate }
    });
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
    reject("no secondary term", some, |k, half| terms(k, half, &|t, i| t.interior[i] + t.primary[i]));
    // All three together are the whole.
    let v = verdict("terms together", some, |k, half| {
        terms(k, half, &|t, i| t.interior[i] + t.primary[i] + t.secondary[i])
    });
    assert!(passes(&v), "{v:?}");
    let gaussian = with(Warp { weighting: Weighting::Gaussian, focus: 1.0, ..Warp::default() });
    reject("Gaussian weights", some, |k, half| k.estimate(half, &gaussian));
    for rays in [2, 4] {
        let few = with(Warp { debias: Debias::Consistent { rays }, ..Warp::default() });
        reject(&format!("{rays} rays as they are"), some, |k, half| k.estimate(half, &few));
    }
}

/// Light from everywhere past what hides some of it, moving: there is no emitter to sample.
#[test]
fn an_environment_behind_occluders() {
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
        .filter(|k| k.exact.abs() > 1e-3 * k.value)
        .collect();
    assert!(known.len() >= 15, "{}", known.len());
    let many = WarpedArea { samples: 12 * SAMPLES, ..warped() };
    let v = verdict("environment", &known, |k, half| k.estimate(half, &many));
    // Its light has no kernel narrower than that of a diffuse surface: noisier than an emitter's.
    assert!(passes(&v) && v.slope_error < 0.6, "{v:?}");
    let still = WarpedArea { warps: false, ..warped() };
    reject("environment, interior only", &known, |k, half| k.estimate(half, &still));
}
