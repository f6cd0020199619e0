//! Small pictures of targets, starts and ends.

use glam::DVec3;
use volume3d::gradient::{Progress, render};
use volume3d::scene::Scene;

use super::protocol::{SAMPLES, start};
use super::racer::Racer;
use super::stage::Stage;
use super::study::Study;
use super::summary::Race;
use crate::seeds::seed_of;

/// A scene's target, its first start, and every method's end pose from there.
pub(super) struct View {
    pub(super) stage: Stage,
    /// Columns and rows.
    pub(super) side: usize,
    /// Radiance, and for ends whether the pose was found.
    pub(super) pictures: Vec<(Vec<DVec3>, Option<bool>)>,
}

impl View {
    /// The pictures, on a finer film than that of the descents, for readers.
    pub(super) fn new(study: &Study, stage: Stage, side: usize, samples: usize) -> anyhow::Result<Self> {
        let mut scene = stage.scene(side, study.seed)?;
        let parameters = Stage::parameters(&scene)?;
        let shown = |x: &[f64], scene: &mut Scene| -> anyhow::Result<Vec<DVec3>> {
            parameters.apply(x, scene)?;
            let seed = seed_of(study.seed, &[13, 400, stage as u64]);
            Ok(render(scene, samples, seed, &Progress::none())?.image.pixels)
        };
        let mut pictures = vec![(shown(&[0.0; 6], &mut scene)?, None)];
        pictures.push((shown(&start(stage, study.seed, 0), &mut scene)?, None));
        for racer in Racer::ALL {
            let race = Race::new(study, stage, racer, SAMPLES);
            let Some(first) = race.rows.first() else { continue };
            pictures.push((shown(&first.pose()?, &mut scene)?, Some(first.distance().relative() <= 1.0)));
        }
        Ok(Self { stage, side, pictures })
    }
}
