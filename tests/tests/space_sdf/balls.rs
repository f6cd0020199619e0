//! Exact derivatives of images of balls, from their outlines and by implicit differentiation inside them.

use std::f64::consts::TAU;

use glam::DVec3;

use super::case::Shading;
use super::outputs::Outputs;

/// Directions around an outline.
const AROUND: usize = 20_000;
/// Cells from the middle of a disc to its outline, and around it.
const CELLS: [usize; 2] = [300, 600];

/// A ball and its motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingBall {
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
    /// ċ and ṙ.
    pub(crate) velocity: DVec3,
    pub(crate) growth: f64,
}

impl MovingBall {
    /// Distance at which a ray from the origin meets it.
    fn hit(&self, omega: DVec3) -> Option<f64> {
        let along = self.centre.dot(omega);
        let square = along * along - self.centre.length_squared() + self.radius * self.radius;
        (square > 0.0 && along > 0.0).then(|| along - square.sqrt())
    }

    /// The half angle of its disc on the sphere of directions, its axis, and two orthogonal directions.
    fn disc(&self) -> (f64, [DVec3; 3]) {
        let distance = self.centre.length();
        let axis = self.centre / distance;
        let (s, t) = axis.any_orthonormal_pair();
        ((self.radius / distance).asin(), [axis, s, t])
    }
}

/// The visible ball in a direction, and its distance.
fn seen(balls: &[MovingBall], omega: DVec3) -> Option<(usize, f64)> {
    let hits = balls.iter().enumerate().filter_map(|(i, ball)| Some((i, ball.hit(omega)?)));
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// d/dt of every integral.
pub(crate) fn derivative(balls: &[MovingBall], shading: Shading, outputs: Outputs) -> Vec<f64> {
    let mut sums = vec![0.0; outputs.count()];
    let mut add = |omega: DVec3, value: f64| {
        for (sum, (h, _)) in sums.iter_mut().zip(outputs.weights(omega)) {
            *sum += h * value;
        }
    };
    for index in 0..balls.len() {
        outline(balls, index, shading, &mut add);
        interior(balls, index, shading, &mut add);
    }
    sums
}

/// ∮ (L_front − L_behind) v dl over the visible part of an outline.
fn outline(balls: &[MovingBall], index: usize, shading: Shading, add: &mut impl FnMut(DVec3, f64)) {
    let ball = balls[index];
    let (beta, [axis, s, t]) = ball.disc();
    let distance = (ball.centre.length_squared() - ball.radius * ball.radius).sqrt();
    let others: Vec<MovingBall> =
        balls.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, b)| *b).collect();
    for k in 0..AROUND {
        let (sin, cos) = (TAU * (k as f64 + 0.5) / AROUND as f64).sin_cos();
        let across = s * cos + t * sin;
        let omega = axis * beta.cos() + across * beta.sin();
        let normal = across * beta.cos() - axis * beta.sin();
        let behind = match seen(&others, omega) {
            Some((_, nearer)) if nearer < distance => continue,
            Some((i, t)) => shading.at(omega * t, (omega * t - others[i].centre) / others[i].radius),
            None => shading.background,
        };
        let speed = (ball.velocity.dot(normal) + ball.growth) / distance;
        let jump = shading.at(omega * distance, normal) - behind;
        add(omega, jump * speed * TAU / AROUND as f64 * beta.sin());
    }
}

/// ∫ dL/dt at fixed directions, over the visible part of a disc. Cells are dense at the outline, as ψ = β(1 −
/// q²), where L behaves as a square root.
fn interior(balls: &[MovingBall], index: usize, shading: Shading, add: &mut impl FnMut(DVec3, f64)) {
    let MovingBall { centre, radius, velocity, growth } = balls[index];
    let (beta, [axis, s, t]) = balls[index].disc();
    for i in 0..CELLS[0] {
        let q = (i as f64 + 0.5) / CELLS[0] as f64;
        let psi = beta * (1.0 - q * q);
        let area = psi.sin() * 2.0 * beta * q / CELLS[0] as f64 * TAU / CELLS[1] as f64;
        for j in 0..CELLS[1] {
            let (sin, cos) = (TAU * (j as f64 + 0.5) / CELLS[1] as f64).sin_cos();
            let omega = axis * psi.cos() + (s * cos + t * sin) * psi.sin();
            let Some((_, distance)) = seen(balls, omega).filter(|(i, _)| *i == index) else { continue };
            let x = omega * distance;
            let normal = (x - centre) / radius;
            // φ̇ = −n·ċ − ṙ and ẋ = −ω φ̇/(n·ω); n = (x − c)/r.
            let rate = -normal.dot(velocity) - growth;
            let moved = -omega * (rate / normal.dot(omega));
            let turned = (moved - velocity - normal * growth) / radius;
            add(omega, (shading.position.dot(moved) + shading.normal.dot(turned)) * area);
        }
    }
}
