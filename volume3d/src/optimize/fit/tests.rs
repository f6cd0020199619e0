//! Objectives of several views, and fits that are interrupted and resumed.

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;

use crate::Image;
use crate::gradient::tests::comparisons::{Comparisons, statistics};
use crate::gradient::{ActiveParameters, Gradient, GradientError, Progress, WarpedArea, render};
use crate::optimize::tests::scene;
use crate::optimize::{
    Adam, CheckpointError, Fit, FitError, Loss, Objective, ObjectiveError, Optimizer, Parameters, Penalty,
    Plan, Regularizer, Schedule, State, View, read_checkpoint, silhouette_weights, write_checkpoint,
};
use crate::scene::{Camera, Scene};

pub(super) fn reverse(
    scene: &Scene,
    adjoint: &Image,
    active: &ActiveParameters,
    seed: u64,
    progress: &Progress,
) -> Result<Gradient, GradientError> {
    WarpedArea { samples: 2, seed, ..WarpedArea::default() }.reverse(scene, adjoint, active, progress)
}

/// Two views: from the front, with the scene's camera, and from the side.
fn views(scene: &mut Scene, samples: usize) -> Vec<View> {
    let film = scene.description().film;
    let own = scene.description().camera.clone();
    let side = Camera::look_at(DVec3::new(5.0, 2.0, 3.0), DVec3::ZERO, DVec3::Y, 0.7);
    let cameras = [("front", own.clone()), ("side", side)];
    let views = cameras.map(|(name, camera)| {
        scene.set_camera(camera.clone()).unwrap();
        let target = render(scene, samples, 99, &Progress::none()).unwrap().image;
        View { name: name.to_owned(), camera: Some(camera), film, target, weights: None, mask: None }
    });
    scene.set_camera(own).unwrap();
    views.to_vec()
}

/// The scene without its point light, under which nothing may move.
pub(super) fn lit() -> Scene {
    let mut d = scene().description().clone();
    d.lights.clear();
    Scene::new(d).unwrap()
}

pub(super) fn objective(scene: &mut Scene) -> Objective {
    Objective {
        views: views(scene, 16),
        loss: Loss::L2,
        penalties: vec![],
        masks: None,
        silhouettes: None,
        pixels: None,
        image_samples: 2,
    }
}

fn plan(steps: u64) -> Plan {
    Plan { steps, schedule: Schedule::default(), views_per_step: 1, seed: 4 }
}

pub(super) fn fit(scene: &mut Scene, steps: u64) -> Fit {
    let parameters = Parameters::new(scene, &["block.translation", "white.reflectance"]).unwrap();
    let mut x = parameters.values(scene);
    x[0] += 0.2;
    parameters.apply(&x, scene).unwrap();
    let adams = vec![Adam::new(0.02).into(), Adam::new(0.01).uniform().into()];
    let mut fit = Fit::new(parameters, x, objective(scene), adams, plan(steps));
    fit.apply(scene).unwrap();
    // Targets were rendered at the start of the fit: the fit begins elsewhere.
    fit.state = State { x: fit.state.x.iter().map(|x| 0.9 * x).collect(), ..fit.state };
    fit.apply(scene).unwrap();
    fit
}

/// The mean gradient of a squared loss over two views, from images of two samples a pixel, is that of the
/// loss of the true images, by central differences of images with almost no noise. The same holds for random
/// pixels of each view, chosen anew every time.
#[test]
fn gradients_of_squared_losses_are_unbiased() {
    let mut scene = lit();
    let parameters = Parameters::new(&scene, &["white.reflectance"]).unwrap();
    let x = vec![0.4, 0.5, 0.6];
    let objective = Objective { views: views(&mut scene, 4096), ..objective(&mut scene) };
    let loss = |scene: &mut Scene, h: f64, seed: u64| -> f64 {
        parameters.apply(&x.iter().map(|x| x + h).collect::<Vec<_>>(), scene).unwrap();
        let of_view = |scene: &mut Scene, v: usize| {
            objective.look(scene, v).unwrap();
            let image = render(scene, 2048, seed, &Progress::none()).unwrap().image;
            objective.compare(v, &image).unwrap().0
        };
        0.5 * (of_view(scene, 0) + of_view(scene, 1))
    };
    let step = 0.05;
    let differences: Vec<f64> = (0..8)
        .map(|seed| (loss(&mut scene, step, seed) - loss(&mut scene, -step, seed)) / (2.0 * step))
        .collect();
    parameters.apply(&x, &mut scene).unwrap();
    let mut sums = |objective: &Objective, count: u64| -> Vec<f64> {
        let none = Progress::none();
        let mut sum = |seed| {
            let found = objective.evaluate(&mut scene, (&parameters, &x), &[0, 1], seed, &reverse, &none);
            found.unwrap().gradient.iter().sum()
        };
        (0..count).map(&mut sum).collect()
    };
    let some = Objective { pixels: Some(24), ..objective.clone() };
    let (found, of_some) = (statistics(&sums(&objective, 400)), statistics(&sums(&some, 1600)));
    let reference = statistics(&differences);
    let mut comparisons = Comparisons::of("gradients_of_squared_losses_are_unbiased");
    comparisons.add("two views".to_owned(), found, reference, 0.0, reference.0);
    comparisons.add("24 of 64 pixels".to_owned(), of_some, reference, 0.0, reference.0);
    comparisons.finish();
}

/// Chosen pixels and their derivatives equal those of a step over all pixels, times 64 by their number. All
/// pixels are chosen equally often.
#[test]
fn some_pixels_are_as_they_are_among_all() {
    let mut scene = lit();
    let parameters = Parameters::new(&scene, &["white.reflectance"]).unwrap();
    let x = parameters.values(&scene);
    let whole = Objective { views: views(&mut scene, 16), ..objective(&mut scene) };
    let adjoint_of = |objective: &Objective, scene: &mut Scene, seed: u64| {
        let kept = std::cell::RefCell::new(vec![]);
        let keep = |scene: &Scene, adjoint: &Image, active: &_, seed, progress: &_| {
            kept.borrow_mut().clone_from(&adjoint.pixels);
            reverse(scene, adjoint, active, seed, progress)
        };
        objective.evaluate(scene, (&parameters, &x), &[0], seed, &keep, &Progress::none()).unwrap();
        kept.into_inner()
    };
    let mut counts = vec![0.0_f64; 64];
    for pixels in [1, 24, 63] {
        let some = Objective { pixels: Some(pixels), ..whole.clone() };
        for seed in 0..100 {
            let chosen = some.chosen(0, seed).unwrap().expect("not all");
            assert_eq!(chosen.iter().filter(|chosen| **chosen).count(), pixels);
            chosen.iter().zip(&mut counts).for_each(|(chosen, count)| *count += f64::from(u8::from(*chosen)));
        }
        let (all, adjoint) = (adjoint_of(&whole, &mut scene, 3), adjoint_of(&some, &mut scene, 3));
        let chosen = some.chosen(0, stream(3, &[0]).next_u64()).unwrap().expect("not all");
        let scale = 64.0 / pixels as f64;
        for (i, chosen) in chosen.into_iter().enumerate() {
            let expected = if chosen { scale * all[i] } else { DVec3::ZERO };
            assert!(adjoint[i].distance(expected) <= 1e-15 * scale, "{i}");
        }
    }
    // 8800 choices, 137.5 of each pixel, with a standard deviation of about 6 each.
    assert!(counts.iter().all(|count| (count - 137.5).abs() < 30.0), "{counts:?}");
    let none = Objective { pixels: Some(0), ..whole.clone() };
    let blocks = Objective { pixels: Some(3), loss: Loss::Multiscale { levels: 2 }, ..whole.clone() };
    for refused in [none, blocks] {
        let found = refused.evaluate(&mut scene, (&parameters, &x), &[0], 1, &reverse, &Progress::none());
        assert!(matches!(found, Err(ObjectiveError::Pixels { .. })));
    }
    assert_eq!(Objective { pixels: Some(64), ..whole }.chosen(0, 1), Ok(None));
}

#[test]
fn weights_choose_what_counts() {
    let mut scene = lit();
    let mut objective = objective(&mut scene);
    let image = Image::constant(8, 8, DVec3::ONE);
    let (plain, whole) = objective.compare(0, &image).unwrap();
    objective.views[0].weights = Some(Image::constant(8, 8, DVec3::splat(2.0)));
    let (twice, adjoint) = objective.compare(0, &image).unwrap();
    assert!((twice - 4.0 * plain).abs() < 1e-12 * plain);
    assert!(adjoint.pixels.iter().zip(&whole.pixels).all(|(a, w)| (*a - 4.0 * *w).length() < 1e-12));
    objective.views[0].weights = Some(Image::constant(8, 8, DVec3::ZERO));
    assert_eq!(objective.compare(0, &image).unwrap(), (0.0, Image::constant(8, 8, DVec3::ZERO)));
    objective.views[0].weights = Some(Image::constant(8, 7, DVec3::ONE));
    assert!(matches!(objective.compare(0, &image), Err(ObjectiveError::Weights { .. })));
    objective.views[0].camera = None;
    let error = objective.look(&mut scene, 0).unwrap_err();
    assert_eq!(error, ObjectiveError::Camera { view: "front".to_owned() });
    objective.views[0].target = Image::constant(3, 8, DVec3::ONE);
    objective.views[0].weights = None;
    assert!(matches!(objective.compare(0, &image), Err(ObjectiveError::Loss { .. })));
}

/// Seen from the front, the block is a rectangle in the middle.
#[test]
fn silhouettes_have_pixels_around_them() {
    let scene = lit();
    let block = scene.shape("block").unwrap();
    let [thin, wide] = [0, 1].map(|reach| silhouette_weights(&scene, &[block], reach));
    let count = |image: &Image| image.pixels.iter().filter(|w| **w == DVec3::ONE).count();
    let at = |image: &Image, x: usize, y: usize| image.pixels[8 * y + x];
    // The block is four pixels wide: neither its middle nor the corner of the picture is next to its border.
    assert!(count(&thin) >= 12 && count(&thin) < count(&wide), "{thin:?} {wide:?}");
    assert_eq!((at(&thin, 0, 0), at(&thin, 3, 4), at(&wide, 3, 4)), (DVec3::ZERO, DVec3::ZERO, DVec3::ONE));
    // No shapes, and a loss restricted to silhouettes.
    assert_eq!(count(&silhouette_weights(&scene, &[], 1)), 0);
    let mut scene = scene;
    let parameters = Parameters::new(&scene, &["block.translation"]).unwrap();
    let x = parameters.values(&scene);
    let whole = objective(&mut scene);
    let near = Objective { silhouettes: Some(0), ..whole.clone() };
    let [whole, near] = [whole, near].map(|objective| {
        objective.evaluate(&mut scene, (&parameters, &x), &[0], 3, &reverse, &Progress::none()).unwrap()
    });
    assert!(near.loss > 0.0 && near.loss < whole.loss && near.gradient != whole.gradient);
}

/// Gradients of penalties of a placed mesh with free vertices, against differences.
#[test]
fn penalties_have_gradients() {
    let mut scene = lit();
    let parameters = Parameters::new(&scene, &["block.vertex_positions", "block.scale"]).unwrap();
    let mut x = parameters.values(&scene);
    x.iter_mut().enumerate().for_each(|(i, x)| *x += 0.1 * (3.7 * i as f64).sin());
    let shape = scene.shape("block").unwrap();
    let penalties = vec![Penalty::Mesh { shape, regularizer: Regularizer::Laplacian, weight: 3.0 }];
    // All pictures have weight 0.
    let mut objective = Objective { penalties, ..objective(&mut scene) };
    objective.views.iter_mut().for_each(|v| v.weights = Some(Image::constant(8, 8, DVec3::ZERO)));
    let mut at = |x: &[f64]| {
        parameters.apply(x, &mut scene).unwrap();
        objective.evaluate(&mut scene, (&parameters, x), &[1], 0, &reverse, &Progress::none()).unwrap()
    };
    let found = at(&x);
    assert!(found.loss == 0.0 && found.penalty > 0.0);
    for i in [0, 4, 11, 24] {
        let mut moved = |h: f64| {
            let mut x = x.clone();
            x[i] += h;
            at(&x).penalty
        };
        let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!((difference - found.gradient[i]).abs() < 1e-6, "{i}: {difference} {}", found.gradient[i]);
    }
}

#[test]
fn a_fit_goes_on_to_the_same_bits() {
    let (mut scene, none) = (lit(), Progress::none());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.bin");
    assert!(read_checkpoint(&path, 7).unwrap().is_none());
    let mut whole = fit(&mut scene, 6);
    for _ in 0..4 {
        whole.step(&mut scene, &reverse, &none).unwrap();
    }
    write_checkpoint(&path, whole.state(), 7).unwrap();
    let kept = whole.state().clone();
    while !whole.is_done() {
        whole.step(&mut scene, &reverse, &none).unwrap();
    }
    // After the last step nothing happens.
    let done = whole.state().clone();
    whole.step(&mut scene, &reverse, &none).unwrap();
    assert_eq!(&done, whole.state());

    let mut again = lit();
    let read = read_checkpoint(&path, 7).unwrap().unwrap();
    assert_eq!(read, kept);
    let mut resumed = fit(&mut again, 6).resumed(read, &mut again).unwrap();
    resumed.apply(&mut again).unwrap();
    while !resumed.is_done() {
        resumed.step(&mut again, &reverse, &none).unwrap();
    }
    assert_eq!(resumed.state(), &done);
    assert_eq!(again.description(), scene.description());
    assert!(fit(&mut again, 3).resumed(done.clone(), &mut again).is_err());
    let fewer = Parameters::new(&again, &["block.scale"]).unwrap();
    let x = fewer.values(&again);
    let other = Fit::new(fewer, x, objective(&mut again), vec![Adam::new(0.1).into()], plan(9));
    assert!(other.resumed(done, &mut again).is_err());

    assert!(matches!(read_checkpoint(&path, 8), Err(CheckpointError::Other { .. })));
    let mut bytes = std::fs::read(&path).unwrap();
    for (at, _) in bytes.clone().iter().enumerate().step_by(41) {
        bytes[at] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        assert!(read_checkpoint(&path, 7).is_err(), "byte {at}");
        bytes[at] ^= 1;
    }
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(matches!(read_checkpoint(&path, 7), Err(CheckpointError::Format { .. })));
    assert!(matches!(read_checkpoint(folder.path(), 7), Err(CheckpointError::File(_))));
}

#[test]
fn every_view_has_its_turn() {
    let mut scene = lit();
    let mut objective = objective(&mut scene);
    let view = objective.views[0].clone();
    objective.views = (0..5).map(|i| View { name: i.to_string(), ..view.clone() }).collect();
    let parameters = Parameters::new(&scene, &["white.reflectance"]).unwrap();
    let x = parameters.values(&scene);
    let fit = Fit::new(parameters, x, objective, vec![Adam::new(0.1).into()], plan(100));
    let order: Vec<usize> = (0..20).flat_map(|t| fit.views(t)).collect();
    for round in order.chunks(5) {
        let mut round = round.to_vec();
        round.sort_unstable();
        assert_eq!(round, [0, 1, 2, 3, 4]);
    }
    assert!(order[..5] != order[5..10] || order[5..10] != order[10..15], "{order:?}");
}

/// A fit that fails reports the reason, and leaves the state as it was.
#[test]
fn failures_lose_nothing() {
    let (mut scene, none) = (lit(), Progress::none());
    let mut failing = fit(&mut scene, 6);
    failing.step(&mut scene, &reverse, &none).unwrap();
    let before = failing.state().clone();
    let broken =
        |scene: &Scene, adjoint: &Image, active: &ActiveParameters, seed: u64, progress: &Progress| {
            let mut gradient = reverse(scene, adjoint, active, seed, progress)?;
            gradient.by_parameter.reflectance[0].y = f64::NAN;
            Ok(gradient)
        };
    let error = failing.step(&mut scene, &broken, &none).unwrap_err();
    assert_eq!(error, FitError::NotFinite { parameter: "white.reflectance".to_owned() });
    let huge = |scene: &Scene, adjoint: &Image, active: &ActiveParameters, seed: u64, progress: &Progress| {
        reverse(scene, &adjoint.with_pixels(vec![DVec3::ZERO; 64]), active, seed, progress)
    };
    // Far worse than at first, and than a black picture; the first alone is not a criterion.
    let mut far = failing.clone();
    far.state.records[0].loss = 1e-9;
    far.step(&mut scene, &huge, &none).unwrap();
    let mut far = failing.clone();
    far.state.records[0].loss = 1e-9;
    far.objective.views.iter_mut().for_each(|v| v.target = Image::constant(8, 8, DVec3::splat(1e-3)));
    assert!(matches!(far.step(&mut scene, &huge, &none), Err(FitError::Diverges { .. })));
    assert_eq!(failing.state(), &before);
    // The back of the page is invisible in all views, and the block is visible in all.
    let mut hidden = fit(&mut scene, 6);
    assert!(hidden.unseen(&mut scene, 0, &reverse, &none).unwrap().is_empty());
    let away = Camera::look_at(DVec3::new(0.0, 0.0, 50.0), DVec3::new(0.0, 0.0, 100.0), DVec3::Y, 0.7);
    hidden.objective.views[1].camera = Some(away);
    assert_eq!(hidden.unseen(&mut scene, 1, &reverse, &none).unwrap(), [0, 1]);
}

/// Clamped derivatives are counted, and none is without a clamp.
#[test]
fn clamped_derivatives_are_counted() {
    let none = Progress::none();
    let mut scene = lit();
    let mut free = fit(&mut scene, 1);
    free.step(&mut scene, &reverse, &none).unwrap();
    let found = &free.state().records[0];
    assert_eq!(found.clamped, 0);
    let mut scene = lit();
    let mut cut = fit(&mut scene, 1);
    cut.optimizers.iter_mut().for_each(|o| o.clamp = Some(1e-12));
    cut.step(&mut scene, &reverse, &none).unwrap();
    let clamped = &cut.state().records[0];
    let moving = found.norms.iter().zip([3, 3]).map(|(norm, count)| if *norm > 0.0 { count } else { 0 });
    assert_eq!(clamped.clamped, moving.sum::<usize>());
    assert_eq!(clamped.norms, found.norms);
    let optimizer = Optimizer { clamp: Some(2.0), ..Adam::new(1.0).into() };
    assert_eq!(optimizer.clamped(&[1.0, -3.0, 2.0, 7.0]), (vec![1.0, -2.0, 2.0, 2.0].into(), 2));
}

#[test]
fn schedules_fall_from_one_to_their_end() {
    for schedule in [Schedule::Cosine { end: 0.1 }, Schedule::Exponential { end: 0.1 }] {
        let factors: Vec<f64> = (0..=10).map(|t| schedule.factor(t, 10)).collect();
        assert!(factors.windows(2).all(|w| w[1] < w[0]), "{factors:?}");
        assert!((factors[0] - 1.0).abs() < 1e-15 && (factors[10] - 0.1).abs() < 1e-15, "{factors:?}");
        assert!(schedule.problem().is_none());
    }
    assert_eq!(Schedule::Constant {}.factor(7, 10), 1.0);
    assert!(Schedule::Exponential { end: 0.0 }.problem().is_some());
    assert!(Schedule::Cosine { end: f64::NAN }.problem().is_some());
}

/// Steady gradients are signal, and noise around 0 is none.
#[test]
fn adam_tells_signal_from_noise() {
    let (mut steady, mut noisy) = (Adam::new(0.1), Adam::new(0.1));
    let mut random = stream(3, &[]);
    for _ in 0..2000 {
        steady.step(&[2.0, -1.0]);
        let noise = [0, 1].map(|_| flatland::random::open01(&mut random) - 0.5);
        noisy.step(&noise);
    }
    assert!((steady.signal() - 1.0).abs() < 1e-9, "{}", steady.signal());
    assert!(noisy.signal() < 0.3, "{}", noisy.signal());
    assert_eq!(Adam::new(0.1).signal(), 0.0);
}

/// The mean of parameters changes no step, varies less than they do, and resumes bit for bit from a file.
#[test]
fn means_of_parameters_follow_and_go_on() {
    let steps = 24;
    let begun = |scene: &mut Scene, decay: Option<f64>| {
        let mut fit = fit(scene, steps);
        fit.plan.schedule = Schedule::Constant {};
        if let Some(decay) = decay { fit.averaged(decay) } else { fit }
    };
    let run = |fit: &mut Fit, scene: &mut Scene| {
        let mut found = vec![];
        while !fit.is_done() {
            fit.step(scene, &reverse, &Progress::none()).unwrap();
            found.push((fit.state().clone(), fit.result().to_vec()));
        }
        found
    };
    let mut scene = lit();
    let mut plain = begun(&mut scene, None);
    run(&mut plain, &mut scene);
    assert_eq!(plain.result(), plain.state().x);
    let mut scene = lit();
    let mut whole = begun(&mut scene, Some(0.9));
    let found = run(&mut whole, &mut scene);
    assert_eq!(whole.state().x, plain.state().x);
    assert_ne!(whole.result(), whole.state().x);
    whole.apply_result(&mut scene).unwrap();
    // Translations are relative to the block's current position; reflectances are absolute.
    assert_eq!(whole.parameters().values(&scene)[3..], whole.result()[3..]);
    // x̄ + w (x − x̄) after every step, with w = max(1 − β, 1/t), of the numbers that are not relative to a
    // moving position.
    let mut expected = vec![0.0; whole.state().x.len() - 3];
    for (t, (state, mean)) in (1..).zip(&found) {
        let weight = f64::max(0.1, 1.0 / f64::from(t));
        expected.iter_mut().zip(&state.x[3..]).for_each(|(mean, x)| *mean += weight * (x - *mean));
        let off = expected.iter().zip(&mean[3..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-13, "step {t}: {off:.1e}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.bin");
    for at in [0, 7, 15] {
        write_checkpoint(&path, &found[at].0, 7).unwrap();
        let state = read_checkpoint(&path, 7).unwrap().expect("a state");
        assert!(state == found[at].0);
        let mut scene = lit();
        let mut resumed = begun(&mut scene, Some(0.9)).resumed(state.clone(), &mut scene).expect("its state");
        resumed.apply(&mut scene).unwrap();
        run(&mut resumed, &mut scene);
        assert!(resumed.state() == whole.state() && resumed.result() == whole.result(), "{at}");
        // The state of a fit without a mean is refused by a fit with one, and the reverse.
        assert!(begun(&mut scene, None).resumed(state, &mut scene).is_err());
        assert!(begun(&mut scene, Some(0.9)).resumed(plain.state().clone(), &mut scene).is_err());
    }
}
