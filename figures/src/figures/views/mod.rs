//! Meshes from rendered views, by descent along unbiased gradients.

mod fit;
mod picture;
mod scene;
mod shapes;

use crate::context::Context;
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use fit::{Effort, Fit, LAMBDA, LEVELS, RATES};
use scene::Light;
use shapes::Subject;

/// The text of the figure.
pub(crate) const TEXT: &str = include_str!("views.md");

const TITLE: &str = "Meshes from their views: a sphere becomes a bunny, a torus a ring";

/// Fits one shape in one light, in small pictures.
pub(crate) fn live(context: &Context) -> anyhow::Result<Section> {
    let fit = Fit::new(context, Effort::LIVE, Subject::Bunny, Light::ALL[0])?;
    let prose = Prose::new(
        include_str!("live.md"),
        &[
            ("steps", &fit.effort.steps()),
            ("views", &fit.effort.views),
            ("side", &fit.effort.side),
            ("start", &percent(fit.moments[0].chamfer)),
            ("end", &percent(fit.chamfer())),
        ],
    )?;
    context.png("views_live.png", &picture::draw(&[fit], ""))?;
    prose.section("views", vec![], Table::default())
}

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let (effort, mut fits) = (context.study(Effort::SKETCH, Effort::SHORT, Effort::FULL), vec![]);
    for subject in Subject::ALL {
        for light in Light::ALL {
            fits.push(Fit::new(context, effort, subject, light)?);
        }
    }
    let prose = prose(effort, &fits)?;
    context.png("views.png", &picture::draw(&fits, TITLE))?;
    context.animation("views_animated.png", &picture::frames(&fits), 150)?;
    let table = summary(&fits);
    let mut data = vec![
        context.csv("views_fits.csv", &table)?,
        context.csv("views_losses.csv", &losses(&fits))?,
        context.csv("views_distances.csv", &distances(&fits))?,
    ];
    for fit in &fits {
        let light = fit.light.name().replace(' ', "_");
        data.push(context.obj(&format!("views_{}_{light}.obj", fit.subject.name()), &fit.mesh)?);
    }
    for subject in Subject::ALL {
        data.push(context.obj(&format!("views_{}_target.obj", subject.name()), &subject.target()?)?);
    }
    prose.section("views", data, table)
}

/// The text on the fits.
fn prose(effort: Effort, fits: &[Fit]) -> anyhow::Result<Prose> {
    let distance =
        |fit: &Fit| format!("{} {}: {}", fit.subject.name(), fit.light.name(), percent(fit.chamfer()));
    let held_out = |i: usize| number(fits.iter().map(|fit| fit.held_out[i]).sum::<f64>() / fits.len() as f64);
    let size = |fit: &Fit| fit.mesh.positions().len().to_string();
    let vertices = listed(fits.iter().step_by(Light::ALL.len()).map(size));
    let phases = effort.phases.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ");
    let seconds = |part: &dyn Fn(&Fit) -> f64| {
        let sum: f64 = fits.iter().map(part).sum();
        percent(sum / fits.iter().map(|fit| fit.seconds.total()).sum::<f64>())
    };
    let worst = fits.iter().map(Fit::chamfer).fold(0.0, f64::max);
    let quickest = fits.iter().map(|fit| fit.seconds.total()).fold(f64::INFINITY, f64::min);
    let slowest = fits.iter().map(|fit| fit.seconds.total()).fold(0.0, f64::max);
    let goal =
        if worst < GOAL[0] && 0.5 * slowest < 60.0 * GOAL[1] { "All reach it." } else { "Not all reach it." };
    Prose::new(
        TEXT,
        &[
            ("views", &effort.views),
            ("side", &effort.side),
            ("batch", &effort.batch),
            ("steps", &effort.steps()),
            ("phases", &phases),
            ("vertices", &vertices),
            ("of_image", &effort.samples[0]),
            ("of_gradient", &effort.samples[1]),
            ("lambda", &number(LAMBDA.0)),
            ("lambda_vertices", &LAMBDA.1),
            ("levels", &LEVELS),
            ("first_rate", &number(RATES[0])),
            ("last_rate", &number(RATES[1])),
            ("points", &effort.points),
            ("chamfers", &listed(fits.iter().map(distance))),
            ("goal", &goal),
            ("goal_distance", &percent(GOAL[0])),
            ("goal_minutes", &number(GOAL[1])),
            ("held_out_start", &held_out(0)),
            ("held_out", &held_out(1)),
            ("noise", &held_out(2)),
            ("least_seconds", &number(quickest)),
            ("most_seconds", &number(slowest)),
            ("update", &seconds(&|fit| fit.seconds.update)),
            ("image", &seconds(&|fit| fit.seconds.image)),
            ("gradient", &seconds(&|fit| fit.seconds.gradient)),
            ("optimiser", &seconds(&|fit| fit.seconds.optimiser)),
        ],
    )
}

/// The target Chamfer distance, in parts of the diagonal, and minutes on two cores.
const GOAL: [f64; 2] = [0.005, 15.0];

fn summary(fits: &[Fit]) -> Table {
    Table::of(
        fits,
        &[
            ("shape", &|fit| fit.subject.name().into()),
            ("views", &|fit| fit.light.name().into()),
            ("vertices", &|fit| fit.mesh.positions().len().into()),
            ("Chamfer distance, start (%)", &|fit| (100.0 * fit.moments[0].chamfer).into()),
            ("Chamfer distance, fit (%)", &|fit| (100.0 * fit.chamfer()).into()),
            ("held-out error, start", &|fit| fit.held_out[0].into()),
            ("held-out error, fit", &|fit| fit.held_out[1].into()),
            ("held-out error, noise", &|fit| fit.held_out[2].into()),
            ("processor seconds, update", &|fit| fit.seconds.update.into()),
            ("processor seconds, image", &|fit| fit.seconds.image.into()),
            ("processor seconds, gradient", &|fit| fit.seconds.gradient.into()),
            ("processor seconds, optimiser", &|fit| fit.seconds.optimiser.into()),
            ("seconds on the wall, measurements and all", &|fit| fit.seconds.wall.into()),
        ],
    )
}

fn losses(fits: &[Fit]) -> Table {
    let rows = fits.iter().flat_map(|fit| (1..).zip(&fit.losses).map(move |(step, loss)| (fit, step, *loss)));
    Table::of(
        rows,
        &[
            ("shape", &|(fit, ..)| fit.subject.name().into()),
            ("views", &|(fit, ..)| fit.light.name().into()),
            ("step", &|(_, step, _): &(_, usize, _)| (*step).into()),
            ("loss", &|(.., loss)| (*loss).into()),
        ],
    )
}

fn distances(fits: &[Fit]) -> Table {
    let rows = fits.iter().flat_map(|fit| fit.moments.iter().map(move |moment| (fit, moment)));
    Table::of(
        rows,
        &[
            ("shape", &|(fit, _)| fit.subject.name().into()),
            ("views", &|(fit, _)| fit.light.name().into()),
            ("step", &|(_, moment)| moment.step.into()),
            ("Chamfer distance (part of the diagonal)", &|(_, moment)| moment.chamfer.into()),
        ],
    )
}
