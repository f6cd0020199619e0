//! One scene of the study, small enough to be computed while one waits.

use volume3d::gradient::{Progress, render};
use volume3d::scene::Scene;

use super::fit::{Descent, Distance, Path};
use super::picture;
use super::protocol::{Effort, SAMPLES, start};
use super::racer::Racer;
use super::stage::Stage;
use super::study::problem;
use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::seeds::seed_of;

const STAGE: Stage = Stage::Bunny;
/// The number of the start.
const START: u64 = 0;
/// Columns and rows of the shown pictures, and their samples a pixel.
const SHOWN: (usize, usize) = (64, 32);

/// Descends along three gradients from one start.
pub(crate) fn live(context: &Context) -> anyhow::Result<Section> {
    let (effort, seed) = (Effort::FULL, context.seed());
    context.step("targets");
    let problem = problem(STAGE, true, &effort, seed)?;
    let from = start(STAGE, seed, START);
    let mut scene = STAGE.scene(SHOWN.0, seed)?;
    let look = |x: &[f64], scene: &mut Scene| -> anyhow::Result<Vec<glam::DVec3>> {
        problem.parameters.apply(x, scene)?;
        Ok(render(scene, SHOWN.1, seed_of(seed, &[13, 500]), &Progress::none())?.image.pixels)
    };
    let ends = [look(&[0.0; 6], &mut scene)?, look(&from, &mut scene)?];
    let mut paths = vec![];
    for racer in [Racer::WarpedArea, Racer::Rotation, Racer::Interior] {
        context.step(&format!("a descent by {}", racer.name()));
        let seed = seed_of(seed, &[13, 600, racer as u64]);
        let poses =
            problem.descend(&from, &Descent { racer, samples: SAMPLES, steps: effort.steps, seed })?;
        let last = &poses[poses.len() - 1];
        let errors = poses.iter().map(|x| Distance::of(STAGE, x).relative()).collect();
        let (end, picture) = (Distance::of(STAGE, last), look(last, &mut scene)?);
        paths.push(Path { racer, errors, end, picture });
    }
    context.png("poses_live.png", &picture::live(&ends, &paths, SHOWN.0))?;
    let first = Distance::of(STAGE, &from);
    let told = |d: Distance| format!("{} % of its extent and {}°", number(100.0 * d.shift), number(d.turn));
    let prose = Prose::new(
        include_str!("live.md"),
        &[
            ("steps", &effort.steps),
            ("start", &told(first)),
            ("area", &told(paths[0].end)),
            ("rotation", &told(paths[1].end)),
            ("interior", &told(paths[2].end)),
        ],
    )?;
    prose.section("poses", vec![], Table::default())
}
