//! A mesh in a room, and the gradient image of its motion, term by term.

mod picture;
mod scene;
mod study;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;
pub(super) use scene::standing_bunny;
use study::{Part, RUNS, STEP, Study};

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    let shows_indirect = context.spend(false, true);
    let prose = prose(&study, shows_indirect)?;
    context.png("mesh.png", &picture::draw(&study, shows_indirect))?;
    let table = table(&study);
    let mut data = vec![context.csv("mesh_terms.csv", &table)?];
    for part in Part::ALL {
        for (name, method) in [("warped", &study.warped), ("edges", &study.edges)] {
            let file = format!("mesh_{}_{name}.exr", part.names()[1]);
            data.push(context.exr(&file, study.side, &method.mean(part))?);
        }
    }
    let differences = study.differences.mean(Part::Whole);
    data.push(context.exr("mesh_whole_differences.exr", study.side, &differences)?);
    prose.section("mesh", data, table)
}

/// Standard error of a slope above which it is not reported.
const TOO_NOISY: f64 = 0.1;

/// The text on the gradient image and its terms.
fn prose(study: &Study, shows_indirect: bool) -> anyhow::Result<Prose> {
    let of_colours = if shows_indirect {
        "All panels but (h) and (l) share the colours of the bar in the first row."
    } else {
        "All panels share the colours of the bar. Indirect light is so faint that a draft has too few samples to show it."
    };
    let term = |part| slope(study.warped.agreement(part, &study.edges).0);
    let warped = study.warped.agreement(Part::Whole, &study.edges);
    let differences = study.differences.agreement(Part::Whole, &study.edges);
    let by_differences = study.warped.agreement(Part::Whole, &study.differences);
    Prose::new(
        include_str!("mesh.md"),
        &[
            ("triangles", &study.triangles),
            ("interior", &term(Part::Interior)),
            ("primary", &term(Part::Primary)),
            ("shadow", &term(Part::Shadow)),
            ("indirect", &term(Part::Indirect)),
            ("seconds_warped", &number(study.warped.seconds)),
            ("seconds_edges", &number(study.edges.seconds)),
            ("seconds_differences", &number(study.differences.seconds)),
            ("step_pixels", &number(STEP)),
            ("samples_warped", &study.warped.samples),
            ("samples_edges", &study.edges.samples),
            ("samples_differences", &study.differences.samples),
            ("slope", &slope(warped.0)),
            ("error", &number(warped.1)),
            ("step", &number(study.step)),
            ("slope_by_differences", &slope(by_differences.0)),
            ("slope_differences", &slope(differences.0)),
            ("error_differences", &number(differences.1)),
            ("runs", &RUNS),
            ("of_colours", &of_colours),
        ],
    )
}

/// A slope, with its value only if the error is small enough.
fn slope(slope: Ratio) -> String {
    match slope.error {
        _ if !slope.value.is_finite() => "not defined".to_owned(),
        error if error > TOO_NOISY => format!("lost in noise (± {} with so few samples)", number(error)),
        _ => slope.shown(),
    }
}

/// Every part by warped area, compared with edge sampling, and both whole gradients compared with finite
/// differences.
fn table(study: &Study) -> Table {
    let (warped, edges) = (("warped area", &study.warped), ("edge sampling", &study.edges));
    let differences = ("finite differences", &study.differences);
    let mut rows = Part::ALL.map(|part| (part, warped, edges)).to_vec();
    rows.extend([(Part::Whole, warped, differences), (Part::Whole, differences, edges)]);
    let compared =
        rows.into_iter().map(|(part, one, other)| (part, one, other.0, one.1.agreement(part, other.1)));
    Table::of(
        compared,
        &[
            ("part", &|(part, ..)| part.names()[0].into()),
            ("method", &|(_, one, ..)| one.0.into()),
            ("compared with", &|(_, _, other, _)| (*other).into()),
            ("samples a pixel", &|(_, one, ..)| one.1.samples.into()),
            ("slope", &|(.., (slope, _))| slope.value.into()),
            ("standard error", &|(.., (slope, _))| slope.error.into()),
            ("relative mean squared error", &|(.., (_, error))| (*error).into()),
        ],
    )
}
