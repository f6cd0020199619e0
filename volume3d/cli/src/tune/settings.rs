//! The settings that a study measures: options of `volume3d gradient`, parsed by the same code.

use clap::Parser;
use volume3d::gradient::{Estimator, Tangent};
use volume3d::scene::Scene;

use crate::extent;
use crate::gradient::step;
use crate::method::MethodOptions;

/// A method with its settings.
#[derive(Debug)]
pub(super) struct Setting {
    /// The options of `volume3d gradient`.
    pub(super) options: String,
    /// Whether it is proved to be unbiased for the change.
    pub(super) unbiased: bool,
    line: Line,
}

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct Line {
    #[command(flatten)]
    method: MethodOptions,
    #[arg(long, value_parser = step)]
    step: Option<f64>,
}

/// Unbiased settings. The first two are candidates for the reference.
const UNBIASED: [&str; 5] =
    ["--field jump-mean", "--method edge", "--field softened", "--method auto", "--field rays"];

/// Settings that are biased where geometry moves.
const BIASED: [&str; 4] =
    ["--debias none --aux 4", "--debias none --aux 16", "--debias none --aux 64", "--method rotation"];

/// The interior term alone, biased where geometry moves.
const INTERIOR: &str = "--method interior";

/// The default steps to leave out: the bias of the largest is too large to be a choice.
const SKIPPED: usize = 1;

impl Setting {
    fn new(options: &str, unbiased: bool) -> anyhow::Result<Self> {
        let line = Line::try_parse_from(options.split_whitespace())?;
        Ok(Self { options: options.to_owned(), unbiased, line })
    }

    pub(super) fn estimator(&self, samples: usize, seed: u64) -> Estimator {
        self.line.method.estimator(samples, seed, self.line.step)
    }
}

/// All settings worth measuring for a change. If no geometry moves, all methods except finite differences are
/// the interior term, and one setting stands for them.
pub(super) fn settings(scene: &Scene, change: &Tangent) -> anyhow::Result<Vec<Setting>> {
    let mut all = vec![];
    if change.is_geometric() {
        all.extend(UNBIASED.map(|options| Setting::new(options, true)));
        all.extend(BIASED.map(|options| Setting::new(options, false)));
        all.push(Setting::new(INTERIOR, false));
    } else {
        all.push(Setting::new(UNBIASED[0], true));
        all.push(Setting::new(INTERIOR, true));
    }
    all.extend(differences(scene, change).iter().map(|options| Setting::new(options, false)));
    all.into_iter().collect()
}

/// The candidates for the reference: unbiased methods, of which the better is taken.
pub(super) fn references(change: &Tangent) -> anyhow::Result<Vec<Setting>> {
    let able = if change.is_geometric() { &UNBIASED[..2] } else { &UNBIASED[..1] };
    able.iter().map(|options| Setting::new(options, true)).collect()
}

/// The reference for a scene that no unbiased method supports: the second largest step of finite differences,
/// whose difference from the smaller ones is then visible. The smallest may be dominated by noise.
pub(super) fn makeshift(scene: &Scene, change: &Tangent) -> anyhow::Result<Setting> {
    let all = differences(scene, change);
    Setting::new(all.get(1).map_or("--method finite-difference", |o| o), false)
}

/// Finite differences, from large to small steps, rounded to two digits.
fn differences(scene: &Scene, change: &Tangent) -> Vec<String> {
    let steps = extent::steps(scene, change).into_iter().skip(SKIPPED);
    steps.map(|h| format!("--method finite-difference --step {h:.1e}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_those_of_the_command() {
        for options in UNBIASED.iter().chain(&BIASED).chain(&[INTERIOR]) {
            let setting = Setting::new(options, true).unwrap();
            setting.line.method.check("gradient", false).unwrap();
        }
        let difference = Setting::new("--method finite-difference --step 1.0e-2", false).unwrap();
        assert!(matches!(difference.estimator(8, 3), Estimator::FiniteDifference(f) if f.step == 0.01));
    }
}
