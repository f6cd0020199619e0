//! Chains: an emitter seen in a curved mirror, and a weight for every point of a chain.

mod picture;
mod study;

use flatland::chain::ChainTerms;

use self::picture::BAND;
use self::study::{RAYS, Study, WEIGHTINGS};
use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::prose::Prose;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    context.step("drawing");
    context.png("chains.png", &picture::draw(&study))?;
    let table = table(&study);
    let data = vec![context.csv("chains.csv", &table)?];
    prose(&study)?.section("chains", data, table)
}

fn prose(study: &Study) -> anyhow::Result<Prose> {
    let slope = |case: usize, weighting: usize| {
        let [slope, error] = study.cases[case].slope(weighting);
        format!("{slope:.3} ± {error:.3}").replace('-', "−")
    };
    Prose::new(
        include_str!("chains.md"),
        &[
            ("rays", &RAYS),
            ("samples", &study.samples),
            ("band", &BAND),
            ("emitter_every", &slope(0, 0)),
            ("emitter_first", &slope(0, 1)),
            ("emitter_last", &slope(0, 2)),
            ("mirror_every", &slope(1, 0)),
            ("mirror_first", &slope(1, 1)),
            ("mirror_last", &slope(1, 2)),
        ],
    )
}

/// The derivative of every pixel.
fn table(study: &Study) -> Table {
    let pixels = study.cases.iter().flat_map(|case| (0..case.exact.len()).map(move |pixel| (case, pixel)));
    let rows = pixels.flat_map(|(case, pixel)| (0..WEIGHTINGS.len()).map(move |w| (case, pixel, w)));
    Table::of(
        rows,
        &[
            ("motion", &|(case, ..)| case.name.into()),
            ("pixel", &|(_, pixel, _)| (*pixel).into()),
            ("weights", &|(.., w)| WEIGHTINGS[*w].name.into()),
            ("derivative", &|(case, pixel, w)| case.found[*w][0][*pixel].into()),
            ("its standard error", &|(case, pixel, w)| case.found[*w][1][*pixel].into()),
            ("exact", &|(case, pixel, _)| ChainTerms::total(&case.exact[*pixel]).into()),
            ("exact interior", &|(case, pixel, _)| case.exact[*pixel].interior.into()),
            ("exact primary", &|(case, pixel, _)| case.exact[*pixel].primary.into()),
            ("exact seen in the mirror", &|(case, pixel, _)| case.exact[*pixel].chain.into()),
        ],
    )
}
