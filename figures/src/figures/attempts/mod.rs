//! Figure 2: the three attempts along a line across a silhouette, and the weight that makes the third.

mod check;
mod edge;
mod lines;
mod weights;

use crate::context::Context;
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Table, write_csv, write_png};
use check::Check;
use edge::{Edge, Profile, Weight};
use weights::Around;

/// Distances of the two points from the silhouette, in kernel widths.
const NEAR: f64 = 0.3;
const FAR: f64 = 2.0;

/// Draws it.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let edge = Edge::new()?;
    context.step("2 three attempts: along the line");
    let places = edge::places(context.spend(120, 240));
    let estimates = context.spend(3000, 50_000);
    let profiles = edge::profiles(&edge, &places, estimates, context.seed());
    let checks = check::all(&edge, &profiles);
    write_png(&context.path("figure2_attempts.png"), &lines::draw(&profiles, &checks))?;
    context.step("2 three attempts: weights");
    let around: Vec<Around> =
        [NEAR, FAR].map(|x| Around::new(&edge, x, context.spend(120, 240), context.seed())).into();
    write_png(&context.path("figure2_weights.png"), &weights::draw(&around))?;
    let data = write_data(context, &profiles, &checks, &around)?;
    Ok(section(&profiles, &checks, &around, estimates, data))
}

fn write_data(
    context: &Context,
    profiles: &[Profile],
    checks: &[Check],
    around: &[Around],
) -> anyhow::Result<Vec<String>> {
    let mut line =
        Table::new(&["attempt", "x_in_kernel_widths", "v_x", "v_x_error", "divergence", "divergence_error"]);
    for profile in profiles {
        for r in &profile.readings {
            let numbers = [r.x, r.value[0], r.error[0], r.value[1], r.error[1]];
            line.row(std::iter::once(profile.name.clone().into()).chain(numbers.map(Into::into)));
        }
    }
    write_csv(&context.path("figure2_attempts.csv"), &line)?;
    let mut exact = Table::new(&["attempt", "x_in_kernel_widths", "quadrature", "v_x", "v_x_error"]);
    for check in checks {
        let numbers = [check.x, check.exact, check.estimate, check.error];
        let name = profiles[check.attempt].name.clone();
        exact.row(std::iter::once(name.into()).chain(numbers.map(Into::into)));
    }
    write_csv(&context.path("figure2_quadrature.csv"), &exact)?;
    let mut points = Table::new(&["u_x", "auxiliary_x", "auxiliary_y", "weight", "b", "v_x"]);
    for one in around {
        for p in &one.points {
            points.row([one.u.x, p.at.x, p.at.y, p.share, p.boundary, p.velocity].map(Into::into));
        }
    }
    write_csv(&context.path("figure2_auxiliary_points.csv"), &points)?;
    Ok(vec![
        "figure2_attempts.csv".into(),
        "figure2_quadrature.csv".into(),
        "figure2_auxiliary_points.csv".into(),
    ])
}

/// What each attempt gives closest to the silhouette, on either side.
fn table(profiles: &[Profile]) -> Table {
    let mut table = Table::new(&[
        "",
        "V·ν just inside",
        "V·ν just outside",
        "largest |∇·V| read",
        "largest error of ∇·V",
    ]);
    for profile in profiles {
        let middle = profile.readings.len() / 2;
        let shown = |i: usize| {
            let r = &profile.readings[i];
            if r.error[0] > 0.0 {
                format!("{:.3} ± {:.3}", r.value[0], r.error[0])
            } else {
                format!("{:.3}", r.value[0])
            }
        };
        let largest = |f: fn(&edge::Reading) -> f64| profile.readings.iter().map(f).fold(0.0, f64::max);
        table.row([
            profile.name.clone().into(),
            shown(middle - 1).into(),
            shown(middle).into(),
            largest(|r| r.value[1].abs()).into(),
            largest(|r| r.error[1]).into(),
        ]);
    }
    table
}

fn section(
    profiles: &[Profile],
    checks: &[Check],
    around: &[Around],
    estimates: usize,
    data: Vec<String>,
) -> Section {
    let inline = |source| formula(source, Placement::Inline);
    let [near, far] = [&around[0], &around[1]];
    let [quadratic, linear] = Weight::both();
    let gap = profiles[0].readings[profiles[0].readings.len() / 2].x;
    let explanation_html = format!(
        "<p>A half-plane moves to the right, {v} = 1 on its silhouette at 0; the background rests. \
         <em>Attempt 1</em> takes the velocity of the point seen: it has the right value on the \
         silhouette, but jumps there, and its divergence misses a Dirac peak, which holds the whole \
         boundary term. <em>Attempt 2</em> filters attempt 1 with a Gaussian: continuous, but on the \
         silhouette it has averaged the moving and the resting side. <em>Attempt 3</em> filters with a \
         weight that knows the boundary: V still reaches 1 on the silhouette, then falls continuously, \
         and the divergence is an ordinary function with the peak spread out beside it.</p>\
         <p>The weight has two parts. {d} grows with the distance between the two points. The boundary \
         function {b} depends on the auxiliary hit only and falls to 0 where that hit is about to end. \
         Only where both vanish is the weight infinite: at the silhouette, for a point u on it. So near \
         the silhouette the moving side decides. At a distance of {NEAR} kernel widths it holds {nq:.0}% \
         of the weight with the default ({gq}, γ = {gamma_q}) and {nl:.0}% with the original's ({gl}, \
         γ = {gamma_l}), though it has only {nk:.0}% of the kernel. At {FAR} widths these are {fq:.1}%, \
         {fl:.1}% and {fk:.1}%: far away the weight is a kernel around u like any other. These shares \
         <em>are</em> V·ν at u.</p>",
        v = inline("v·ν"),
        d = inline("D"),
        b = inline("B"),
        nq = 100.0 * near.shares[0],
        nl = 100.0 * near.shares[1],
        nk = 100.0 * near.kernel,
        fq = 100.0 * far.shares[0],
        fl = 100.0 * far.shares[1],
        fk = 100.0 * far.kernel,
        gq = quadratic.name,
        gl = linear.name,
        gamma_q = quadratic.gamma,
        gamma_l = linear.gamma,
    );
    let lines = Picture {
        file: "figure2_attempts.png".into(),
        alt: "V and its divergence along a line across a silhouette for the three attempts, and two \
              boundary functions."
            .into(),
        caption: format!(
            "Each point of a line is the mean of {estimates} unbiased estimates ({} with the linear B, whose \
             tails are heavier); bands show ±2 standard errors. The ring is the boundary velocity. The readings \
             closest to the silhouette are {} kernel widths away from it. Dots: the same integrals by \
             quadrature at {} places; the estimates deviate from them by at most {:.1} standard errors.",
            edge::HEAVIER * estimates,
            crate::plot::number(gap),
            checks.len(),
            checks.iter().map(Check::deviation).fold(0.0, f64::max),
        ),
    };
    let maps = Picture {
        file: "figure2_weights.png".into(),
        alt: "Maps of D, B and the weight around a point near and a point far from the silhouette, and \
              auxiliary points coloured by weight."
            .into(),
        caption: format!(
            "Upper row: u (ring) {NEAR} kernel widths outside the silhouette (dashed; the half-plane is on the \
             left). Lower row: u {FAR} widths outside. The weight is normalised to integral 1. Last column: {} \
             auxiliary points of one estimate with the default settings, each with its share of the sum.",
            near.points.len()
        ),
    };
    Section {
        id: "attempts".into(),
        title: "Three attempts at a warp field".into(),
        explanation_html,
        formula_mathml: formula(
            r"V(u) = \frac{∫ w(u,u') V_{\text{direct}}(u') \d u'}{∫ w(u,u') \d u'}, \quad w = (D + B)^{−γ}, \quad D = e^{κ|u−u'|²/2} − 1",
            Placement::Display,
        ),
        pictures: vec![lines, maps],
        data,
        table: Some(table(profiles)),
    }
}
