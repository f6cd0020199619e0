//! What the picture says, in words and numbers.

use super::study::{Agreement, Part, Study};
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::ratio::Ratio;

pub(super) const PICTURE: &str = "figure11_mesh.png";
pub(super) const DATA: &str = "figure11_terms.csv";

pub(super) fn section(study: &Study, data: Vec<String>) -> Section {
    Section {
        id: "mesh".to_owned(),
        title: "A mesh and its derivative".to_owned(),
        explanation_html: explanation(study),
        formula_mathml: formula(
            r"∂_θ I = \text{interior} + \text{primary} + \text{secondary}, \quad ∮ Δf (v·ν) \d l = ∫ ∇·(V f) \d u",
            Placement::Display,
        ),
        pictures: vec![Picture {
            file: PICTURE.to_owned(),
            alt: "A bunny in the corner of a room; its gradient image by three methods, and its terms by two"
                .to_owned(),
            caption: String::new(),
        }],
        data,
        table: Some(table(study)),
    }
}

/// The text under the picture.
pub(super) fn caption(study: &Study) -> String {
    let whole = study.edges.reference(Part::Whole);
    let warped = study.warped.agreement(Part::Whole, &whole);
    let differences = study.differences.agreement(&whole);
    let by_differences = study.warped.agreement(Part::Whole, &study.differences.reference());
    format!(
        "Luminance; red pixels grow brighter with θ, blue ones darker. All panels but (h) and (l) share the colours of \
         the bar in the first row. (b) {} samples a pixel. Slope on edge sampling (d, {} samples): {}, relative mean squared \
         error {}; on finite differences (c, {} samples, step {} rad): slope {}. Finite differences on edge sampling: \
         slope {}, relative mean squared error {}. The noise of what is compared with is taken out, errors of slopes are \
         standard errors over {} independent runs. Pixels in blocks share random numbers, and so their noise.",
        study.warped.samples,
        study.edges.samples,
        slope(warped.slope),
        number(warped.error),
        study.differences.samples,
        number(study.differences.step),
        slope(by_differences.slope),
        slope(differences.slope),
        number(differences.error),
        super::study::RUNS,
    )
}

fn explanation(study: &Study) -> String {
    let agreement = |part| study.warped.agreement(part, &study.edges.reference(part));
    format!(
        "<p>From here on scenes are triangle meshes in space. A bunny of {} triangles stands in the corner of a room, under \
         a small square lamp, and turns about its vertical axis. Every pixel changes, for four reasons that \
         are told apart. <em>Interior</em>: the facets turn to or from the light while nothing jumps. \
         <em>Primary</em>: silhouettes, and edges between facets, move over pixels. <em>Secondary, \
         direct light</em>: seen from a point of the floor, the bunny’s outline moves over the lamp; that is the \
         shadow, on floor and wall. <em>Secondary, indirect light</em>: the same in light that walls and bunny \
         scatter on; the scene is rendered with direct light alone as well, and the difference is shown. \
         Only the first would be found by differentiating the renderer as a program.</p>\
         <p>Warped area turns each of the others into an area integral with a warp field of its own, on the film \
         and on the directions at every bounce. Edge sampling, which knows all edges, draws points on them; finite differences \
         render the scene twice. Three methods that share little give one image. Term by term, the slope of warped area \
         on edge sampling is {} for the interior, {} for silhouettes, {} for direct shadows and {} for indirect light, which \
         is faint: its colours are stretched.</p>\
         <p>The time was {} s for warped area, {} s for edge sampling, both with and without indirect \
         light, and {} s for finite differences. Those have a step of {} of a pixel at the bunny’s rim; with a \
         longer one they blur the edges that move, with a shorter one noise grows. One parameter flatters \
         them and forward derivatives alike; what the methods cost against one another is the next figure’s subject.</p>",
        study.triangles,
        slope(agreement(Part::Interior).slope),
        slope(agreement(Part::Primary).slope),
        slope(agreement(Part::Shadow).slope),
        slope(agreement(Part::Indirect).slope),
        number(study.warped.seconds),
        number(study.edges.seconds),
        number(study.differences.seconds),
        number(super::study::STEP),
    )
}

fn slope(slope: Ratio) -> String {
    if slope.value.is_finite() { slope.shown() } else { "not defined".to_owned() }
}

/// Every part by every method, compared with edge sampling.
pub(super) fn table(study: &Study) -> Table {
    let mut table = Table::new(&[
        "part",
        "method",
        "compared with",
        "samples a pixel",
        "slope",
        "standard error",
        "relative mean squared error",
    ]);
    let mut row = |part: Part, method: &str, with: &str, samples: usize, agreement: Agreement| {
        let Agreement { slope, error } = agreement;
        let cells: [Cell; 7] = [
            part.name().into(),
            method.into(),
            with.into(),
            samples.into(),
            slope.value.into(),
            slope.error.into(),
            error.into(),
        ];
        table.row(cells);
    };
    let (warped, edges) = ("warped area", "edge sampling");
    for part in Part::ALL {
        let agreement = study.warped.agreement(part, &study.edges.reference(part));
        row(part, warped, edges, study.warped.samples, agreement);
    }
    let differences = study.differences.reference();
    let samples = study.differences.samples;
    let agreement = study.warped.agreement(Part::Whole, &differences);
    row(Part::Whole, warped, "finite differences", study.warped.samples, agreement);
    let agreement = study.differences.agreement(&study.edges.reference(Part::Whole));
    row(Part::Whole, "finite differences", edges, samples, agreement);
    table
}
