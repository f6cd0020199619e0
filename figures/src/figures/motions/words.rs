//! What the picture says, in words and numbers.

use super::study::{Entry, REFERENCE_RUNS, SURE, Study};
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Cell, Table};
use crate::plot::number;

pub(super) const PICTURE: &str = "figure12_motions.png";
pub(super) const DATA: &str = "figure12_motions.csv";

pub(super) fn section(studies: &[Study]) -> Section {
    Section {
        id: "motions".to_owned(),
        title: "Variance and bias in space".to_owned(),
        explanation_html: explanation(studies),
        formula_mathml: formula(
            r"\text{mean squared error at time } t = \text{bias}^2 + \frac{\text{variance} · \text{seconds}}{t}",
            Placement::Display,
        ),
        pictures: vec![Picture {
            file: PICTURE.to_owned(),
            alt: "Rotating cylinders and foliage: gradient image, error of every method, bias and cost"
                .to_owned(),
            caption: String::new(),
        }],
        data: vec![DATA.to_owned()],
        table: Some(table(studies)),
    }
}

/// The text under the picture.
pub(super) fn caption(studies: &[Study]) -> String {
    let noise = studies.iter().map(|s| number((s.reference.floor / s.reference.power()).sqrt()));
    format!(
        "Luminance, direct light. Small pictures after the reference: mean of all runs minus reference, in the reference’s \
         colours. The reference is edge sampling with {REFERENCE_RUNS} runs of many samples; its own noise, {} of its \
         root mean square, is taken out of all numbers. Bars: standard errors over independent runs. \
         Biases are those of slopes with quiet pixels weighing more; a disc is filled where a bias is more than {SURE} \
         standard errors away from 0.",
        noise.collect::<Vec<_>>().join(" and ")
    )
}

fn explanation(studies: &[Study]) -> String {
    format!(
        "<p>When things rotate, neighbouring edges move differently. Two scenes show what that does: thin cylinders \
         that turn as a group, near ones to the right and far ones to the left, and leaves in a ball. A method that lets all \
         that it sees in one kernel of directions follow one rigid motion (the rotation heuristic, here with kernels as wide \
         as a pixel) cannot have both edges right; \
         a mean of velocities weighted by the distance to the boundary can. With a fixed number of auxiliary rays \
         the quotient of two sums is biased all the same; debiasing removes that, and pays in variance. The warp \
         field made of the edges near a ray needs no auxiliary ray and no quotient of random sums.</p>{}{}<p>Samples of area \
         methods have heavy tails: where two edges with different motions meet, no continuous field has bounded \
         divergence. A short run mostly finds too little variance, and now and then one sample that decides everything; the \
         bars tell how well each number is known.</p>",
        studies.iter().map(biases).collect::<String>(),
        studies.iter().map(costs).collect::<String>(),
    )
}

/// Which methods are biased on a scene, which are not, and of which this run cannot tell.
fn biases(study: &Study) -> String {
    let biased: Vec<String> = study.entries.iter().filter(|e| e.is_biased()).map(named_slope).collect();
    let rest = study.entries.iter().filter(|e| !e.is_biased());
    let (vague, sound): (Vec<&Entry>, Vec<&Entry>) = rest.partition(|e| e.is_vague());
    let list = |entries: Vec<&Entry>| entries.into_iter().map(named_slope).collect::<Vec<_>>().join("; ");
    let mut text = format!(
        "<p>On the {}, with the slope of each method’s mean on the reference, and the same with quiet \
         pixels weighing more: ",
        study.setting.name
    );
    text += &match biased.is_empty() {
        true => "no method is shown to be biased by this run. ".to_owned(),
        false => format!("<strong>biased</strong> {}. ", biased.join("; ")),
    };
    if !sound.is_empty() {
        text += &format!("No bias is found in {}. ", list(sound));
    }
    if !vague.is_empty() {
        text += &format!("Too noisy to tell: {}. ", list(vague));
    }
    text + "</p>"
}

fn named_slope(entry: &Entry) -> String {
    format!("{} ({}; {})", entry.method.name, entry.slope.shown(), entry.quiet.shown())
}

/// What a given precision costs, against the cheapest.
fn costs(study: &Study) -> String {
    let mut order: Vec<&Entry> = study.entries.iter().collect();
    order.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    let Some((first, rest)) = order.split_first() else { return String::new() };
    let factors = rest.iter().map(|e| format!("{} {}", e.method.name, number(e.cost() / first.cost())));
    format!(
        "<p>For equal variance on the {}, {} takes the least time; in multiples of it: {}.</p>",
        study.setting.name,
        first.method.name,
        factors.collect::<Vec<_>>().join("; "),
    )
}

/// Every number.
pub(super) fn table(studies: &[Study]) -> Table {
    let mut table = Table::new(&[
        "scene",
        "method",
        "samples a pixel",
        "runs",
        "processor seconds a run",
        "slope",
        "its error",
        "slope, quiet pixels",
        "its error",
        "relative bias²",
        "its error",
        "relative variance",
        "its error",
        "variance × seconds",
        "not finite",
    ]);
    for study in studies {
        for entry in &study.entries {
            let m = &entry.measured;
            let cells: [Cell; 15] = [
                study.setting.name.into(),
                entry.method.name.into(),
                entry.samples.into(),
                (entry.runs as usize).into(),
                entry.seconds.into(),
                entry.slope.value.into(),
                entry.slope.error.into(),
                entry.quiet.value.into(),
                entry.quiet.error.into(),
                m.bias2.into(),
                m.bias2_error.into(),
                m.variance.into(),
                m.variance_error.into(),
                entry.cost().into(),
                entry.non_finite.into(),
            ];
            table.row(cells);
        }
    }
    table
}
