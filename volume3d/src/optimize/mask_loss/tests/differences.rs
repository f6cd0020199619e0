//! Derivatives against central differences, in random directions of parameters and placement.

use flatland::random::{Stream, open01, stream};
use glam::{DMat3, DVec3};

use super::scenes::{SIZE, ball, left_half, loss, network, outline, scene, turned_grid};
use crate::gradient::ImplicitTangent;
use crate::optimize::{MaskEvaluation, MaskLoss};
use crate::scene::{ImplicitShape, Scene};
use crate::sdf::Baked;
use crate::sdf::network::{Architecture, Network};

/// The number of random directions.
const DIRECTIONS: usize = 4;

fn direction(shape: &ImplicitShape, random: &mut Stream) -> ImplicitTangent {
    let mut number = || open01(random) - 0.5;
    let parameters = shape.surface.parameters().iter().map(|_| number()).collect();
    let mut vector = || DVec3::from_array([(); 3].map(|()| number()));
    ImplicitTangent { parameters, translation: vector(), rotation: vector() }
}

/// The scene with its surface moved h along a direction.
fn moved(scene: &Scene, way: &ImplicitTangent, h: f64) -> Scene {
    let mut shape = scene.description().implicits[0].clone();
    let values = shape.surface.parameters();
    let values: Vec<f64> = values.iter().zip(&way.parameters).map(|(x, v)| x + h * v).collect();
    shape.surface = shape.surface.with_parameters(&values).expect("a surface");
    shape.placement.translation += h * way.translation;
    let turn = h * way.rotation;
    let turn = DMat3::from_axis_angle(turn.normalize(), turn.length());
    shape.placement.rotation = turn * shape.placement.rotation;
    let mut description = scene.description().clone();
    description.implicits[0] = shape;
    Scene::new(description).expect("a scene")
}

fn dot(a: &ImplicitTangent, b: &ImplicitTangent) -> f64 {
    let parameters = a.parameters.iter().zip(&b.parameters).map(|(a, b)| a * b).sum::<f64>();
    parameters + a.translation.dot(b.translation) + a.rotation.dot(b.rotation)
}

/// Norm of the difference between derivatives and central differences over all directions, relative to the
/// norm of the differences; and the same with the derivatives' sign flipped.
fn disagreement(name: &str, scene: &Scene, loss: MaskLoss, mask: &[bool], h: f64) -> [f64; 2] {
    let of = |scene: &Scene| -> MaskEvaluation { loss.of(scene, 0, mask).expect("a loss") };
    let here = of(scene);
    let mut random = stream(6, &[]);
    let (mut right, mut wrong, mut norm) = (0.0, 0.0, 0.0);
    for _ in 0..DIRECTIONS {
        let way = direction(&scene.description().implicits[0], &mut random);
        let (after, before) = (of(&moved(scene, &way, h)), of(&moved(scene, &way, -h)));
        // Pixels that join P_in in between would be a discontinuity.
        for there in [&after, &before] {
            assert_eq!((there.covered, there.missing), (here.covered, here.missing), "{name}");
        }
        let expected = (after.loss - before.loss) / (2.0 * h);
        let found = dot(&here.gradient, &way);
        right += (found - expected).powi(2);
        wrong += (found + expected).powi(2);
        norm += expected * expected;
    }
    let [right, wrong] = [right, wrong].map(|sum: f64| (sum / norm).sqrt());
    let MaskEvaluation { covered, missing, excess, .. } = here;
    println!(
        "{name}, α = {}, {covered} covered, {missing} missing, {excess} in excess: {right:.1e}; with the sign turned {wrong:.2}",
        loss.alpha
    );
    [right, wrong]
}

/// All masks and two values of α; h² times third derivatives, and rounding over h, are below the bound.
fn compare(name: &str, scene: &Scene, h: f64, bound: f64) {
    let count = SIZE.0 * SIZE.1;
    let outline = outline(scene);
    let own = loss().of(scene, 0, &outline).expect("a loss");
    // The search along rays and the path tracer agree on visibility.
    assert_eq!((own.missing, own.excess), (0, 0), "{name}");
    let masks = [
        ("left half", left_half()),
        ("all", vec![true; count]),
        ("none", vec![false; count]),
        ("outline", outline),
    ];
    for (kind, mask) in masks {
        for alpha in [50.0, 400.0] {
            let name = format!("{name}, {kind}");
            let [right, wrong] = disagreement(&name, scene, MaskLoss { alpha, ..loss() }, &mask, h);
            assert!(right < bound && wrong > 1.0, "{name}: {right} {wrong}");
        }
    }
}

#[test]
fn of_a_ball() {
    compare("ball", &scene(ball(0.5)), 1e-6, 1e-6);
}

#[test]
fn of_a_grid() {
    compare("grid", &turned_grid(), 1e-6, 1e-6);
}

#[test]
fn of_a_network() {
    compare("network", &network(), 1e-6, 1e-5);
}

/// A network on a grid is itself searched, in single precision, whose rounding is divided by h.
#[test]
fn of_a_network_on_a_grid() {
    let architecture = Architecture { hidden: 2, width: 32, sharpness: 20.0, frequencies: 0 };
    let network = Network::sphere(architecture, 0.5, 3).expect("a network");
    let corners = (DVec3::splat(-1.2), DVec3::splat(1.2));
    let scene = scene(Baked::new(network, corners, 24).expect("a grid"));
    for mask in [vec![true; SIZE.0 * SIZE.1], vec![false; SIZE.0 * SIZE.1]] {
        let [right, wrong] = disagreement("network on a grid", &scene, loss(), &mask, 1e-4);
        assert!(right < 2e-3 && wrong > 1.0, "{right} {wrong}");
    }
}
