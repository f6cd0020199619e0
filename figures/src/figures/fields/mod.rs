//! Figure 1: one scene, its boundary velocity, every construction of V, and the two rules measured.

mod constructions;
mod example;
mod picture;
mod rules;

use flatland::plane::exact::Arrangement;
use rayon::prelude::*;

use crate::context::Context;
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Table, write_csv, write_exr, write_png};
use constructions::{Construction, Effort, REACH, Sampled};
use example::{Example, Site, WIDTH};
use picture::{Shown, brief};
use rules::{OFFSET, Record, SIGMAS, SLACK};

/// Distance between the points of silhouettes that are measured.
const SPACING: f64 = 0.08;

/// Draws it.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let effort = Effort {
        pixels: context.spend([16, 8], [32, 16]),
        rays: context.spend(256, 2048),
        walks: context.spend(96, 1024),
        repeats: context.spend(2000, 50_000),
    };
    let example = Example::new()?;
    let arrangement = Arrangement::new(&example.scene, &example.film)?;
    let oracle = arrangement.oracle(&example.velocities);
    let harmonic = [1e-3, 1e-6].map(|tolerance| arrangement.harmonic(&example.velocities, tolerance));
    let sites = example.sites(&arrangement, SPACING);
    let speed = sites.iter().map(|site| site.velocity.length()).fold(0.0, f64::max);
    let constructions = constructions::all(&example, &oracle, harmonic.each_ref(), effort, context.seed());
    let sampled: Vec<Sampled> = constructions
        .iter()
        .map(|construction| {
            context.step(&format!("1 warp fields: {} field", construction.name));
            construction.sample(effort, context.seed())
        })
        .collect();
    let records: Vec<Record> = constructions
        .iter()
        .map(|construction| {
            context.step(&format!("1 warp fields: rules of the {} field", construction.name));
            Record::new(construction, &sites, speed, context.seed())
        })
        .collect();
    let shown = Shown {
        example: &example,
        arrangement: &arrangement,
        sites: &sites,
        speed,
        constructions: &constructions,
        sampled: &sampled,
        records: &records,
    };
    write_png(&context.path("figure1_fields.png"), &shown.draw())?;
    let data = write_data(context, &shown)?;
    Ok(section(&shown, effort, data))
}

/// Writes the numbers and the fields, and returns their file names.
fn write_data(context: &Context, shown: &Shown<'_>) -> anyhow::Result<Vec<String>> {
    let mut files = vec!["figure1_rules.csv".to_owned(), "figure1_silhouettes.csv".to_owned()];
    write_csv(&context.path(&files[0]), &rules_table(shown))?;
    write_csv(&context.path(&files[1]), &silhouettes_table(shown))?;
    for (construction, sampled) in shown.constructions.iter().zip(shown.sampled) {
        let file = format!("figure1_{}.exr", construction.name.to_lowercase().replace(' ', "_"));
        let pixel = |field: &flatland::warp::Field<glam::DVec2>| {
            [field.value.x as f32, field.value.y as f32, field.divergence as f32]
        };
        let pixels: Vec<[f32; 3]> = sampled.fields.par_iter().map(pixel).collect();
        write_exr(&context.path(&file), sampled.width, sampled.height, &pixels)?;
        files.push(file);
    }
    Ok(files)
}

fn rules_table(shown: &Shown<'_>) -> Table {
    let mut table = Table::new(&[
        "construction",
        "largest_jump",
        "largest_jump_error",
        "continuous",
        "largest_mismatch",
        "largest_mismatch_error",
        "mean_mismatch",
        "mean_mismatch_error",
        "boundary_consistent",
    ]);
    for (construction, record) in shown.constructions.iter().zip(shown.records) {
        table.row([
            construction.name.into(),
            record.largest_jump.value.into(),
            record.largest_jump.error.into(),
            yes(record.continuous).into(),
            record.largest_mismatch.value.abs().into(),
            record.largest_mismatch.error.into(),
            record.mean_mismatch.into(),
            record.mean_error.into(),
            yes(record.consistent).into(),
        ]);
    }
    table
}

fn silhouettes_table(shown: &Shown<'_>) -> Table {
    let mut table = Table::new(&[
        "construction",
        "x",
        "y",
        "nu_x",
        "nu_y",
        "v_x",
        "v_y",
        "jump",
        "jump_error",
        "mismatch_inside",
        "mismatch_inside_error",
        "mismatch_outside",
        "mismatch_outside_error",
    ]);
    for (construction, record) in shown.constructions.iter().zip(shown.records) {
        for (site, pair) in shown.sites.iter().zip(&record.silhouettes) {
            let Site { at, outward, velocity, .. } = site;
            let [inside, outside] = pair.mismatch;
            let numbers = [
                at.x,
                at.y,
                outward.x,
                outward.y,
                velocity.x,
                velocity.y,
                pair.jump.value,
                pair.jump.error,
                inside.value,
                inside.error,
                outside.value,
                outside.error,
            ];
            table.row(std::iter::once(construction.name.into()).chain(numbers.map(Into::into)));
        }
    }
    table
}

/// The table of the gallery: what each construction needs and keeps.
fn gallery_table(shown: &Shown<'_>) -> Table {
    let mut table = Table::new(&[
        "construction",
        "largest jump of V",
        "rule 1: continuous",
        "mean mismatch",
        "largest mismatch",
        "rule 2: boundary consistent",
    ]);
    for (construction, record) in shown.constructions.iter().zip(shown.records) {
        let mean = rules::Measured { value: record.mean_mismatch, error: record.mean_error };
        table.row([
            construction.name.into(),
            brief(record.largest_jump).into(),
            yes(record.continuous).into(),
            brief(mean).into(),
            brief(record.largest_mismatch).into(),
            yes(record.consistent).into(),
        ]);
    }
    table
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

fn section(shown: &Shown<'_>, effort: Effort, data: Vec<String>) -> Section {
    let inline = |source| formula(source, Placement::Inline);
    let explanation_html = format!(
        "<p>A pentagon turns, a triangle in front of it slides, the background rests. The image jumps \
         across the silhouettes, and the silhouettes move with the boundary velocity {v}, panel (a). A \
         <em>warp field</em> {field} extends it to every point of the image. It turns the boundary \
         term into an area integral if it keeps two rules: it is <em>continuous</em>, and on the \
         silhouettes it is <em>boundary consistent</em>, {rule}.</p>\
         <p>Seven constructions. <em>Direct</em>: the velocity of the point seen. <em>Gaussian</em>: the \
         direct field, filtered. <em>Boundary-aware</em>: the direct field, averaged with weights that \
         grow without bound towards a silhouette (figure 2). <em>Mean over jumps</em>: the velocities of the edges \
         themselves, averaged by their inverse distance; V is exact, no auxiliary ray is traced, and nothing is left to be \
         debiased, but a list of all edges must be at hand. <em>Oracle</em>: exact boundary \
         velocities, linear on the triangles drawn (0 at corners on no silhouette, such as the pentagon's hidden \
         one). <em>Harmonic</em>: the solution of Laplace's \
         equation between the silhouettes, by random walks. <em>Rotation</em>: one rigid motion for \
         every kernel of a grid (in the plane a translation), that of the topmost shape among a few \
         points seen in it. The mean over jumps is told where edges are, though not which of them are seen; only the oracle and \
         the harmonic field are told where the silhouettes are.</p>\
         <p>Both rules were measured at {count} points of silhouettes, {offset} kernel widths to either \
         side, and the jump also across the sides of the kernel cells. All numbers are relative to the \
         largest |v|. The mismatch is taken on the occluder's side, which owns the silhouette. A rule \
         counts as kept if it is missed by no more than {SIGMAS} standard errors + {slack} anywhere. \
         Rule 1 is kept by {continuous}; rule 2 by {consistent}; <strong>both by {both}</strong>. (The \
         rotation method applies each motion within its own kernel only, so its jumps do no harm there; \
         its mismatch does.)</p>",
        v = inline("v"),
        field = inline("V"),
        rule = inline("V·ν = v·ν"),
        count = shown.sites.len(),
        offset = crate::plot::number(OFFSET),
        slack = crate::plot::number(SLACK),
        continuous = names(shown, |record| record.continuous),
        consistent = names(shown, |record| record.consistent),
        both = names(shown, |record| record.continuous && record.consistent),
    );
    let caption = format!(
        "Colour: |V|; arrows: V; line along the silhouettes: black where V·ν = v·ν, red where it is missed. \
         Kernel width {width}; {rays} auxiliary rays a pixel for (c) and (d), a reach of {reach} for (e), {walks} walks for (g), every \
         pixel with its own random numbers. The numbers under the panels are the largest jump and the \
         largest mismatch, from the mean of {repeats} unbiased estimates at each point \
         ({half} for the harmonic field); ± is one standard error.",
        width = crate::plot::number(WIDTH),
        rays = effort.rays,
        reach = crate::plot::number(REACH * WIDTH),
        walks = effort.walks,
        repeats = effort.repeats,
        half = effort.repeats / 2,
    );
    let picture = Picture {
        file: "figure1_fields.png".into(),
        alt: "Nine panels: a scene with arrows of its boundary velocity, seven warp fields as colour and \
              arrows, and a bar chart of their jumps and boundary mismatches."
            .into(),
        caption,
    };
    Section {
        id: "fields".into(),
        title: "One boundary velocity, seven warp fields".into(),
        explanation_html,
        formula_mathml: formula(
            r"∮_∂ Δf (v·ν) \d l = ∫ ∇·(f V) \d u \quad \text{if V is continuous and } V·ν = v·ν \text{ on } ∂",
            Placement::Display,
        ),
        pictures: vec![picture],
        data,
        table: Some(gallery_table(shown)),
    }
}
