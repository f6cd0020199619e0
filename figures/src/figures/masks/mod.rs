//! Figure 17: a neural surface from pictures alone, and from pictures with masks, good and bad.

mod picture;
mod study;

use crate::context::Context;
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::space::reconstruction::EIKONAL;
use study::{Arm, HOLES, MASKS, SEARCHED, Study};

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    let prose = prose(context, &study)?;
    context.png("figure17_masks.png", &picture::draw(&study))?;
    let table = summary(&study);
    let data = vec![context.csv("figure17_fits.csv", &table)?];
    prose.section("masks", data, table)
}

fn prose(context: &Context, study: &Study) -> anyhow::Result<Prose> {
    let effort = &study.effort;
    let distances = |arm: Arm| study.of(arm).map(|entry| percent(entry.fit.chamfer()));
    let by_seed = |arm| listed(distances(arm));
    let one = |arm| distances(arm).next().unwrap_or_default();
    let search = |arm: Arm| {
        let all = study.entries.iter().filter(|entry| entry.arm == arm && entry.fit.number == 1);
        listed(all.map(|entry| format!("{} at {}", percent(entry.fit.chamfer()), number(entry.rate))))
    };
    let seconds = |arm: Arm| {
        let all: Vec<f64> = study.of(arm).map(|entry| entry.fit.seconds).collect();
        number(all.iter().sum::<f64>() / all.len() as f64)
    };
    let gone = study.entries.iter().filter(|entry| entry.fit.vanished.is_some());
    let gone = listed(gone.map(|entry| format!("{} at the rate {}", entry.arm.name(), number(entry.rate))));
    let gone = match gone.as_str() {
        "" => String::new(),
        _ => format!(
            "Where no surface was left in the box, or all of it was inside, the fit ended, and what is measured is the last there was: {gone}."
        ),
    };
    let spoilt = MASKS[1..].iter().map(|(flaw, _)| {
        let arm = Arm::Masks(*flaw);
        format!("{}: {}", arm.name(), one(arm))
    });
    let [area, exact] = SEARCHED;
    let quality = context.spend(
        "This is the draft: few pixels, few steps and a small network. Its distances say nothing; `--quality full` does.",
        "",
    );
    Prose::new(
        include_str!("masks.md"),
        &[
            ("quality", &quality),
            ("views", &effort.views),
            ("side", &effort.side),
            ("batch", &effort.batch),
            ("samples", &effort.samples),
            ("steps", &effort.steps()),
            ("cells", &effort.cells),
            ("finer", &(2 * effort.cells)),
            ("layers", &study.architecture.hidden),
            ("width", &study.architecture.width),
            ("frequencies", &study.architecture.frequencies),
            ("eikonal", &number(EIKONAL)),
            ("holes", &percent(HOLES.0)),
            ("area", &by_seed(area)),
            ("exact", &by_seed(exact)),
            ("spoilt", &listed(spoilt)),
            ("nothing", &one(Arm::Nothing)),
            ("longer", &one(Arm::Longer)),
            ("longer_steps", &study.longer),
            ("gone", &gone),
            ("rates", &listed(study.rates.iter().map(|&rate| number(rate)))),
            ("area_search", &search(area)),
            ("exact_search", &search(exact)),
            ("area_seconds", &seconds(area)),
            ("exact_seconds", &seconds(exact)),
        ],
    )
}

fn summary(study: &Study) -> Table {
    Table::of(
        &study.entries,
        &[
            ("supervision", &|entry| entry.arm.name().as_str().into()),
            ("rate", &|entry| entry.rate.into()),
            ("seed", &|entry| (entry.fit.number as usize).into()),
            ("Chamfer distance, fit (%)", &|entry| (100.0 * entry.fit.chamfer()).into()),
            ("95 % Hausdorff distance, fit (%)", &|entry| (100.0 * entry.fit.hausdorff).into()),
            ("PSNR of held-out views, worst (dB)", &|entry| entry.fit.worst_decibels().into()),
            ("ended at step", &|entry| entry.fit.vanished.map_or("".into(), |step| (step as usize).into())),
            ("processor seconds", &|entry| entry.fit.seconds.into()),
        ],
    )
}
