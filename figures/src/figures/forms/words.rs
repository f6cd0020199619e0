//! What figure 3 says, with its numbers.

use super::super::common::{largest, root_mean_square};
use super::Results;
use super::animation::SWING;
use super::crossing::{AUXILIARY_RAYS, KERNEL_WIDTH};
use super::exact::{STEP, difference};
use super::sampled::SETTLED;
use super::scene::SIDE;
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::Table;
use crate::plot::number;

pub(super) fn terms_caption() -> String {
    format!(
        "Exact integrals, nothing sampled; {SIDE} × {SIDE} pixels, green channel. (a) The kite slides and the \
         pinwheel turns, and both carry their shades along; the board and the bar in front are still. (b) The \
         derivative. (e) V is interpolated linearly between the silhouettes on a triangulation. (g), (l) The two \
         sides of the theorem differ by rounding alone. (h) Central differences of exact images, ε = {}. (j) and \
         (k) depend on the choice of V; their difference does not.",
        number(STEP)
    )
}

pub(super) fn sampled_caption(results: &Results<'_>) -> String {
    format!(
        "(a) {} rays a sample on average. (c) Grey: no z-score, the standard error is below {} of the derivative's \
         root mean square. (d) The last bins hold all that lies beyond. Gaussian weights ignore boundaries, and the \
         test rejects them. (e) {} samples in both forms from the same random numbers; those that agree to the last \
         bit are not shown. (f) Samples for which what is seen at T(u′) at θ is not what was seen at u′ at \
         θ_{{0}}; the boundary-aware V has a kernel {} pixels wide and {} auxiliary rays.",
        number(results.estimate.rays_per_sample()),
        number(SETTLED),
        results.pairs.len(),
        number(KERNEL_WIDTH),
        AUXILIARY_RAYS,
    )
}

pub(super) fn section(results: &Results<'_>) -> Section {
    Section {
        id: "forms".to_owned(),
        title: "Three forms of one derivative".to_owned(),
        explanation_html: explanation(results),
        formula_mathml: formula(
            r"\frac{\d I}{\d θ} = ∫ h \frac{∂f}{∂θ} \d u + ∮ h Δf (v·ν) \d l = \
              ∫ [h \frac{∂f}{∂θ} + ∇·(V h f)] \d u = \frac{\d}{\d θ} ∫ (h f)(T(u′); θ) |\det D T| \d u′",
            Placement::Display,
        ),
        pictures: pictures(),
        data: vec!["figure3_pixels.csv".to_owned(), "figure3_crossings.csv".to_owned()],
        table: Some(table(results)),
    }
}

fn explanation(results: &Results<'_>) -> String {
    let inline = |source| formula(source, Placement::Inline);
    let (worst, equal) = agreement(&results.pairs);
    format!(
        "<p>The derivative of a pixel has two parts. Inside shapes the shade changes smoothly: the interior term. \
         Along silhouettes one shade replaces another: the edge integral of the jump {jump} times the normal \
         velocity {normal}. That is the Reynolds transport theorem. The divergence theorem turns the edge integral \
         into an area integral, for any field {v} that is continuous and moves with every silhouette that is seen. \
         On this scene both sides are known exactly, and they differ by {rounding} at most: rounding, next to \
         derivatives up to {size}. Central differences of exact images agree with both to {central}. With a box \
         filter the area integral also sees the filter jump on the pixel’s own edge, and the flux through that edge \
         must be subtracted. It is not small: its root mean square is {flux} times that of the derivative.</p>\
         <p>Warped-area sampling estimates the area integral from auxiliary rays, without looking for edges. Over \
         {count} pixels its z-scores have a root mean square of {z}; normal errors would give 1, and heavy tails \
         give more. With Gaussian weights, which are continuous but not boundary consistent, it is {gaussian}. The \
         third form moves the samples instead: {t}. Its samples equal those of the area form up to {worst} of the \
         largest one ({equal} of {pairs} to the last bit). The two are one estimator, written in two ways.</p>\
         <p>The animation shows {t}. A good field keeps every sample on its side of the silhouettes, to first order \
         in θ − θ₀. If the fraction of samples that change sides grows like θ − θ₀, they are part of the derivative, \
         and sampling misses them; if it grows like (θ − θ₀)<sup>2</sup>, they are not. The powers fitted to \
         panel (f) are {none} without a warp, {direct} for the direct field, {aware} for the boundary-aware field and \
         {oracle} for the oracle field. “Samples never cross” is a statement about the derivative. At a finite θ the \
         straight paths of T leave the arcs of a rotation, and T folds where V changes quickly.</p>",
        jump = inline("Δf"),
        normal = inline("v·ν"),
        v = inline("V"),
        t = inline("T(u′) = u′ + (θ − θ_0) V(u′)"),
        rounding = number(worst_residual(results)),
        size = number(largest(&results.tent.total)),
        central = number(largest(&difference(&results.central, &results.tent.total))),
        flux = number(root_mean_square(&results.boxed.flux) / root_mean_square(&results.boxed.total)),
        count = results.estimate.scores().len(),
        z = number(results.estimate.root_mean_square_score()),
        gaussian = number(results.gaussian.root_mean_square_score()),
        worst = number(worst),
        pairs = results.pairs.len(),
        none = power(results, 0),
        direct = power(results, 1),
        aware = power(results, 2),
        oracle = power(results, 3),
    )
}

fn worst_residual(results: &Results<'_>) -> f64 {
    let residual = |terms: &super::Terms| largest(&difference(&terms.area, &terms.edge));
    residual(&results.tent).max(residual(&results.boxed))
}

/// The largest difference of two forms relative to the largest sample, and how many agree to the bit.
fn agreement(pairs: &[(f64, f64)]) -> (f64, usize) {
    let size = pairs.iter().map(|(a, _)| a.abs()).fold(0.0, f64::max);
    let apart = pairs.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (apart / size, pairs.iter().filter(|(a, b)| a == b).count())
}

/// The power of θ − θ₀ with which a construction's fraction grows, by least squares on logarithms over
/// the places where some samples changed.
fn power(results: &Results<'_>, construction: usize) -> String {
    let (_, curve) = &results.crossings[construction];
    let logs: Vec<[f64; 2]> = curve.iter().filter(|p| p[1] > 0.0).map(|p| p.map(f64::ln)).collect();
    let count = logs.len() as f64;
    let [x, y] = [0, 1].map(|axis| logs.iter().map(|p| p[axis]).sum::<f64>() / count);
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(xy, xx), p| {
        let d = p[0] - x;
        (xy + d * (p[1] - y), xx + d * d)
    });
    format!("{:.1}", xy / xx)
}

fn pictures() -> Vec<Picture> {
    let picture = |file: &str, alt: &str, caption: String| Picture {
        file: file.to_owned(),
        alt: alt.to_owned(),
        caption,
    };
    vec![
        picture(
            "figure3_forms.png",
            "Images of the interior term, the edge integral, the area integral and their differences, for a tent \
             and a box filter.",
            String::new(),
        ),
        picture(
            "figure3_samples.png",
            "The sampled area integral, its standard error and z-scores; differences between two forms of one \
             sample; fractions of samples that cross silhouettes.",
            String::new(),
        ),
        picture(
            "figure3_motion.png",
            "Animation: sample points moved by three warp fields while a kite and a pinwheel move.",
            format!(
                "Samples moved by T while θ swings by ±{} around θ₀. Orange-red: what is seen at the sample is no \
                 longer the shape it started on.",
                number(SWING)
            ),
        ),
    ]
}

fn table(results: &Results<'_>) -> Table {
    let (tent, boxed) = (&results.tent, &results.boxed);
    let mut table = Table::new(&["quantity (root mean square over pixels)", "tent filter", "box filter"]);
    let mut row = |name: &str, values: [&[f64]; 2]| {
        table.row([name.into(), root_mean_square(values[0]).into(), root_mean_square(values[1]).into()]);
    };
    row("interior term", [&tent.interior, &boxed.interior]);
    row("edge integral", [&tent.edge, &boxed.edge]);
    row("area integral less pixel-edge flux", [&tent.area, &boxed.area]);
    row("pixel-edge flux", [&tent.flux, &boxed.flux]);
    row(
        "area integral less flux − edge integral",
        [&difference(&tent.area, &tent.edge), &difference(&boxed.area, &boxed.edge)],
    );
    table
}
