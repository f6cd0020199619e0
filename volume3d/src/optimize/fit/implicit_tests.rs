//! Fits of implicit surfaces.

use flatland::sdf::shapes::{Ball, Parametric as _};
use glam::DVec3;

use crate::Image;
use crate::gradient::{
    ActiveParameters, Estimator, Gradient, GradientError, Progress, Tangent, WarpedArea, render,
};
use crate::optimize::{
    Adam, Fit, FitError, GridSteps, Loss, Objective, Optimizer, Parameters, Penalty, Plan, Problem, Schedule,
    TaskError, View,
};
use crate::scene::{Camera, Description, Environment, Film, Filter, Material, Scene};
use crate::sdf::network::{Architecture, Network};
use crate::sdf::{Baked, Grid, Guided, Interpolation, Slopes, redistance};

/// A black object in front of the sky.
fn scene(surface: impl crate::scene::Implicit) -> Scene {
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, 0.7);
    let film =
        Film { width: 12, height: 12, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } };
    let mut description = Description::new(camera, film);
    description.integrator.max_depth = Some(1);
    description.environment = Some(Environment::Constant { id: "sky".into(), radiance: DVec3::ONE });
    let black = description.add_material(Material::diffuse("black", DVec3::ZERO));
    description.add_implicit("shape", surface, black);
    Scene::new(description).expect("a scene")
}

fn sampled(radius: f64) -> Grid {
    let box_of = (DVec3::splat(-1.5), DVec3::splat(1.5));
    Grid::sampled(Interpolation::Cubic, box_of, 12, |x| x.length() - radius).expect("a grid")
}

fn fit(scene: &Scene, target: &Scene, steps: u64, optimizer: Optimizer) -> Fit {
    let parameters = Parameters::new(scene, &["shape.sdf"]).expect("a surface");
    let film = scene.description().film;
    let target = render(target, 256, 9, &Progress::none()).expect("an image").image;
    let view = View { name: "front".to_owned(), camera: None, film, target, weights: None, mask: None };
    let (loss, penalties) = (Loss::L2, vec![]);
    let objective = Objective {
        views: vec![view],
        loss,
        penalties,
        masks: None,
        silhouettes: None,
        pixels: None,
        image_samples: 16,
    };
    let plan = Plan { steps, schedule: Schedule::default(), views_per_step: 1, seed: 4 };
    let x = parameters.values(scene);
    Fit::new(parameters, x, objective, vec![optimizer], plan)
}

fn reverse(
    scene: &Scene,
    adjoint: &Image,
    active: &ActiveParameters,
    seed: u64,
    progress: &Progress,
) -> Result<Gradient, GradientError> {
    WarpedArea { samples: 8, seed, ..WarpedArea::default() }.reverse(scene, adjoint, active, progress)
}

fn step(fit: &mut Fit, scene: &mut Scene) -> Result<(), FitError> {
    fit.step(scene, &reverse, &Progress::none())
}

fn run(fit: &mut Fit, scene: &mut Scene) -> Result<(), FitError> {
    while !fit.is_done() {
        step(fit, scene)?;
    }
    Ok(())
}

/// A ball of radius 0.7 becomes one of 0.9 in a picture, and its nodes stay distances.
#[test]
fn a_grid_grows_to_its_outline() {
    let (mut scene, target) = (scene(sampled(0.7)), scene(sampled(0.9)));
    let grid_steps = GridSteps { redistance: true, ..GridSteps::default() };
    let optimizer = Optimizer { grid: Some(grid_steps), ..Adam::new(0.02).into() };
    let mut fit = fit(&scene, &target, 24, optimizer);
    run(&mut fit, &mut scene).expect("a fit");
    let grid = |scene: &Scene| scene.description().implicits[0].surface.downcast::<Grid>().cloned();
    let found = grid(&scene).expect("a grid");
    let losses: Vec<f64> = fit.state().records.iter().map(|r| r.loss).collect();
    println!("{losses:?}");
    assert!(losses[23] < 0.2 * losses[0], "{losses:?}");
    let again = redistance(&found, Slopes::Overall).expect("distances");
    let moved = found.nodes().iter().zip(again.nodes()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved < 1e-6, "{moved}");
}

fn network() -> Scene {
    let architecture = Architecture { hidden: 2, width: 32, sharpness: 20.0, frequencies: 0 };
    let network = Network::sphere(architecture, 0.7, 4).expect("a network");
    scene(Baked::new(network, (DVec3::splat(-1.5), DVec3::splat(1.5)), 12).expect("a grid"))
}

/// A network's grid is refined during the fit, the number of weights stays, and the fit resumes bit for bit.
#[test]
fn a_network_grows_to_its_outline() {
    let target = scene(sampled(0.9));
    let grid_steps = GridSteps { refine: vec![8], ..GridSteps::default() };
    let optimizer = Optimizer { grid: Some(grid_steps), ..Adam::new(0.01).into() };
    let begun = |scene: &Scene| {
        let mut fit = fit(scene, &target, 16, optimizer.clone());
        fit.objective.penalties = vec![Penalty::Eikonal { implicit: 0, weight: 0.1 }];
        fit
    };
    let cells = |scene: &Scene| {
        scene.description().implicits[0].surface.downcast().map(Baked::cells).expect("a network")
    };
    let mut first = network();
    let mut whole = begun(&first);
    let mut states = vec![whole.state().clone()];
    while !whole.is_done() {
        step(&mut whole, &mut first).expect("a step");
        states.push(whole.state().clone());
    }
    let losses: Vec<f64> = whole.state().records.iter().map(|r| r.loss).collect();
    assert!(losses[15] < 0.2 * losses[0], "{losses:?}");
    assert!(whole.state().records.iter().all(|record| record.penalty > 0.0));
    assert_eq!(cells(&first), 24);
    for at in [7, 8, 12] {
        let mut again = network();
        let resumed = begun(&again).resumed(states[at].clone(), &mut again);
        let mut resumed = resumed.expect("a state of this fit");
        resumed.apply(&mut again).expect("weights");
        // Its tasks are refused elsewhere once the grid is finer, as nothing there would tell.
        let problem = Problem::new(&network(), &resumed.parameters, &Estimator::default());
        let task = resumed.ask(problem).swap_remove(0);
        let found = task.run(
            problem,
            &mut network(),
            (&resumed.objective, &resumed.parameters),
            &reverse,
            &Progress::none(),
        );
        let replaced = TaskError::Replaced { parameter: "shape.sdf".to_owned() };
        assert_eq!(found.err(), (at >= 8).then_some(replaced));
        run(&mut resumed, &mut again).expect("a fit");
        assert!(resumed.state() == whole.state(), "{at}");
        assert!(again.description().implicits == first.description().implicits, "{at}");
    }
}

/// At the end the network itself is traced, with the same bits if the fit is interrupted before or after.
#[test]
fn a_network_is_finished_on_itself() {
    let target = scene(sampled(0.9));
    let grid_steps = GridSteps { refine: vec![8], finish: Some(16), ..GridSteps::default() };
    let optimizer = Optimizer { grid: Some(grid_steps), ..Adam::new(0.01).into() };
    let begun = |scene: &Scene| {
        let mut fit = fit(scene, &target, 20, optimizer.clone());
        fit.objective.penalties = vec![Penalty::Eikonal { implicit: 0, weight: 0.1 }];
        fit.objective.pixels = Some(72);
        fit
    };
    let itself = |scene: &Scene| scene.description().implicits[0].surface.downcast::<Guided>().cloned();
    let mut first = network();
    let mut whole = begun(&first);
    let mut states = vec![whole.state().clone()];
    while !whole.is_done() {
        assert_eq!(itself(&first).is_some(), whole.steps_taken() >= 16);
        step(&mut whole, &mut first).expect("a step");
        states.push(whole.state().clone());
    }
    let losses: Vec<f64> = whole.state().records.iter().map(|r| r.loss).collect();
    println!("{losses:?}, {:?}", first.trace_counts());
    assert!(losses[19] < 0.2 * losses[0], "{losses:?}");
    for at in [15, 16, 18] {
        let mut again = network();
        let resumed = begun(&again).resumed(states[at].clone(), &mut again);
        let mut resumed = resumed.expect("a state of this fit");
        resumed.apply(&mut again).expect("weights");
        run(&mut resumed, &mut again).expect("a fit");
        assert!(resumed.state() == whole.state(), "{at}");
        assert!(again.description().implicits == first.description().implicits, "{at}");
    }
    let optimizer =
        Optimizer { grid: Some(GridSteps { finish: Some(1), ..GridSteps::default() }), ..optimizer };
    let mut grid = scene(sampled(0.7));
    let error = run(&mut fit(&grid, &target, 2, optimizer), &mut grid).expect_err("no network");
    assert_eq!(error, FitError::NoNetwork { parameter: "shape.sdf".to_owned() });
}

/// Gradients of a network traced directly, forward and reverse.
#[test]
fn gradients_reach_the_weights_of_a_network_itself() {
    let baked: Baked = network().description().implicits[0].surface.downcast().cloned().expect("a network");
    let scene = scene(Guided::new(baked));
    let method = WarpedArea { samples: 4, seed: 3, ..WarpedArea::default() };
    let adjoint = Image::constant(12, 12, DVec3::new(0.3, 0.5, 0.2));
    let active = ActiveParameters::everything(&scene);
    let reverse = method.reverse(&scene, &adjoint, &active, &Progress::none()).expect("a gradient");
    let by_weights = &reverse.by_parameter.implicits[0].parameters;
    let mut change = Tangent::still(&scene);
    change.implicits[0].parameters = (0..by_weights.len()).map(|i| (1.7 * i as f64).sin()).collect();
    let forward = method.forward(&scene, &change, &Progress::none()).expect("a derivative");
    let along: f64 = forward.gradient.pixels.iter().map(|p| p.dot(adjoint.pixels[0])).sum();
    let found: f64 = by_weights.iter().zip(&change.implicits[0].parameters).map(|(a, b)| a * b).sum();
    assert!(along.abs() > 1e-3 && (along - found).abs() < 1e-5 * along.abs(), "{along} {found}");
}

/// Weight gradients by the chain rule equal those from the nodes' gradient, forward and reverse.
#[test]
fn gradients_reach_the_weights() {
    let scene = network();
    let method = WarpedArea { samples: 4, seed: 3, ..WarpedArea::default() };
    let adjoint = Image::constant(12, 12, DVec3::new(0.3, 0.5, 0.2));
    let active = ActiveParameters::everything(&scene);
    let reverse = method.reverse(&scene, &adjoint, &active, &Progress::none()).expect("a gradient");
    let by_weights = &reverse.by_parameter.implicits[0].parameters;
    let mut change = Tangent::still(&scene);
    let rates = (0..by_weights.len()).map(|i| (1.7 * i as f64).sin());
    change.implicits[0].parameters = rates.collect();
    let forward = method.forward(&scene, &change, &Progress::none()).expect("a derivative");
    let along: f64 = forward.gradient.pixels.iter().map(|p| p.dot(adjoint.pixels[0])).sum();
    let found: f64 = by_weights.iter().zip(&change.implicits[0].parameters).map(|(a, b)| a * b).sum();
    assert!(along.abs() > 1e-3 && (along - found).abs() < 1e-5 * along.abs(), "{along} {found}");
    // The same surface as a plain grid.
    let baked: Baked = scene.description().implicits[0].surface.downcast().cloned().expect("a network");
    let as_grid = self::scene(baked.grid().clone());
    let active = ActiveParameters::everything(&as_grid);
    let by_nodes = method.reverse(&as_grid, &adjoint, &active, &Progress::none()).expect("a gradient");
    assert_eq!(&baked.pull_back(by_nodes.by_parameter.implicits[0].parameters.clone()), by_weights);
}

#[test]
fn distances_are_asked_of_grids_only() {
    let ball = Ball::new(DVec3::ZERO, 0.7).expect("a ball");
    let (mut scene, target) = (scene(ball), scene(sampled(0.9)));
    let optimizer = Optimizer { grid: Some(GridSteps::default()), ..Adam::new(0.02).into() };
    let mut fit = fit(&scene, &target, 1, optimizer);
    let error = run(&mut fit, &mut scene).expect_err("no grid");
    assert_eq!(error, FitError::NoGrid { parameter: "shape.sdf".to_owned() });
}

/// Refinement from 6 cells to 12 and 24, with the same bits if the fit is interrupted in the middle.
#[test]
fn grids_become_finer_and_fits_go_on() {
    let target = scene(sampled(0.9));
    let coarse = || {
        let box_of = (DVec3::splat(-1.5), DVec3::splat(1.5));
        scene(Grid::sampled(Interpolation::Cubic, box_of, 6, |x| x.length() - 0.7).expect("a grid"))
    };
    let grid_steps = GridSteps { smoothing: 1.0, redistance: true, refine: vec![4, 8], finish: None };
    let optimizer = Optimizer { grid: Some(grid_steps), ..Adam::new(0.1).into() };
    let begun = |scene: &Scene| fit(scene, &target, 12, optimizer.clone()).averaged(0.8);
    let mut first = coarse();
    let mut whole = begun(&first);
    let mut states = vec![whole.state().clone()];
    let mut lengths = vec![whole.state().x.len()];
    while !whole.is_done() {
        step(&mut whole, &mut first).expect("a step");
        states.push(whole.state().clone());
        lengths.push(whole.state().x.len());
        assert_eq!(whole.result().len(), whole.state().x.len());
        assert_eq!(whole.parameters().values(&first), whole.state().x);
    }
    assert_eq!(
        lengths,
        [[343; 4], [2197; 4], [15625; 4]].as_flattened().iter().copied().chain([15625]).collect::<Vec<_>>()
    );
    let losses: Vec<f64> = whole.state().records.iter().map(|r| r.loss).collect();
    assert!(losses[11] < 0.3 * losses[0], "{losses:?}");
    // The mean is a surface, between those of the last steps.
    whole.apply_result(&mut first).expect("a surface");
    let radius = |scene: &Scene| {
        let hit = scene.closest(DVec3::Z * 4.0, -DVec3::Z, None).expect("a hit");
        4.0 - hit.distance
    };
    let of_mean = radius(&first);
    whole.apply(&mut first).expect("a surface");
    println!("radius {} and of the mean {of_mean}", radius(&first));
    assert!(of_mean != radius(&first) && (of_mean - radius(&first)).abs() < 0.1);
    for at in [3, 4, 9] {
        let mut again = coarse();
        let resumed = begun(&again).resumed(states[at].clone(), &mut again);
        let mut resumed = resumed.expect("a state of this fit");
        resumed.apply(&mut again).expect("values of this scene");
        run(&mut resumed, &mut again).expect("a fit");
        assert!(resumed.state() == whole.state(), "{at}");
        assert!(again.description().implicits == first.description().implicits, "{at}");
    }
}

/// The state of a finer fit is refused before any grid is refined.
#[test]
fn states_of_other_fits_change_nothing() {
    let target = scene(sampled(0.9));
    let grid_steps = GridSteps { smoothing: 1.0, redistance: true, refine: vec![1], finish: None };
    let optimizer = Optimizer { grid: Some(grid_steps), ..Adam::new(0.1).into() };
    let mut first = scene(sampled(0.7));
    let mut fine = fit(&first, &target, 2, optimizer.clone());
    run(&mut fine, &mut first).expect("a fit");
    let before = first.description().clone();
    let other = fit(&first, &target, 2, optimizer).resumed(fine.state().clone(), &mut first);
    assert!(other.is_err() && *first.description() == before);
}
