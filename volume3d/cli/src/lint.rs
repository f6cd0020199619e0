//! `volume3d lint`.

use std::fmt::Write as _;

use clap::Args;
use volume3d::lint::{lint, lint_change};

use super::movement::{Moves, change};
use super::report::{Outcome, Report};
use super::session::SceneOptions;

/// Lists problems of a scene for gradients with respect to geometry, shape by shape, with advice.
///
/// With --move, the findings are those for the gradient along that motion: the refusals and warnings of
/// `volume3d gradient`. Without --move, surfaces in contact are only hints, because gradients are wrong only
/// where they separate, not where they slide.
///
/// Exit status: 1 if a finding makes gradients wrong or has them refused; 0 if there are only hints or no
/// findings.
#[derive(Args, Debug)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let scene = options.scene.load()?.scene;
    let found = if options.moves.moves.is_empty() {
        lint(&scene)
    } else {
        lint_change(&scene, &change(&scene, &options.moves.moves)?)
    };
    let grave = found.iter().filter(|f| f.is_wrong).count();
    let mut text = String::new();
    for finding in &found {
        let kind = if finding.is_wrong { "WRONG" } else { "hint" };
        let _ = writeln!(text, "{kind}: {}\n    {}", finding.message, finding.advice);
    }
    let _ = match (found.len(), grave) {
        (0, _) => writeln!(text, "nothing found"),
        (hints, 0) => writeln!(text, "{hints} hints, no finding that makes gradients wrong"),
        (all, grave) => {
            writeln!(text, "{grave} of {all} findings make gradients by geometry wrong or refused")
        }
    };
    Ok(Report { text, outcome: if grave > 0 { Outcome::Bad } else { Outcome::Good } })
}
