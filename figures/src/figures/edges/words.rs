//! What figure 4 says, with its numbers.

use super::study::{Plant, Racer, Run};
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Cell, Table};
use crate::plot::number;

pub(super) fn rays_caption() -> String {
    "Every leaf turns about its own stem. A larger plant has the smaller one in front, so the picture stops changing \
     while its hidden depth grows. (a), (b) Orange-red: silhouettes that are seen. Thin dark lines: all edges. (c) \
     Lines: by points drawn uniformly on all edges; rings: from the exact arrangement. (d) Mean over pixels and \
     channels. (f) Proportional to the rays needed for a given precision. The estimate with 16 rays is biased, and \
     its variance does not say so."
        .to_owned()
}

pub(super) fn time_caption() -> String {
    format!(
        "Times are the faster of two runs on one thread, and vary from run to run; all else in this section does not. \
         Edge sampling lists the edges of a pixel once for {} samples. (c) Above the dashed line edge sampling is \
         better, below it warped area is.",
        Racer::Edges.timed_samples()
    )
}

pub(super) fn section(plants: &[Plant]) -> Section {
    let picture = |file: &str, alt: &str| Picture {
        file: file.to_owned(),
        alt: alt.to_owned(),
        caption: String::new(),
    };
    Section {
        id: "edges".to_owned(),
        title: "Edge sampling and warped area as a scene grows".to_owned(),
        explanation_html: explanation(plants),
        formula_mathml: formula(
            r"∮ h Δf (v·ν) \d l ≈ \frac{L}{N} ∑_{i=1}^N h(u_i) Δf(u_i) (v·ν)(u_i) \bold{1}[u_i \text{ is seen}]",
            Placement::Display,
        ),
        pictures: vec![
            picture(
                "figure4_edges.png",
                "Two plants with their visible silhouettes; visible part of the edges, variance and rays of three \
                 methods against the number of leaves.",
            ),
            picture(
                "figure4_time.png",
                "Time of a sample, time for a given precision, and the ratio of methods.",
            ),
        ],
        data: vec!["figure4_edges.csv".to_owned(), "figure4_time.csv".to_owned()],
        table: Some(table(plants)),
    }
}

fn explanation(plants: &[Plant]) -> String {
    let (Some(first), Some(last)) = (plants.first(), plants.last()) else { return String::new() };
    let ratio = |plant: &Plant, value: fn(&Run) -> f64| number(value(&plant.runs[1]) / value(&plant.runs[0]));
    format!(
        "<p>Edge sampling draws points on edges instead of looking for a field. In the image plane that can be done \
         very well: a tree finds all edges that touch a pixel’s filter, each is clipped exactly, and one is chosen by \
         its length (their sum is {l}). What remains is occlusion. A point on an edge that something hides gives \
         nothing, and has cost a ray.</p>\
         <p>With {few} leaves {seen_few} of the edge length is seen, with {many} leaves {seen_many}, and then \
         {wasted} of all edge samples are wasted. The image has long stopped changing by then; the edges behind it \
         have not, and the variance of edge sampling grows with their length. It is the depth complexity that \
         does it: {depth} leaves lie over each point. Warped area asks only what is seen. It has no list of edges, \
         and its variance stays the same once the image does. It is highest where bright gaps remain between leaves.</p>\
         <p>On simple scenes edge sampling wins clearly: at {few} leaves unbiased \
         warped area needs {rays_few} times its rays and {time_few} times its time for the same precision. At \
         {many} leaves the factors are {rays_many} and {time_many}. {crossings} Edge sampling spends one of its two or \
         three rays on the interior term, which is zero here. And it needs the edges: a list of {edges} of them at \
         the end, brought up to date whenever the scene moves. An implicit surface has no such list.</p>\
         <p>{bias}</p>",
        l = formula("L", Placement::Inline),
        few = first.leaves,
        many = last.leaves,
        seen_few = percent(first.visible),
        seen_many = percent(last.visible),
        wasted = percent(last.wasted),
        depth = number(last.depth),
        rays_few = ratio(first, Run::rays_cost),
        time_few = ratio(first, Run::time_cost),
        rays_many = ratio(last, Run::rays_cost),
        time_many = ratio(last, Run::time_cost),
        crossings = crossings(plants),
        edges = last.edges,
        bias = bias(plants),
    )
}

fn percent(part: f64) -> String {
    format!("{} %", number(100.0 * part))
}

/// Where warped area overtakes edge sampling, if it does.
fn crossings(plants: &[Plant]) -> String {
    let place = |what: &str, value: fn(&Run) -> f64| {
        let overtaken = plants.iter().find(|plant| value(&plant.runs[1]) < value(&plant.runs[0]));
        overtaken.map_or_else(
            || format!("In {what} edge sampling is ahead throughout."),
            |plant| format!("In {what} warped area is ahead from {} leaves on.", plant.leaves),
        )
    };
    [
        place("variance", |run| run.variance),
        place("variance × rays", Run::rays_cost),
        place("variance × time", Run::time_cost),
    ]
    .join(" ")
}

/// What the estimates recover of the exact derivative, on the largest plant for which it is known.
fn bias(plants: &[Plant]) -> String {
    let Some(plant) = plants.iter().rfind(|plant| plant.runs.iter().all(|run| run.recovered.is_some()))
    else {
        return String::new();
    };
    let words = Racer::ALL
        .into_iter()
        .zip(&plant.runs)
        .map(|(racer, run)| format!("{}: {}", racer.name(), shown(run)));
    format!(
        "Projected on the exact derivative of the plant with {} leaves, the estimates recover ({}). 16 rays recover \
         less than all: their bias. Unbiased warped area needs a warning too. Where silhouettes with different \
         motions meet, V takes several values around one point, and ∇·V grows like 1/r there. That has a mean but no \
         variance: the integral of its square diverges, logarithmically for V itself and faster for its debiased \
         estimate, whose rare corrections are large. Foliage is full of such points. A short run then tends to fall \
         short of the mean by more than its standard error admits, and the variances drawn here for warped area are \
         those of a finite run.",
        plant.leaves,
        words.collect::<Vec<_>>().join("; ")
    )
}

fn shown(run: &Run) -> String {
    run.recovered.map_or_else(|| "–".to_owned(), |[part, error]| format!("{part:.3} ± {error:.3}"))
}

fn table(plants: &[Plant]) -> Table {
    let mut table = Table::new(&[
        "leaves",
        "edges",
        "depth",
        "edge length seen",
        "edge samples wasted",
        "variance, edge sampling",
        "variance, warped area",
        "recovered: edge sampling",
        "recovered: warped area",
        "recovered: 16 rays",
    ]);
    for plant in plants {
        let recovered = plant.runs.iter().map(|run| Cell::Text(shown(run)));
        let cells = [
            plant.leaves.into(),
            plant.edges.into(),
            plant.depth.into(),
            plant.visible.into(),
            plant.wasted.into(),
            plant.runs[0].variance.into(),
            plant.runs[1].variance.into(),
        ];
        table.row(cells.into_iter().chain(recovered));
    }
    table
}
