//! A neural surface from pictures alone, and from pictures with masks, good and bad.

mod picture;
mod study;

use crate::context::{Context, Quality};
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::space::reconstruction::EIKONAL;
use study::{Arm, Entry, Flaw, HOLES, MASKS, SEARCHED, Study, architecture, effort};

/// The text of the figure.
pub(crate) const TEXT: &str = include_str!("masks.md");

/// Adam's rate of the live fits.
const RATE: f64 = 2e-3;

/// Fits the bunny without masks, and with masks that are too large.
pub(crate) fn live(context: &Context) -> anyhow::Result<Section> {
    let (effort, architecture) = (effort(Quality::Draft), architecture(Quality::Draft));
    let arms = [Arm::WarpedArea, Arm::Masks(Flaw::Pixels(4))];
    let fits = arms.map(|arm| Entry::new(context, &effort, architecture, arm, (RATE, 1)));
    let [area, masks] = fits;
    let entries = [area?, masks?];
    let distance = |i: usize| percent(entries[i].fit.chamfer());
    let prose = Prose::new(
        include_str!("live.md"),
        &[
            ("steps", &effort.steps()),
            ("views", &effort.views),
            ("side", &effort.side),
            ("width", &architecture.width),
            ("start", &percent(entries[0].fit.moments[0].chamfer)),
            ("area", &distance(0)),
            ("masks", &distance(1)),
        ],
    )?;
    context.png("masks_live.png", &picture::live(&entries, effort.side))?;
    prose.section("masks", vec![], Table::default())
}

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    let prose = prose(&study)?;
    context.png("masks.png", &picture::draw(&study))?;
    let table = summary(&study);
    let data = vec![context.csv("masks_fits.csv", &table)?];
    prose.section("masks", data, table)
}

fn prose(study: &Study) -> anyhow::Result<Prose> {
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
    Prose::new(
        TEXT,
        &[
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
