//! Poses found by descending gradients, from several starts, by every method.

mod drift;
mod fit;
mod live;
mod picture;
mod protocol;
mod racer;
mod record;
mod stage;
mod study;
mod summary;
mod views;

use std::collections::BTreeSet;

use crate::context::Context;
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;
use drift::{Drift, Offset};
use protocol::{CLOSE, SAMPLES, SIDE, equal_time};
use racer::Racer;
use stage::Stage;
use study::Study;
use summary::{Race, Rate};
use views::View;

pub(crate) use live::live;

/// The text of the figure.
pub(crate) const TEXT: &str = include_str!("poses.md");

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    let results = Results::new(&study)?;
    context.step("pictures");
    let (side, samples) = context.study((24, 4), (48, 64), (64, 64));
    let views = Stage::ALL.map(|stage| View::new(&study, stage, side, samples));
    let views = views.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let prose = results.prose(&study)?;
    context.png("poses_views.png", &picture::views(&views))?;
    context.png("poses.png", &picture::rates(&study, &results.races))?;
    context.png("poses_curves.png", &picture::curves(&study, &results.races)?)?;
    context.png("poses_drift.png", &picture::drifts(&results.unreachable, &results.truth))?;
    let table = results.table();
    let data = [
        context.csv("poses.csv", &table)?,
        context.csv("poses_drift.csv", &results.drifts())?,
        context.csv("poses_descents.csv", &descents(&study))?,
        context.csv("poses_time.csv", &results.times())?,
    ];
    study.finish()?;
    prose.section("poses", data.to_vec(), table)
}

/// Statistics of all descents.
struct Results<'a> {
    /// At equal steps and at equal time.
    races: Vec<[Race<'a>; 2]>,
    unreachable: Vec<(Stage, Vec<Drift>)>,
    /// Drifts of the bunny from the true pose.
    truth: Vec<Drift>,
}

impl<'a> Results<'a> {
    fn new(study: &'a Study) -> anyhow::Result<Self> {
        let pairs = Stage::ALL.into_iter().flat_map(|stage| Racer::ALL.map(|racer| (stage, racer)));
        let races = pairs.map(|(stage, racer)| {
            [SAMPLES, equal_time(stage, racer)].map(|samples| Race::new(study, stage, racer, samples))
        });
        let unreachable =
            Stage::UNREACHABLE.into_iter().map(|stage| Ok((stage, Drift::unreachable(study, stage)?)));
        Ok(Self {
            races: races.collect(),
            unreachable: unreachable.collect::<anyhow::Result<_>>()?,
            truth: Drift::from_truth(study)?,
        })
    }

    fn prose(&self, study: &Study) -> anyhow::Result<Prose> {
        Prose::new(
            TEXT,
            &[
                ("side", &SIDE),
                ("samples", &SAMPLES),
                ("steps", &study.effort.steps),
                ("shift", &percent(CLOSE[0])),
                ("turn", &CLOSE[1]),
                ("rates_cylinders", &self.rates(Stage::Cylinders)),
                ("rates_foliage", &self.rates(Stage::Foliage)),
                ("rates_bunny", &self.rates(Stage::Bunny)),
                ("rates_sphere", &self.rates(Stage::Sphere)),
                ("rates_shadow", &self.rates(Stage::Shadow)),
                ("rates_glossy", &self.rates(Stage::Glossy)),
                ("apart", &self.apart()),
                ("interior", &self.interior()),
                ("nobody_cylinders", &self.nobody(Stage::Cylinders)),
                ("nobody_foliage", &self.nobody(Stage::Foliage)),
                ("nobody_bunny", &self.nobody(Stage::Bunny)),
                ("seeds", &study.effort.seeds),
                ("unreachable_cylinders", &offsets(self.before(Stage::Cylinders))),
                ("unreachable_bunny", &offsets(self.before(Stage::Bunny))),
                ("strays_cylinders", &self.strays(Stage::Cylinders)),
                ("strays_bunny", &self.strays(Stage::Bunny)),
                ("truth", &offsets(&self.truth)),
            ],
        )
    }

    /// "warped area 53 of 85 (equal time 53); …".
    fn rates(&self, stage: Stage) -> String {
        let races = self.races.iter().filter(|race| race[0].stage == stage);
        listed(races.map(|[steps, time]| {
            let at_time = if time.samples == steps.samples {
                String::new()
            } else {
                format!(" (at equal time {})", time.rate().shown())
            };
            format!("{} {}{at_time}", steps.racer.name(), steps.rate().shown())
        }))
    }

    /// Methods whose interval at equal steps lies wholly below that of warped area, or above.
    fn apart(&self) -> String {
        let words = self.races.iter().filter_map(|[race, _]| {
            let best = self.races.iter().find(|[other, _]| other.stage == race.stage)?;
            let ([low, high], [least, most]) = (race.rate().interval(), best[0].rate().interval());
            let side = if high < least { "less often" } else { "more often" };
            let words = format!("{} {side} on {}", race.racer.name(), race.stage.name());
            (high < least || low > most).then_some(words)
        });
        let words = listed(words);
        if words.is_empty() { "nowhere".to_owned() } else { words }
    }

    /// Number of successful descents of the interior term alone, of all.
    fn interior(&self) -> String {
        let races = self.races.iter().flatten().filter(|race| race.racer == Racer::Interior);
        let rates = races.map(Race::rate);
        let [successes, count] =
            rates.fold([0; 2], |[found, all], rate| [found + rate.successes, all + rate.count]);
        Rate { successes, count }.shown()
    }

    /// Starts of a scene from which no method succeeds at equal steps, of all.
    fn nobody(&self, stage: Stage) -> String {
        let races: Vec<&Race<'_>> =
            self.races.iter().map(|[race, _]| race).filter(|race| race.stage == stage).collect();
        let starts: BTreeSet<u64> =
            races.iter().flat_map(|race| race.rows.iter().map(|row| row.start)).collect();
        let found: BTreeSet<u64> = races.iter().flat_map(|race| race.found().map(|row| row.start)).collect();
        Rate { successes: starts.len() - found.len(), count: starts.len() }.shown()
    }

    fn before(&self, stage: Stage) -> &[Drift] {
        self.unreachable.iter().find(|(other, _)| *other == stage).map_or(&[], |(_, drifts)| drifts)
    }

    /// Methods that end elsewhere than edge sampling, before a target that cannot be reached.
    fn strays(&self, stage: Stage) -> String {
        let drifts = self.before(stage);
        let words = drifts.iter().filter_map(|drift| {
            let [shift, turn] = drift.beyond(drifts)?;
            let apart = || [shift.length().scaled(100.0), turn.length()].map(Ratio::shown);
            let is_sure = drift.racer != Racer::EdgeSampling && (shift.is_sure() || turn.is_sure());
            let words = || apart().join(" % and ");
            is_sure.then(|| format!("{} by {}°", drift.racer.name(), words()))
        });
        let words = listed(words);
        if words.is_empty() { "none that this run could tell".to_owned() } else { words }
    }

    /// All counts.
    fn table(&self) -> Table {
        let budgets = ["equal steps", "equal time"];
        let rows = self.races.iter().flat_map(|pair| budgets.into_iter().zip(pair));
        let found = |race: &Race<'_>, i: usize| {
            race.converged().map_or_else(|| "–".into(), |errors| errors[i].into())
        };
        Table::of(
            rows,
            &[
                ("scene", &|(_, race)| race.stage.name().into()),
                ("method", &|(_, race)| race.racer.name().into()),
                ("budget", &|(budget, _)| (*budget).into()),
                ("samples a pixel", &|(_, race)| race.samples.into()),
                ("starts", &|(_, race)| race.rate().count.into()),
                ("found", &|(_, race)| race.rate().successes.into()),
                ("rate", &|(_, race)| race.rate().value().into()),
                ("from (95 %)", &|(_, race)| race.rate().interval()[0].into()),
                ("to", &|(_, race)| race.rate().interval()[1].into()),
                ("median translation error", &|(_, race)| race.medians()[0].into()),
                ("median rotation error (°)", &|(_, race)| race.medians()[1].into()),
                ("translation error where found", &|(_, race)| found(race, 0)),
                ("rotation error where found (°)", &|(_, race)| found(race, 1)),
            ],
        )
    }

    /// Drifts of descents that begin at the truth.
    fn drifts(&self) -> Table {
        let mut rows: Vec<(&str, Stage, &Drift)> = vec![];
        for (stage, drifts) in &self.unreachable {
            rows.extend(drifts.iter().map(|drift| ("cannot be reached", *stage, drift)));
        }
        rows.extend(self.truth.iter().map(|drift| ("its own", Stage::Bunny, drift)));
        Table::of(
            rows,
            &[
                ("target", &|(target, ..)| (*target).into()),
                ("scene", &|(_, stage, _)| stage.name().into()),
                ("method", &|(.., drift)| drift.racer.name().into()),
                ("samples a pixel", &|(.., drift)| drift.samples.into()),
                ("seeds", &|(.., drift)| drift.count.into()),
                ("mean translation", &|(.., drift)| drift.shift.length().value.into()),
                ("its error", &|(.., drift)| drift.shift.length().error.into()),
                ("by chance", &|(.., drift)| drift.shift.chance().into()),
                ("of one descent", &|(.., drift)| drift.shift.single.into()),
                ("mean rotation (°)", &|(.., drift)| drift.turn.length().value.into()),
                ("its error", &|(.., drift)| drift.turn.length().error.into()),
                ("by chance", &|(.., drift)| drift.turn.chance().into()),
                ("of one descent", &|(.., drift)| drift.turn.single.into()),
            ],
        )
    }

    /// Measured times.
    fn times(&self) -> Table {
        let seconds = |stage: Stage| {
            let warped = self.races.iter().find(|[race, _]| race.stage == stage);
            warped.map_or(f64::NAN, |[race, _]| race.seconds())
        };
        Table::of(
            self.races.iter().flatten(),
            &[
                ("scene", &|race| race.stage.name().into()),
                ("method", &|race| race.racer.name().into()),
                ("samples a pixel", &|race| race.samples.into()),
                ("processor seconds a step", &|race| race.seconds().into()),
                ("over warped area's", &|race| (race.seconds() / seconds(race.stage)).into()),
            ],
        )
    }
}

/// "rotation 1.2 ± 0.3 % and 0.8 ± 0.2° (?), single ones 2 % and 3°; …".
fn offsets(drifts: &[Drift]) -> String {
    listed(drifts.iter().map(|drift| {
        let many =
            if drift.samples > SAMPLES { format!(" with {} samples", drift.samples) } else { String::new() };
        let shown = |offset: Offset, scale: f64, unit: &str| {
            if offset.single < 1e-6 {
                // Rounding of what no step has moved.
                return "0".to_owned();
            }
            let doubt = if offset.is_sure() { "" } else { " (?)" };
            format!("{}{unit}{doubt}", offset.length().scaled(scale).shown())
        };
        let (shift, turn) = (shown(drift.shift, 100.0, " %"), shown(drift.turn, 1.0, "°"));
        let single = [number(100.0 * drift.shift.single), number(drift.turn.single)].join(" % and ");
        format!("{}{many} {shift} and {turn}, single ones {single}°", drift.racer.name())
    }))
}

/// Every descent.
fn descents(study: &Study) -> Table {
    Table::of(
        &study.rows,
        &[
            ("experiment", &|row| row.experiment.as_str().into()),
            ("scene", &|row| row.scene.as_str().into()),
            ("method", &|row| row.method.as_str().into()),
            ("samples a pixel", &|row| row.samples.into()),
            ("start", &|row| (row.start as usize).into()),
            ("translation error", &|row| row.translation_error.into()),
            ("rotation error (°)", &|row| row.rotation_error.into()),
            ("pose", &|row| row.pose.as_str().into()),
            ("errors", &|row| row.errors.as_str().into()),
        ],
    )
}
