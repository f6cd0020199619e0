//! Grids: a cubic one has no noticeable bias; a trilinear one, with ∇φ discontinuous between cells, has a
//! bias that no refinement removes.

use std::f64::consts::TAU;

use flatland::sdf::fields::BangaruField;
use flatland::sdf::shapes::Parametric as _;
use flatland::sdf::{Sdf as _, Tracer, View};
use glam::DVec3;
use rayon::prelude::*;
use tests::effort::{pick, thorough};
use tests::power::Power;
use volume3d::sdf::{Grid, Interpolation};

use super::case::{Case, Shading, Terms};
use super::outputs::Outputs;
use super::{ONE, vicini};

/// White in front of black: only the outline contributes to the derivative.
const FLAT: Shading = Shading { base: 1.0, position: DVec3::ZERO, normal: DVec3::ZERO, background: 0.0 };

/// A grid is not a distance between its nodes, and few rays pass near its outline.
const TRACER: Tracer = Tracer { step_scale: 1.0, tolerance: 1e-7, max_steps: 6000, far: 6.0 };

/// Directions around the outline, and bisections of the angle from the axis.
const AROUND: u32 = 300;
const BISECTIONS: usize = 44;

/// Step of the reference: every node changes by its rate times this.
const STEP: f64 = 1e-4;

/// The ball of [`ONE`] in 32³ cells, and the rates of all nodes as it moves.
fn moving_ball(interpolation: Interpolation) -> (Grid, Vec<f64>) {
    let ball = ONE[0];
    let box_around = (DVec3::new(-2.2, -2.2, -0.2), DVec3::new(4.2, 4.2, 6.2));
    let sampled = |value: &(dyn Fn(DVec3) -> f64 + Sync)| {
        Grid::sampled(interpolation, box_around, 32, value).expect("a grid")
    };
    let grid = sampled(&|x| (x - ball.centre).length() - ball.radius);
    let rate = |index| -(grid.position(index) - ball.centre).normalize_or_zero().dot(ball.velocity);
    let rates = (0..grid.nodes().len()).map(rate).collect();
    (grid, rates)
}

/// The angle from an axis beyond which rays miss, in the plane of the axis and an orthogonal direction.
fn outline(grid: &Grid, axis: DVec3, across: DVec3) -> f64 {
    let view = View { sdf: grid, eye: DVec3::ZERO, start: 0.0, tracer: TRACER };
    let (mut low, mut high) = (0.0, 0.6);
    for _ in 0..BISECTIONS {
        let middle: f64 = 0.5 * (low + high);
        let hit = view.trace(axis * middle.cos() + across * middle.sin()).hit().is_some();
        if hit { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// ∮ h v dl with the outline's speed from central differences.
fn exact(grid: &Grid, rates: &[f64], outputs: Outputs) -> Vec<f64> {
    let moved = |h: f64| {
        let nodes: Vec<f64> = grid.nodes().iter().zip(rates).map(|(n, r)| n + h * r).collect();
        grid.with_parameters(&nodes).expect("still a grid")
    };
    let [after, before] = [moved(STEP), moved(-STEP)];
    let axis = ONE[0].centre.normalize();
    let (s, t) = axis.any_orthonormal_pair();
    let parts: Vec<Vec<f64>> = (0..AROUND)
        .into_par_iter()
        .map(|k| {
            let (sin, cos) = (TAU * (f64::from(k) + 0.5) / f64::from(AROUND)).sin_cos();
            let across = s * cos + t * sin;
            let [a, b] = [&after, &before].map(|grid| outline(grid, axis, across));
            let psi = 0.5 * (a + b);
            let flux = (a - b) / (2.0 * STEP) * psi.sin() * TAU / f64::from(AROUND);
            outputs
                .weights(axis * psi.cos() + across * psi.sin())
                .into_iter()
                .map(|(h, _)| h * flux)
                .collect()
        })
        .collect();
    (0..outputs.count()).map(|p| parts.iter().map(|part| part[p]).sum()).collect()
}

fn case(interpolation: Interpolation) -> Case {
    let (grid, direction) = moving_ball(interpolation);
    let exact = exact(&grid, &direction, Outputs::Film);
    assert_eq!(direction.len(), grid.parameter_count());
    Case {
        name: format!("{interpolation:?} grid"),
        sdf: Box::new(grid),
        direction,
        shading: FLAT,
        outputs: Outputs::Film,
        exact,
        tracer: TRACER,
    }
}

#[test]
fn cubic_grids_are_smooth_and_trilinear_ones_are_not() {
    let mut power = Power::of("space_sdf::cubic_grids_are_smooth_and_trilinear_ones_are_not");
    let [cubic, trilinear] = [Interpolation::Cubic, Interpolation::Trilinear].map(case);
    cubic.accept(&mut power, "Vicini", &vicini(), pick(60_000, 200_000));
    trilinear.reject("Vicini", &vicini(), Terms::All, 60_000);
    cubic.accept(&mut power, "Bangaru", &BangaruField::default(), pick(60_000, 200_000));
    if thorough() {
        // Wrong by a twelfth; Vicini's by a fifth.
        trilinear.reject("Bangaru", &BangaruField::default(), Terms::All, 400_000);
    }
}
