//! One scene, its boundary velocity, every construction of V, and the two rules measured.

mod constructions;
mod example;
mod picture;
mod rules;

use flatland::plane::exact::Arrangement;
use glam::DVec3;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use constructions::{Construction, Effort, REACH, Sampled};
use example::{Example, WIDTH};
use picture::{Shown, brief};
use rules::{OFFSET, Record, SIGMAS, SLACK};

/// Distance between the measured points of silhouettes.
const SPACING: f64 = 0.08;

/// Draws the figure.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let effort = Effort {
        pixels: context.spend([16, 8], [32, 16]),
        rays: context.spend(256, 2048),
        walks: context.spend(96, 1024),
        repeats: context.spend(800, 50_000),
    };
    let example = Example::new()?;
    let arrangement = Arrangement::new(&example.scene, &example.film)?;
    let oracle = arrangement.oracle(&example.velocities);
    let harmonic = [1e-3, 1e-6].map(|tolerance| arrangement.harmonic(&example.velocities, tolerance));
    let sites = example.sites(&arrangement, SPACING);
    let speed = sites.iter().map(|site| site.velocity.length()).fold(0.0, f64::max);
    let constructions = constructions::all(&example, &oracle, harmonic.each_ref(), effort, context.seed());
    let step = |what: &str, construction: &Construction<'_>| {
        context.step(&format!("{what}{} field", construction.name));
    };
    let sample = |construction: &Construction<'_>| {
        step("", construction);
        construction.sample(effort, context.seed())
    };
    let record = |construction: &Construction<'_>| {
        step("rules of the ", construction);
        Record::new(construction, &sites, speed, context.seed())
    };
    let sampled: Vec<Sampled> = constructions.iter().map(sample).collect();
    let records: Vec<Record> = constructions.iter().map(record).collect();
    let shown = Shown {
        example: &example,
        arrangement: &arrangement,
        sites: &sites,
        speed,
        constructions: &constructions,
        sampled: &sampled,
        records: &records,
    };
    context.png("fields.png", &shown.draw())?;
    let data = write_data(context, &shown)?;
    prose(&shown, effort)?.section("fields", data, gallery_table(&shown))
}

/// Writes the numbers and the fields, and returns their file names.
fn write_data(context: &Context, shown: &Shown<'_>) -> anyhow::Result<Vec<String>> {
    let mut files = vec![
        context.csv("fields_rules.csv", &rules_table(shown))?,
        context.csv("fields_silhouettes.csv", &silhouettes_table(shown))?,
    ];
    for (construction, sampled) in shown.constructions.iter().zip(shown.sampled) {
        let file = format!("fields_{}.exr", construction.name.to_lowercase().replace(' ', "_"));
        let pixels: Vec<DVec3> = sampled.fields.iter().map(|f| f.value.extend(f.divergence)).collect();
        files.push(context.exr(&file, sampled.width, &pixels)?);
    }
    Ok(files)
}

fn rules_table(shown: &Shown<'_>) -> Table {
    Table::of(
        shown.constructions.iter().zip(shown.records),
        &[
            ("construction", &|(c, _)| c.name.into()),
            ("largest_jump", &|(_, r)| r.largest_jump.value.into()),
            ("largest_jump_error", &|(_, r)| r.largest_jump.error.into()),
            ("continuous", &|(_, r)| yes(r.continuous).into()),
            ("largest_mismatch", &|(_, r)| r.largest_mismatch.value.abs().into()),
            ("largest_mismatch_error", &|(_, r)| r.largest_mismatch.error.into()),
            ("mean_mismatch", &|(_, r)| r.mean_mismatch.value.into()),
            ("mean_mismatch_error", &|(_, r)| r.mean_mismatch.error.into()),
            ("boundary_consistent", &|(_, r)| yes(r.consistent).into()),
        ],
    )
}

fn silhouettes_table(shown: &Shown<'_>) -> Table {
    let records = shown.constructions.iter().zip(shown.records);
    Table::of(
        records.flat_map(|(construction, record)| {
            let pairs = shown.sites.iter().zip(&record.silhouettes);
            pairs.map(|(site, pair)| (construction.name, site, pair))
        }),
        &[
            ("construction", &|(name, ..)| (*name).into()),
            ("x", &|(_, site, _)| site.at.x.into()),
            ("y", &|(_, site, _)| site.at.y.into()),
            ("nu_x", &|(_, site, _)| site.outward.x.into()),
            ("nu_y", &|(_, site, _)| site.outward.y.into()),
            ("v_x", &|(_, site, _)| site.velocity.x.into()),
            ("v_y", &|(_, site, _)| site.velocity.y.into()),
            ("jump", &|(.., pair)| pair.jump.value.into()),
            ("jump_error", &|(.., pair)| pair.jump.error.into()),
            ("mismatch_inside", &|(.., pair)| pair.mismatch[0].value.into()),
            ("mismatch_inside_error", &|(.., pair)| pair.mismatch[0].error.into()),
            ("mismatch_outside", &|(.., pair)| pair.mismatch[1].value.into()),
            ("mismatch_outside_error", &|(.., pair)| pair.mismatch[1].error.into()),
        ],
    )
}

/// The table of the gallery: requirements and properties of each construction.
fn gallery_table(shown: &Shown<'_>) -> Table {
    Table::of(
        shown.constructions.iter().zip(shown.records),
        &[
            ("construction", &|(c, _)| c.name.into()),
            ("largest jump of V", &|(_, r)| brief(r.largest_jump).into()),
            ("rule 1: continuous", &|(_, r)| yes(r.continuous).into()),
            ("mean mismatch", &|(_, r)| brief(r.mean_mismatch).into()),
            ("largest mismatch", &|(_, r)| brief(r.largest_mismatch).into()),
            ("rule 2: boundary consistent", &|(_, r)| yes(r.consistent).into()),
        ],
    )
}

fn yes(kept: bool) -> &'static str {
    if kept { "yes" } else { "no" }
}

fn names(shown: &Shown<'_>, keeps: impl Fn(&Record) -> bool) -> String {
    let kept = shown.constructions.iter().zip(shown.records).filter(|(_, record)| keeps(record));
    let names: Vec<&str> = kept.map(|(construction, _): (&Construction<'_>, _)| construction.name).collect();
    match names.as_slice() {
        [] => "none".to_owned(),
        [only] => (*only).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

fn prose(shown: &Shown<'_>, effort: Effort) -> anyhow::Result<Prose> {
    Prose::new(
        include_str!("fields.md"),
        &[
            ("count", &shown.sites.len()),
            ("offset", &number(OFFSET)),
            ("sigmas", &SIGMAS),
            ("slack", &number(SLACK)),
            ("continuous", &names(shown, |record| record.continuous)),
            ("consistent", &names(shown, |record| record.consistent)),
            ("both", &names(shown, |record| record.continuous && record.consistent)),
            ("width", &number(WIDTH)),
            ("rays", &effort.rays),
            ("reach", &number(REACH * WIDTH)),
            ("walks", &effort.walks),
            ("repeats", &effort.repeats),
            ("repeats_harmonic", &(effort.repeats / 2)),
        ],
    )
}
