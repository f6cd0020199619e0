//! Protocol fixed before the runs: film, samples, schedule, starts, and the definition of success.
//!
//! It was designed with starts of another seed, mostly by warped area alone, so that most of its descents
//! arrive within the time that the whole may take: a coarse film and few samples a step, as Adam takes the
//! mean over steps anyway. An earlier protocol of half the steps and a third of the samples was inconclusive:
//! nobody found anything by shadows or above the glossy floor, and the best method a third of the cylinders.
//! This one has other starts.

use std::f64::consts::PI;

use flatland::random::{Stream, open01, stream};
use glam::DVec3;
use volume3d::optimize::Loss;

use super::racer::Racer;
use super::stage::Stage;

/// Columns and rows of the film.
pub(super) const SIDE: usize = 24;
/// Samples a pixel of every image that is compared with the target.
pub(super) const IMAGE_SAMPLES: usize = 12;
/// Samples a pixel of every gradient at equal steps.
pub(super) const SAMPLES: usize = 6;
/// Samples a pixel of the target that cannot be reached, whose noise is part of its error.
pub(super) const NOISY_SAMPLES: usize = 16;
/// The first step of Adam, in units of length and in radians; it falls to zero along half a cosine.
const RATE: f64 = 0.03;
/// Resolutions of the loss.
pub(super) const LOSS: Loss = Loss::Multiscale { levels: 5 };
/// The farthest start, in extents, and the farthest turn, in radians.
const FARTHEST: [f64; 2] = [0.15, 0.45];
/// Success thresholds: translation error in parts of the extent, and rotation error in degrees.
pub(super) const CLOSE: [f64; 2] = [0.02, 2.0];

/// Effort of the study.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Steps of a descent.
    pub(super) steps: u64,
    /// Steps between recorded errors.
    pub(super) stride: usize,
    /// Starts of every method, scene by scene.
    pub(super) starts: [u64; 6],
    /// Descents of one kind that start where the object is.
    pub(super) seeds: u64,
    /// Samples a pixel of targets that can be reached.
    pub(super) target: usize,
}

impl Effort {
    pub(super) const FULL: Self =
        Self { steps: 96, stride: 8, starts: [85, 24, 24, 12, 12, 12], seeds: 12, target: 1024 };
    pub(super) const SHORT: Self = Self { starts: [8, 8, 6, 4, 4, 4], seeds: 4, ..Self::FULL };
    /// Just enough to show that everything runs.
    pub(super) const SKETCH: Self =
        Self { steps: 1, stride: 1, starts: [2, 1, 1, 1, 1, 1], seeds: 2, target: 4 };

    /// Key of a descent: the descents of a shorter study are part of a longer one.
    pub(super) fn of_descents(&self) -> String {
        format!("{} steps, errors of every {}, targets of {} samples", self.steps, self.stride, self.target)
    }
}

/// Start of the stream of starts: none of them was seen while the protocol was designed.
const FRESH: u64 = 20_261_123;

/// The rate of a step.
pub(super) fn rate(step: u64, steps: u64) -> f64 {
    0.5 * RATE * (1.0 + (PI * step as f64 / steps as f64).cos())
}

/// A start: a translation and a rotation vector, both uniform in balls. They depend only on the seed, the
/// scene and their number, so that every method has the same.
pub(super) fn start(stage: Stage, seed: u64, index: u64) -> [f64; 6] {
    let mut dice = stream(seed, &[13, FRESH, stage as u64, index]);
    let t = FARTHEST[0] * stage.extent() * in_ball(&mut dice);
    let r = FARTHEST[1] * in_ball(&mut dice);
    [t.x, t.y, t.z, r.x, r.y, r.z]
}

/// Uniform in the unit ball.
fn in_ball(dice: &mut Stream) -> DVec3 {
    loop {
        let at = DVec3::from_array([0; 3].map(|_| 2.0 * open01(dice) - 1.0));
        if at.length_squared() < 1.0 {
            return at;
        }
    }
}

/// Samples a pixel of a gradient with which a step takes about as long as one of warped area with
/// [`SAMPLES`], scene by scene in the order of [`Stage::ALL`], method by method in that of [`Racer::ALL`].
///
/// Processor time was measured once, on one thread of a quiet machine, with six steps from three starts of
/// another seed. A method whose step takes within a fifth of that keeps [`SAMPLES`], and its descents are
/// those at equal steps; another has the whole number nearest in ratio. Beside each scene stands what a step
/// takes in units of warped area's. What it was in a run, poses_time.csv tells.
#[rustfmt::skip]
const EQUAL_TIME: [[usize; 7]; 6] = [
    [6, 6, 6, 6, 4, 25, 4], // cylinders: 1, 1.00, 1.00, 0.98, 1.03, 1.01, 1.03
    [6, 13, 11, 11, 8, 47, 6], // foliage: 1, 0.92, 0.97, 0.96, 1.07, 1.01, 0.86
    [6, 6, 6, 6, 4, 30, 2], // bunny: 1, 1.04, 0.89, 0.91, 0.97, 1.00, 0.93
    [6, 6, 6, 6, 3, 20, 3], // sphere: 1, 1.12, 1.12, 1.11, 0.95, 1.02, 1.05
    [6, 6, 6, 6, 3, 9, 2], // shadow only: 1, 1.21, 1.21, 1.16, 1.01, 0.97, 1.13
    [6, 4, 4, 6, 3, 13, 2], // glossy floor: 1, 1.02, 0.94, 1.21, 1.03, 0.99, 0.87
];

/// Samples a pixel of a gradient at equal time.
pub(super) fn equal_time(stage: Stage, racer: Racer) -> usize {
    EQUAL_TIME[stage as usize][racer as usize]
}
