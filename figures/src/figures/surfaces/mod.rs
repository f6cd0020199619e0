//! Implicit surfaces from rendered views, without masks, and the effect of their topology.

mod picture;

use volume3d::optimize::Loss;

use crate::context::{Context, Quality};
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::space::reconstruction::{Effort, Made, RADIUS, Reconstruction, SMOOTHING, Setup, Supervision};
use crate::space::studio::{Light, Subject};

/// The target Chamfer distance, in parts of the diagonal, and the minimum decibels of held-out views.
const GOAL: (f64, f64) = (0.005, 30.0);

/// Resolutions that the loss compares.
const LEVELS: usize = 4;

/// Adam's initial rate, in cells.
const RATE: f64 = 0.5;

/// Views of the usual fit in full quality, and the other numbers of views.
const USUAL: usize = 16;
const OTHERS: [usize; 2] = [8, 32];

/// Whether a fit has the usual number of views under the even light; such fits are drawn, and the others have
/// rows of the table.
fn is_usual(fit: &Reconstruction, effort: &Effort) -> bool {
    (fit.views, fit.light) == (effort.views, Light::Even)
}

/// Effort of a fit: whole, live, or just enough to show that everything runs.
fn effort(quality: Quality) -> Effort {
    let full = Effort {
        side: 128,
        views: USUAL,
        batch: 2,
        cells: 16,
        phases: vec![80; 3],
        pixels: None,
        finish: None,
        samples: 4,
        shown: 128,
        points: 100_000,
        meshed: 96,
        every: 10,
        loss: Loss::Multiscale { levels: LEVELS },
    };
    let live = Effort {
        side: 40,
        views: 8,
        cells: 10,
        phases: vec![40, 30],
        samples: 2,
        shown: 32,
        points: 4000,
        meshed: 40,
        every: 5,
        ..full.clone()
    };
    match quality {
        Quality::Full => full,
        Quality::Short => {
            Effort { side: 48, views: 12, cells: 12, phases: vec![40; 3], points: 10_000, meshed: 64, ..full }
        }
        Quality::Draft => live,
        Quality::Sketch => Effort {
            side: 20,
            views: 4,
            cells: 6,
            phases: vec![2, 1, 1],
            shown: 4,
            points: 200,
            meshed: 16,
            ..live
        },
    }
}

/// The text of the figure.
pub(crate) const TEXT: &str = include_str!("surfaces.md");

/// Fits the bunny alone, on a coarse grid.
pub(crate) fn live(context: &Context) -> anyhow::Result<Section> {
    let effort = effort(Quality::Draft);
    let fit = Reconstruction::new(context, &effort, &setup(Subject::Bunny, effort.views, Light::Even, 1))?;
    let prose = Prose::new(
        include_str!("live.md"),
        &[
            ("steps", &effort.steps()),
            ("views", &effort.views),
            ("side", &effort.side),
            ("cells", &effort.cells),
            ("finer", &(2 * effort.cells)),
            ("start", &percent(fit.moments[0].chamfer)),
            ("end", &percent(fit.chamfer())),
        ],
    )?;
    let page = picture::Page { title: "", side: effort.side, cells: &cells(&effort) };
    context.png("surfaces_live.png", &picture::draw(&page, &[&fit], &[]))?;
    prose.section("surfaces", vec![], Table::default())
}

fn setup(subject: Subject, views: usize, light: Light, number: u64) -> Setup {
    Setup {
        figure: 16,
        name: format!("{}, {}", subject.name(), case(views, light)),
        subject,
        light,
        number,
        made: Made::Grid,
        rate: RATE,
        supervision: Supervision::WarpedArea,
    }
}

/// Cells along each side after every phase.
fn cells(effort: &Effort) -> Vec<usize> {
    (0..effort.phases.len()).map(|phase| effort.cells << phase).collect()
}

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let (effort, seeds) = (effort(context.quality()), context.study(1, 1, 3));
    let mut cases = vec![(effort.views, Light::Even), (effort.views, Light::Sun)];
    cases.extend(context.spend(vec![], OTHERS.map(|views| (views, Light::Even)).to_vec()));
    let mut fits = vec![];
    for (views, light) in cases {
        let effort = Effort { views, ..effort.clone() };
        let is_brief = light == Light::Sun && context.quality() == Quality::Short;
        for subject in Subject::ALL.into_iter().filter(|subject| !is_brief || *subject == Subject::Bunny) {
            for number in 1..=seeds {
                let setup = setup(subject, views, light, number);
                fits.push(Reconstruction::new(context, &effort, &setup)?);
            }
        }
    }
    let prose = prose(context, &fits)?;
    let usual: Vec<_> = fits.iter().filter(|fit| is_usual(fit, &effort)).collect();
    let sunny: Vec<_> = fits.iter().filter(|fit| fit.light == Light::Sun).collect();
    let title = "Surfaces from their views: from a ball to a bunny, a trefoil knot, and two chairs";
    let page = picture::Page { title, side: effort.side, cells: &cells(&effort) };
    context.png("surfaces.png", &picture::draw(&page, &usual, &sunny))?;
    let table = summary(&fits);
    let mut data = vec![
        context.csv("surfaces_fits.csv", &table)?,
        context.csv("surfaces_distances.csv", &distances(&fits))?,
    ];
    for fit in usual.into_iter().filter(|fit| fit.number == 1) {
        data.push(context.obj(&format!("surfaces_{}.obj", fit.subject.name()), &fit.mesh)?);
    }
    prose.section("surfaces", data, table)
}

/// Description of a fit besides its subject.
fn case(views: usize, light: Light) -> String {
    format!("{views} views, {}", light.name())
}

/// A number of every fit, seed by seed and subject by subject.
fn by_subject<'a>(
    fits: impl Iterator<Item = &'a Reconstruction> + Clone,
    of: impl Fn(&Reconstruction) -> String,
) -> String {
    listed(Subject::ALL.into_iter().filter_map(|subject| {
        let of_subject: Vec<_> = fits.clone().filter(|fit| fit.subject == subject).map(&of).collect();
        (!of_subject.is_empty()).then(|| format!("{}: {}", subject.name(), of_subject.join(", ")))
    }))
}

fn prose(context: &Context, fits: &[Reconstruction]) -> anyhow::Result<Prose> {
    let effort = effort(context.quality());
    let usual = || fits.iter().filter(|fit| is_usual(fit, &effort));
    let all = |of: &dyn Fn(&Reconstruction) -> String| by_subject(usual(), of);
    let others = listed(
        context
            .spend(vec![], OTHERS.to_vec())
            .into_iter()
            .map(|views| (views, Light::Even))
            .chain([(effort.views, Light::Sun)])
            .map(|(views, light)| {
                let of_case = fits.iter().filter(|fit| (fit.views, fit.light) == (views, light));
                format!("{}: {}", case(views, light), by_subject(of_case, |fit| percent(fit.chamfer())))
            }),
    );
    let met = |goal: bool| if goal { "All reach it" } else { "Not all reach it" };
    let distances_met = usual().all(|fit| fit.chamfer() < GOAL.0);
    let decibels_met = usual().all(|fit| fit.worst_decibels() > GOAL.1);
    let seconds = fits.iter().map(|fit| fit.seconds).sum::<f64>() / fits.len() as f64;
    Prose::new(
        TEXT,
        &[
            ("views", &effort.views),
            ("side", &effort.side),
            ("batch", &effort.batch),
            ("samples", &effort.samples),
            ("steps", &effort.steps()),
            ("cells", &effort.cells),
            ("finer", &(2 * effort.cells)),
            ("finest", &(4 * effort.cells)),
            ("levels", &LEVELS),
            ("lambda", &number(SMOOTHING)),
            ("rate", &number(RATE)),
            ("radius", &number(RADIUS)),
            ("points", &effort.points),
            ("others", &others),
            ("chamfers", &all(&|fit| percent(fit.chamfer()))),
            ("hausdorffs", &all(&|fit| percent(fit.hausdorff))),
            ("decibels", &all(&|fit| number(fit.worst_decibels()))),
            ("eulers", &all(&|fit| fit.euler().to_string())),
            ("goal", &percent(GOAL.0)),
            ("goal_decibels", &number(GOAL.1)),
            ("distances_met", &met(distances_met)),
            ("decibels_met", &met(decibels_met)),
            ("seconds", &number(seconds)),
        ],
    )
}

fn summary(fits: &[Reconstruction]) -> Table {
    let mean = |fit: &Reconstruction| fit.decibels.iter().sum::<f64>() / fit.decibels.len() as f64;
    Table::of(
        fits,
        &[
            ("surface", &|fit| fit.subject.name().into()),
            ("views", &|fit| fit.views.into()),
            ("light", &|fit| fit.light.name().into()),
            ("seed", &|fit| (fit.number as usize).into()),
            ("Chamfer distance, start (%)", &|fit| (100.0 * fit.moments[0].chamfer).into()),
            ("Chamfer distance, fit (%)", &|fit| (100.0 * fit.chamfer()).into()),
            ("95 % Hausdorff distance, fit (%)", &|fit| (100.0 * fit.hausdorff).into()),
            ("Euler characteristic, fit", &|fit| (fit.euler() as f64).into()),
            ("PSNR of held-out views, mean (dB)", &|fit| mean(fit).into()),
            ("PSNR of held-out views, worst (dB)", &|fit| fit.worst_decibels().into()),
            ("processor seconds", &|fit| fit.seconds.into()),
        ],
    )
}

fn distances(fits: &[Reconstruction]) -> Table {
    let rows = fits.iter().flat_map(|fit| fit.moments.iter().map(move |moment| (fit, moment)));
    Table::of(
        rows,
        &[
            ("surface", &|(fit, _)| fit.subject.name().into()),
            ("views", &|(fit, _)| fit.views.into()),
            ("light", &|(fit, _)| fit.light.name().into()),
            ("seed", &|(fit, _)| (fit.number as usize).into()),
            ("step", &|(_, moment)| (moment.step as usize).into()),
            ("Chamfer distance (part of the diagonal)", &|(_, moment)| moment.chamfer.into()),
        ],
    )
}
