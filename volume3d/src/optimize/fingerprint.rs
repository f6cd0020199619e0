//! Fingerprints, which tell the work of one fit from that of another.

use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::objective::{Objective, View};
use super::parameters::Parameters;
use crate::Image;
use crate::gradient::Estimator;
use crate::scene::Scene;

/// Checksums of what a fit begins with, apart from its views: the scene, the parameters with the objects at
/// rest that they move, and the method with its samples and seed.
///
/// It is computed where the fit is and where its tasks are run, and a task is refused where it differs. All
/// numbers count, exactly; of an implicit surface of a user's own type, what its debug format shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    pub(super) scene: u32,
    pub(super) parameters: u32,
    pub(super) method: u32,
}

impl Problem {
    /// The problem of a fit that begins with this scene and takes the gradients of all steps by this method.
    /// It reads the whole scene: compute it once.
    #[must_use]
    pub fn new(scene: &Scene, parameters: &Parameters, method: &Estimator) -> Self {
        Self {
            scene: checksum(scene.description()),
            parameters: checksum(parameters),
            method: checksum(method),
        }
    }
}

impl Objective {
    /// Checksum of everything on which the loss of a view depends, apart from the scene: target, weights,
    /// mask, camera and film, and the settings of the objective. Penalties are left out.
    pub(super) fn fingerprint(&self, view: usize) -> u32 {
        let Self { views, loss, penalties: _, masks, silhouettes, pixels, image_samples } = self;
        let View { name, camera, film, target, weights, mask } = &views[view];
        let mut hash = Checksum::default();
        hash.add(&(loss, masks, silhouettes, pixels, image_samples, name, camera, film, mask));
        for Image { width, height, pixels } in std::iter::once(target).chain(weights) {
            hash.add(&(width, height));
            let numbers = pixels.iter().flat_map(DVec3::to_array);
            let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            hash.0.update(&bytes);
        }
        hash.0.finalize()
    }
}

fn checksum(value: &impl fmt::Debug) -> u32 {
    let mut hash = Checksum::default();
    hash.add(value);
    hash.0.finalize()
}

/// A checksum of debug formats, in which numbers are exact.
#[derive(Default)]
struct Checksum(crc32fast::Hasher);

impl Checksum {
    fn add(&mut self, value: &impl fmt::Debug) {
        fmt::write(self, format_args!("{value:?};")).expect("a checksum takes all text");
    }
}

impl fmt::Write for Checksum {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}
