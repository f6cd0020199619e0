//! The three attempts along a line across a silhouette, and the weight that makes the third.

mod check;
mod edge;
mod lines;
mod weights;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use check::Check;
use edge::{Edge, Profile, Reading, Weight};
use weights::Around;

/// Distances of the two points from the silhouette, in kernel widths.
const NEAR: f64 = 0.3;
const FAR: f64 = 2.0;

/// Draws the figure.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let edge = Edge::new()?;
    context.step("along the line");
    let places = edge::places(context.spend(120, 240));
    let estimates = context.spend(3000, 50_000);
    let profiles = edge::profiles(&edge, &places, estimates, context.seed());
    let checks = check::all(&edge, &profiles);
    context.png("attempts.png", &lines::draw(&profiles, &checks))?;
    context.step("weights");
    let around = [NEAR, FAR].map(|x| Around::new(&edge, x, context.spend(120, 240), context.seed()));
    context.png("attempts_weights.png", &weights::draw(&around))?;
    let data = [
        context.csv("attempts.csv", &readings(&profiles))?,
        context.csv("attempts_quadrature.csv", &quadrature(&profiles, &checks))?,
        context.csv("attempts_auxiliary_points.csv", &auxiliary_points(&around))?,
    ];
    prose(&profiles, &checks, &around, estimates)?.section("attempts", data.to_vec(), table(&profiles))
}

fn prose(
    profiles: &[Profile],
    checks: &[Check],
    [near, far]: &[Around; 2],
    estimates: usize,
) -> anyhow::Result<Prose> {
    let [quadratic, linear] = Weight::both();
    let gap = profiles[0].readings[profiles[0].readings.len() / 2].x;
    let deviation = checks.iter().map(Check::deviation).fold(0.0, f64::max);
    Prose::new(
        include_str!("attempts.md"),
        &[
            ("near", &NEAR),
            ("far", &FAR),
            ("quadratic", &quadratic.name),
            ("linear", &linear.name),
            ("gamma_quadratic", &quadratic.gamma),
            ("gamma_linear", &linear.gamma),
            ("near_quadratic", &format!("{:.0}", 100.0 * near.shares[0])),
            ("near_linear", &format!("{:.0}", 100.0 * near.shares[1])),
            ("near_kernel", &format!("{:.0}", 100.0 * near.kernel)),
            ("far_quadratic", &format!("{:.1}", 100.0 * far.shares[0])),
            ("far_linear", &format!("{:.1}", 100.0 * far.shares[1])),
            ("far_kernel", &format!("{:.1}", 100.0 * far.kernel)),
            ("estimates", &estimates),
            ("estimates_linear", &(edge::HEAVIER * estimates)),
            ("gap", &number(gap)),
            ("checks", &checks.len()),
            ("deviation", &format!("{deviation:.1}")),
            ("points", &near.points.len()),
        ],
    )
}

fn readings(profiles: &[Profile]) -> Table {
    Table::of(
        profiles.iter().flat_map(|profile| profile.readings.iter().map(move |r| (profile, r))),
        &[
            ("attempt", &|(profile, _)| profile.name.clone().into()),
            ("x_in_kernel_widths", &|(_, r)| r.x.into()),
            ("v_x", &|(_, r)| r.value[0].into()),
            ("v_x_error", &|(_, r)| r.error[0].into()),
            ("divergence", &|(_, r)| r.value[1].into()),
            ("divergence_error", &|(_, r)| r.error[1].into()),
        ],
    )
}

fn quadrature(profiles: &[Profile], checks: &[Check]) -> Table {
    Table::of(
        checks,
        &[
            ("attempt", &|check| profiles[check.attempt].name.clone().into()),
            ("x_in_kernel_widths", &|check| check.x.into()),
            ("quadrature", &|check| check.exact.into()),
            ("v_x", &|check| check.estimate.into()),
            ("v_x_error", &|check| check.error.into()),
        ],
    )
}

fn auxiliary_points(around: &[Around]) -> Table {
    Table::of(
        around.iter().flat_map(|one| one.points.iter().map(move |point| (one.u, point))),
        &[
            ("u_x", &|(u, _)| u.x.into()),
            ("auxiliary_x", &|(_, p)| p.at.x.into()),
            ("auxiliary_y", &|(_, p)| p.at.y.into()),
            ("weight", &|(_, p)| p.share.into()),
            ("b", &|(_, p)| p.boundary.into()),
            ("v_x", &|(_, p)| p.velocity.into()),
        ],
    )
}

/// Values of each attempt closest to the silhouette, on either side.
fn table(profiles: &[Profile]) -> Table {
    let shown = |profile: &Profile, i: usize| {
        let r = &profile.readings[i];
        let error = if r.error[0] > 0.0 { format!(" ± {:.3}", r.error[0]) } else { String::new() };
        format!("{:.3}{error}", r.value[0])
    };
    let largest =
        |profile: &Profile, f: fn(&Reading) -> f64| profile.readings.iter().map(f).fold(0.0, f64::max);
    Table::of(
        profiles,
        &[
            ("", &|p| p.name.clone().into()),
            ("V·n just inside", &|p| shown(p, p.readings.len() / 2 - 1).into()),
            ("V·n just outside", &|p| shown(p, p.readings.len() / 2).into()),
            ("largest |∇·V| read", &|p| largest(p, |r| r.value[1].abs()).into()),
            ("largest error of ∇·V", &|p| largest(p, |r| r.error[1]).into()),
        ],
    )
}
