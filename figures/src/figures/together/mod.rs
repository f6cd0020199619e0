//! Pose, material, texture and light of one scene, found together.

mod picture;
mod scene;
mod study;

use crate::context::Context;
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use picture::LIKELY;
use study::{Effort, Study};

/// The text of the figure.
pub(crate) const TEXT: &str = include_str!("together.md");

/// One fit, of smaller pictures.
pub(crate) fn live(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context, Effort::LIVE)?;
    let found = study.groups.iter().map(|group| {
        let [start, end, _] = group.distances().map(number);
        format!("`{}` from {start} to {end}", group.name)
    });
    let prose = Prose::new(
        include_str!("live.md"),
        &[("steps", &study.effort.steps), ("side", &study.effort.side), ("found", &listed(found))],
    )?;
    context.png("together_live.png", &picture::live(&study))?;
    prose.section("together", vec![], Table::default())
}

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context, context.study(Effort::SKETCH, Effort::SHORT, Effort::FULL))?;
    let prose = prose(&study)?;
    context.png("together.png", &picture::draw(&study))?;
    let table = summary(&study);
    let data = vec![
        context.csv("together_parameters.csv", &table)?,
        context.csv("together_numbers.csv", &numbers(&study))?,
        context.csv("together_losses.csv", &losses(&study))?,
    ];
    prose.section("together", data, table)
}

fn prose(study: &Study) -> anyhow::Result<Prose> {
    let effort = study.effort;
    let scores: Vec<f64> = study.scores().collect();
    let within = scores.iter().filter(|s| s.abs() < LIKELY).count();
    let whole = (scores.iter().map(|s| s * s).sum::<f64>() / scores.len() as f64).sqrt();
    let found = study.groups.iter().map(|group| {
        let [start, mean, one] = group.distances().map(number);
        format!("`{}` from {start} to {mean} ± {}, one fit ± {one}", group.name, number(group.error()))
    });
    let first: f64 = study.losses.first().copied().unwrap_or_default();
    let last = study.losses.iter().rev().take(10).sum::<f64>() / study.losses.len().clamp(1, 10) as f64;
    let [of_target, of_image, of_gradient] = effort.samples;
    Prose::new(
        TEXT,
        &[
            ("count", &scores.len()),
            ("side", &effort.side),
            ("steps", &effort.steps),
            ("fits", &effort.fits),
            ("of_target", &of_target),
            ("of_image", &of_image),
            ("of_gradient", &of_gradient),
            ("found", &listed(found)),
            ("within", &within),
            ("likely", &LIKELY),
            ("expected", &number(0.95 * scores.len() as f64)),
            ("whole", &number(whole)),
            ("fall", &percent(last / first)),
            ("seconds", &number(study.seconds)),
        ],
    )
}

fn summary(study: &Study) -> Table {
    Table::of(
        &study.groups,
        &[
            ("parameter", &|group| group.name.into()),
            ("numbers", &|group| group.numbers.len().into()),
            ("start from the truth", &|group| group.distances()[0].into()),
            ("mean of fits from the truth", &|group| group.distances()[1].into()),
            ("standard error of the mean", &|group| group.error().into()),
            ("standard deviation of one fit", &|group| group.distances()[2].into()),
            ("root mean square score", &|group| group.score().into()),
        ],
    )
}

fn numbers(study: &Study) -> Table {
    let rows = study
        .groups
        .iter()
        .flat_map(|group| group.numbers.iter().enumerate().map(move |(i, number)| (group.name, i, *number)));
    Table::of(
        rows,
        &[
            ("parameter", &|(name, ..)| (*name).into()),
            ("index", &|(_, i, _)| (*i).into()),
            ("truth", &|(.., number)| number.truth.into()),
            ("start", &|(.., number)| number.start.into()),
            ("mean", &|(.., number)| number.mean.into()),
            ("standard error", &|(.., number)| number.error.into()),
        ],
    )
}

fn losses(study: &Study) -> Table {
    Table::of(
        study.losses.iter().enumerate(),
        &[("step", &|(i, _)| (i + 1).into()), ("loss", &|(_, loss)| (**loss).into())],
    )
}
