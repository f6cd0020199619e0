//! How many samples a pixel are spent: as many as are asked for, or as a pilot says are needed.

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
    /// Samples a pixel; the scene's sample_count unless given.
    #[arg(long, value_name = "N", value_parser = samples, conflicts_with_all = ["time", "error"])]
    spp: Option<usize>,
    /// About how long to go on, as 30s, 5m or 1h, and rather less: a short pilot measures how long a sample takes. With --error whichever
    /// is reached first. The same seed then has other samples on another machine; with the --spp that is printed it has the same.
    #[arg(long, value_name = "T", value_parser = duration)]
    time: Option<Duration>,
    /// How exact the gradient is to be: the root mean square of its error as a part of that of the gradient itself, 0.02 for
    /// 2 %. A pilot estimates how many samples that takes, and its own are not used, so that the gradient stays unbiased.
    #[arg(long, value_name = "E", value_parser = error)]
    error: Option<f64>,
}

/// What a run of few samples found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pilot {
    pub(super) seconds: f64,
    /// The squared length of what was found less that of its noise, and of the noise.
    pub(super) squares: [f64; 2],
}

/// Samples a pixel, and what led to them.
pub(super) struct Plan {
    pub(super) samples: usize,
    pub(super) text: String,
    /// The relative error that the pilot foresees, if there was one.
    pub(super) foreseen: Option<f64>,
}

/// Samples of the first pilot. Each has four times as many as the one before. With fewer a method that splits them has one of some
/// parts, however few it should have.
const FIRST: usize = 16;
/// Where time is short.
const FIRST_BY_TIME: usize = 2;
/// A pilot of more says nothing that a user would wait for.
const MOST: usize = 1 << 14;
/// A relative error below this is told well enough to be scaled.
const TOLD: f64 = 0.5;
/// At least so much of a run's time is that of its samples.
const LEAST: f64 = 0.25;
/// Pilots take no more than about this part of the time.
const SHARE: f64 = 0.1;

/// The purpose of random numbers.
const PILOT: u64 = 0x70_696c_6f74;

impl Pilot {
    /// The noise relative to what it is in; 0 if there is neither, ∞ if there is nothing else.
    pub(super) fn relative(&self) -> f64 {
        let [signal, noise] = self.squares;
        match noise {
            0.0 => 0.0,
            _ if signal <= 0.0 => f64::INFINITY,
            _ => (noise / signal).sqrt(),
        }
    }

    /// Of an image and its standard error.
    pub(super) fn of_image(seconds: f64, image: &Image, standard_error: &Image) -> Self {
        let square = |image: &Image| image.pixels.iter().map(|p| p.length_squared()).sum::<f64>();
        let noise = square(standard_error);
        Self { seconds, squares: [square(image) - noise, noise] }
    }

    /// Of independent runs with one vector each.
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
    /// Whether the number of samples is yet to be found.
    pub(super) fn is_open(&self) -> bool {
        self.time.is_some() || self.error.is_some()
    }

    /// The number of samples that fit into --time, if it is given alone, by the time that a pilot's survey takes, and the last survey. One of
    /// more samples tells it better, and is needed anyway where many fit.
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
            // What comes before samples is done once more.
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

    /// The number of samples, from as many pilots as are needed: each is given its samples and a seed of its own.
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
            // A run takes a time of its own and one for each sample, which two short runs may tell badly.
            let (few, seconds) = before.unwrap_or((0, 0.0));
            let mean = found.seconds / samples as f64;
            let each =
                ((found.seconds - seconds) / (samples - few) as f64).max(LEAST * mean).max(f64::MIN_POSITIVE);
            let own = (found.seconds - each * samples as f64).max(0.0);
            let by_time = time.map(|time| (time - spent - own) / each);
            // The next pilot would take too long.
            let is_late = time.is_some_and(|time| 5.0 * spent > SHARE * time);
            before = Some((samples, found.seconds));
            let wanted = match (by_error, by_time) {
                (Some(error), Some(time)) if is_late || error < time => Some(error.min(time)),
                (Some(error), None) => Some(error),
                (None, Some(time)) if is_late => Some(time),
                _ => None,
            };
            if let Some(wanted) = wanted {
                // A standard error takes two.
                let planned = (wanted.ceil().max(2.0) as usize).min(MAX_SAMPLES);
                let text = format!(
                    "a pilot of {samples} spp took {:.2} s and was off by {} of the gradient: {planned} spp\n",
                    found.seconds,
                    percent(relative)
                );
                let foreseen = Some(relative * (samples as f64 / planned as f64).sqrt());
                return Ok(Plan { samples: planned, text, foreseen });
            }
            if samples >= MOST && time.is_none() {
                bail!(
                    "after {samples} samples a pixel the gradient is still lost in its noise, {} of it: it may be 0; give --spp",
                    percent(relative)
                );
            }
            samples *= 4;
        }
        unreachable!("rounds have no end")
    }
}

/// A relative error in words.
pub(super) fn percent(relative: f64) -> String {
    if relative.is_finite() { format!("{:.2} %", 100.0 * relative) } else { "more than all".to_owned() }
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

    /// Of runs of one number, 3 ± 1: the noise of one run is its variance, and the signal what is left of the squared mean.
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
