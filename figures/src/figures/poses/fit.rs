//! One descent.

use glam::DVec3;
use volume3d::Image;
use volume3d::gradient::{Progress, render};
use volume3d::optimize::{Adam, Parameters};
use volume3d::scene::Scene;

use super::protocol::{CLOSE, IMAGE_SAMPLES, LOSS, rate};
use super::racer::{Place, Racer};
use super::stage::Stage;
use crate::seeds::seed_of;

/// A scene to be fitted, and its target.
pub(super) struct Problem {
    pub(super) stage: Stage,
    /// The scene with the object at its true pose.
    pub(super) scene: Scene,
    pub(super) parameters: Parameters,
    pub(super) target: Image,
}

/// Settings of a descent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Descent {
    pub(super) racer: Racer,
    /// Samples a pixel of a gradient.
    pub(super) samples: usize,
    pub(super) steps: u64,
    pub(super) seed: u64,
}

/// The distance of a pose from the true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distance {
    /// Translation error in extents.
    pub(super) shift: f64,
    /// Rotation error in degrees; 0 if every rotation looks the same.
    pub(super) turn: f64,
}

impl Distance {
    pub(super) fn of(stage: Stage, x: &[f64]) -> Self {
        let [t, r] = [&x[..3], &x[3..]].map(|v| DVec3::from_slice(v).length());
        Self { shift: t / stage.extent(), turn: if stage.is_round() { 0.0 } else { r.to_degrees() } }
    }

    /// The larger of both in units of the success thresholds: success is 1 or less.
    pub(super) fn relative(self) -> f64 {
        (self.shift / CLOSE[0]).max(self.turn / CLOSE[1])
    }
}

/// The descent of one method.
pub(super) struct Path {
    pub(super) racer: Racer,
    /// The larger of both errors, in units of the success thresholds, before the first step and after each.
    pub(super) errors: Vec<f64>,
    pub(super) end: Distance,
    /// The object at the end.
    pub(super) picture: Vec<DVec3>,
}

impl Problem {
    /// Descends from a pose; returns the poses before the first step and after each.
    pub(super) fn descend(&self, from: &[f64], descent: &Descent) -> anyhow::Result<Vec<Vec<f64>>> {
        let Descent { racer, samples, steps, seed } = *descent;
        let parameters = &self.parameters;
        let mut scene = Scene::new(self.scene.description().clone())?;
        let (mut x, mut adam) = (from.to_vec(), Adam::new(0.0));
        parameters.apply(&x, &mut scene)?;
        let mut poses = vec![x.clone()];
        for step in 0..steps {
            let image = render(&scene, IMAGE_SAMPLES, seed_of(seed, &[0, step]), &Progress::none())?.image;
            let (_, adjoint) = LOSS.of(&image, &self.target)?;
            let seed = seed_of(seed, &[1, step]);
            let place = Place { scene: &scene, parameters, x: &x, adjoint: &adjoint, samples, seed };
            let gradient = racer.gradient(&place)?;
            adam.rate = rate(step, steps);
            parameters.retract(&mut x, &adam.step(&gradient));
            parameters.apply(&x, &mut scene)?;
            poses.push(x.clone());
        }
        Ok(poses)
    }
}
