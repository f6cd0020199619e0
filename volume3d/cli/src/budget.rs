//! The number of samples per pixel: given, or estimated by pilot runs.

use std::time::{Duration, Instant};

use anyhow::bail;
use clap::Args;
use flatland::random::stream;
use rand::Rng as _;
use volume3d::Image;
use volume3d::gradient::{Pilot as Chooser, Survey};
use volume3d::scene::Scene;

use super::session::Clock;
use super::spp::{MAX_SAMPLES, samples};

/// `--spp`, `--time` and `--error`.
#[derive(Args, Clone, Debug)]
pub(super) struct Budget {
    /// Samples per pixel [default: sample_count of the scene].
    #[arg(long, value_name = "N", value_parser = samples, conflicts_with_all = ["time", "error"])]
    spp: Option<usize>,
    /// Time limit, such as 30s, 5m or 1h; a run usually takes less. A short pilot measures the time per
    /// sample. With --error, the limit that is reached first counts. The number of samples depends on the
    /// speed of the machine: to reproduce a result elsewhere, use --spp with the printed number.
    #[arg(long, value_name = "T", value_parser = duration)]
    time: Option<Duration>,
    /// Target for the relative error of the gradient: the root mean square of the error divided by that of
    /// the gradient, 0.02 for 2 %. A pilot estimates the number of samples. The result does not use the
    /// pilot's samples and stays unbiased.
    #[arg(long, value_name = "E", value_parser = error)]
    error: Option<f64>,
}

/// Time, signal and noise of a pilot run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pilot {
    pub(super) seconds: f64,
    /// `[signal, noise]`: the squared norm of the result minus that of its noise, and the expected squared
    /// norm of the noise of one run.
    pub(super) squares: [f64; 2],
}

/// The number of samples per pixel, and how it was found.
pub(super) struct Plan {
    pub(super) samples: usize,
    /// A line about the pilots, to be printed.
    pub(super) text: String,
    /// The relative error that the pilot predicts; nothing without a pilot, or if it measured time only.
    pub(super) foreseen: Option<f64>,
}

/// Samples per pixel of the first pilot; each further pilot has four times as many. With fewer, a method that
/// splits its samples would give one sample to parts that should have less than one.
const FIRST: usize = 16;
/// Samples per pixel of the first pilot with --time.
const FIRST_BY_TIME: usize = 2;
/// With --error alone: once a pilot has this many samples per pixel, no larger one is run.
const MOST: usize = 1 << 14;
/// Relative errors below this are accurate enough to be extrapolated.
const TOLD: f64 = 0.5;
/// Lower bound on the part of a run's time that its samples take.
const LEAST: f64 = 0.25;
/// Part of --time that pilots may take, approximately.
const SHARE: f64 = 0.1;

/// Key of the pilots' random streams.
const PILOT: u64 = 0x70_696c_6f74;

impl Pilot {
    /// √(noise/signal): 0 without noise, ∞ if noise hides the signal.
    pub(super) fn relative(&self) -> f64 {
        let [signal, noise] = self.squares;
        match noise {
            0.0 => 0.0,
            _ if signal <= 0.0 => f64::INFINITY,
            _ => (noise / signal).sqrt(),
        }
    }

    /// From an image and its standard error.
    pub(super) fn of_image(seconds: f64, image: &Image, standard_error: &Image) -> Self {
        let square = |image: &Image| image.pixels.iter().map(|p| p.length_squared()).sum::<f64>();
        let noise = square(standard_error);
        Self { seconds, squares: [square(image) - noise, noise] }
    }

    /// From independent runs, each with one vector as its result.
    pub(super) fn of_runs(seconds: f64, runs: &[Vec<f64>]) -> Self {
        let count = runs.len() as f64;
        let (mut whole, mut noise) = (0.0, 0.0);
        for index in 0..runs[0].len() {
            let mean = runs.iter().map(|run| run[index]).sum::<f64>() / count;
            noise += runs.iter().map(|run| (run[index] - mean).powi(2)).sum::<f64>() / (count - 1.0);
            whole += mean * mean;
        }
        Self { seconds, squares: [whole - noise / count, noise] }
    }
}

impl Budget {
    /// Whether the number of samples must be estimated.
    pub(super) fn is_open(&self) -> bool {
        self.time.is_some() || self.error.is_some()
    }

    /// The number of samples that fit into --time, and the last survey; nothing unless --time is given
    /// without --error, or if the survey predicts no times. The time per sample is that of a pilot's survey.
    /// If many samples fit, a second survey with more samples is needed anyway, and measures it better.
    pub(super) fn plan_by_survey(
        &self,
        seed: u64,
        mut survey: impl FnMut(&Chooser, &Clock) -> anyhow::Result<Survey>,
    ) -> anyhow::Result<Option<(Plan, Survey)>> {
        let Some(time) = self.time.filter(|_| self.error.is_none()) else { return Ok(None) };
        let (start, of) = (Instant::now(), |samples| Chooser { samples, seed });
        let mut fit = FIRST;
        for round in 0.. {
            let (begin, clock) = (start.elapsed().as_secs_f64(), Clock::default());
            let survey = survey(&of(fit), &clock)?;
            let (end, samples) = (start.elapsed().as_secs_f64(), clock.seconds());
            // The preparation before the samples is done again in the run itself.
            let left = time.as_secs_f64() - end - (end - begin - samples);
            let fits = |count: usize| Some(survey.relative_time(&of(count))? * samples <= left);
            let mut too_many = MAX_SAMPLES + 1;
            fit = 2;
            while fit + 1 < too_many {
                let middle = fit.midpoint(too_many);
                let Some(fits) = fits(middle) else { return Ok(None) };
                *(if fits { &mut fit } else { &mut too_many }) = middle;
            }
            if round > 0 || survey.is_that_of(&of(fit)) {
                let text = format!(
                    "{} took {end:.2} s: {fit} spp\n",
                    if round > 0 { "two pilots" } else { "a pilot" }
                );
                return Ok(Some((Plan { samples: fit, text, foreseen: None }, survey)));
            }
        }
        unreachable!("there are two rounds")
    }

    /// The number of samples, from as many pilots as needed. `pilot` runs one with a number of samples and a
    /// seed.
    pub(super) fn plan(
        &self,
        scene: &Scene,
        seed: u64,
        mut pilot: impl FnMut(usize, u64) -> anyhow::Result<Pilot>,
    ) -> anyhow::Result<Plan> {
        if !self.is_open() {
            let samples = self.spp.unwrap_or(scene.description().samples);
            return Ok(Plan { samples, text: String::new(), foreseen: None });
        }
        let (start, mut samples) = (Instant::now(), if self.time.is_some() { FIRST_BY_TIME } else { FIRST });
        let mut before: Option<(usize, f64)> = None;
        for round in 0.. {
            let found = pilot(samples, stream(seed, &[PILOT, round]).next_u64())?;
            let spent = start.elapsed().as_secs_f64();
            let relative = found.relative();
            let by_error =
                self.error.filter(|_| relative < TOLD).map(|e| samples as f64 * (relative / e).powi(2));
            let time = self.time.map(|time| time.as_secs_f64());
            // A run takes `own` + `each` · samples. Two short runs may measure this badly, hence the lower
            // bound on `each`.
            let (few, seconds) = before.unwrap_or((0, 0.0));
            let mean = found.seconds / samples as f64;
            let each =
                ((found.seconds - seconds) / (samples - few) as f64).max(LEAST * mean).max(f64::MIN_POSITIVE);
            let own = (found.seconds - each * samples as f64).max(0.0);
            let by_time = time.map(|time| (time - spent - own) / each);
            // Whether the next pilot would take too long.
            let is_late = time.is_some_and(|time| 5.0 * spent > SHARE * time);
            before = Some((samples, found.seconds));
            let wanted = match (by_error, by_time) {
                (Some(error), Some(time)) if is_late || error < time => Some(error.min(time)),
                (Some(error), None) => Some(error),
                (None, Some(time)) if is_late => Some(time),
                _ => None,
            };
            if let Some(wanted) = wanted {
                // A standard error needs two samples.
                let planned = (wanted.ceil().max(2.0) as usize).min(MAX_SAMPLES);
                let text = format!(
                    "a pilot of {samples} spp took {:.2} s, with an error of {} of the gradient: {planned} spp\n",
                    found.seconds,
                    percent(relative)
                );
                let foreseen = Some(relative * (samples as f64 / planned as f64).sqrt());
                return Ok(Plan { samples: planned, text, foreseen });
            }
            if samples >= MOST && time.is_none() {
                bail!(
                    "after {samples} spp the noise is still {} of the gradient, which may be 0; give --spp",
                    percent(relative)
                );
            }
            samples *= 4;
        }
        unreachable!("rounds have no end")
    }
}

/// A relative error as a percentage.
pub(super) fn percent(relative: f64) -> String {
    if relative.is_finite() { format!("{:.2} %", 100.0 * relative) } else { "more than 100 %".to_owned() }
}

fn duration(text: &str) -> Result<Duration, String> {
    let expected = || "expected a positive time such as 30s, 5m or 1h".to_owned();
    let (number, unit) = match text.find(|c: char| c.is_ascii_alphabetic()) {
        Some(at) => text.split_at(at),
        None => (text, "s"),
    };
    let unit = match unit {
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(expected()),
    };
    let seconds = number.parse().map_err(|_| expected()).map(|n: f64| n * unit)?;
    if seconds > 0.0 { Duration::try_from_secs_f64(seconds).map_err(|_| expected()) } else { Err(expected()) }
}

fn error(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|e: &f64| *e > 0.0 && e.is_finite());
    number.ok_or_else(|| "expected a positive number, such as 0.02 for 2 %".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        for (text, seconds) in [("10", 10.0), ("1.5s", 1.5), ("2m", 120.0), ("1h", 3600.0), ("0.5min", 30.0)]
        {
            assert_eq!(duration(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for text in ["", "s", "-1", "0", "1d", "NaN", "inf", "1e300h"] {
            assert!(duration(text).is_err(), "{text}");
        }
        assert!(error("0.02") == Ok(0.02) && error("0").is_err() && error("NaN").is_err());
    }

    /// For runs of one number, the noise of a run is the sample variance, and the signal is the squared mean
    /// minus the noise of the mean.
    #[test]
    fn runs_tell_signal_from_noise() {
        let runs = [2.0, 4.0, 3.0, 3.0].map(|x| vec![x]);
        let pilot = Pilot::of_runs(1.0, &runs);
        assert!((pilot.squares[1] - 2.0 / 3.0).abs() < 1e-15);
        assert!((pilot.squares[0] - (9.0 - 1.0 / 6.0)).abs() < 1e-14);
        let relative = |squares| Pilot { seconds: 0.0, squares }.relative();
        assert_eq!(
            [[1.0, 0.0], [0.0, 0.0], [-1.0, 2.0], [4.0, 1.0]].map(relative),
            [0.0, 0.0, f64::INFINITY, 0.5]
        );
    }
}
