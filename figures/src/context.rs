//! Shared context of all figures: effort, output directory and progress.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::ValueEnum;
use glam::DVec3;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use volume3d::geometry::Mesh;
use volume3d::gradient::Progress;
use volume3d::io::write_obj;

use crate::gallery::{Drawing, dark_file};
use crate::output::{Table, write_csv, write_exr};
use crate::pictures::{write_animation, write_png};
use crate::plot::{Canvas, dark, light};

/// How many samples to spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    /// Minimal effort, for tests; the numbers mean nothing.
    #[value(hide = true)]
    Sketch,
    /// Enough to see every effect, in a few minutes; long studies compute one scene, beside recorded results.
    Draft,
    /// A draft in which long studies are computed, but smaller ones than the text's goals: in an hour or two.
    Short,
    /// Enough to print; long studies are computed whole, in many hours.
    Full,
}

/// Settings and outputs shared by all figures.
pub(crate) struct Context {
    quality: Quality,
    out: PathBuf,
    seed: u64,
    bar: ProgressBar,
    pace: Arc<Pace>,
    start: Instant,
    /// All drawings by file name.
    drawings: Mutex<BTreeMap<String, Drawing>>,
}

impl Context {
    /// The context of a run of figures, with the usual duration of each in seconds.
    pub(crate) fn new(quality: Quality, out: PathBuf, seed: u64, usual: Vec<f64>) -> Self {
        let bar = ProgressBar::new(usual.len() as u64);
        let pace = Arc::new(Pace { usual, done: Mutex::default(), start: Instant::now() });
        let shown = Arc::clone(&pace);
        let left = move |_: &ProgressState, text: &mut dyn Write| {
            // A bar that cannot be written shows nothing.
            let _ = text.write_str(&shown.shown());
        };
        bar.set_style(style("{pos}/{len} {left} {msg}").with_key("left", left));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { quality, out, seed, bar, pace, start: Instant::now(), drawings: Mutex::default() }
    }

    /// The least, a short or the full study, by the requested quality.
    pub(crate) fn study<T>(&self, sketch: T, short: T, full: T) -> T {
        match self.quality {
            Quality::Sketch | Quality::Draft => sketch,
            Quality::Short => short,
            Quality::Full => full,
        }
    }

    /// The requested quality.
    pub(crate) fn quality(&self) -> Quality {
        self.quality
    }

    /// The folder of results.
    pub(crate) fn out(&self) -> &Path {
        &self.out
    }

    /// `draft` or `full`, by the requested quality.
    pub(crate) fn spend<T>(&self, draft: T, full: T) -> T {
        match self.quality {
            Quality::Sketch | Quality::Draft | Quality::Short => draft,
            Quality::Full => full,
        }
    }

    /// The seed of all random numbers.
    pub(crate) fn seed(&self) -> u64 {
        self.seed
    }

    /// The path of an output file.
    pub(crate) fn path(&self, file: &str) -> PathBuf {
        self.out.join(file)
    }

    /// Writes a drawing to a file of this name, and a variant for dark pages to another.
    pub(crate) fn png(&self, file: &str, canvas: &Canvas) -> Result<()> {
        self.note(file, canvas);
        write_png(&self.out.join(file), canvas, light)?;
        write_png(&self.out.join(dark_file(file)), canvas, dark)
    }

    /// Writes drawings of one size as an animated file, each shown for `milliseconds`, and a variant for dark
    /// pages as another.
    pub(crate) fn animation(&self, file: &str, frames: &[Canvas], milliseconds: u16) -> Result<()> {
        if let Some(first) = frames.first() {
            self.note(file, first);
        }
        write_animation(&self.out.join(file), frames, milliseconds, light)?;
        write_animation(&self.out.join(dark_file(file)), frames, milliseconds, dark)
    }

    fn note(&self, file: &str, canvas: &Canvas) {
        let (parts, kept) = (canvas.parts().to_vec(), canvas.kept().clone());
        let drawing = Drawing { size: canvas.size().to_array(), parts, kept };
        self.add_drawings([(file.to_owned(), drawing)]);
    }

    /// Adds drawings whose files are in the folder.
    pub(crate) fn add_drawings(&self, drawings: impl IntoIterator<Item = (String, Drawing)>) {
        self.drawings.lock().unwrap_or_else(PoisonError::into_inner).extend(drawings);
    }

    /// All drawings by file name.
    pub(crate) fn drawings(&self) -> BTreeMap<String, Drawing> {
        self.drawings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Writes a table, and returns the file's name for the list of data.
    pub(crate) fn csv(&self, file: &str, table: &Table) -> Result<String> {
        write_csv(&self.out.join(file), table)?;
        Ok(file.to_owned())
    }

    /// Writes linear colours row by row, including signed ones, and returns the file's name for the list of
    /// data.
    pub(crate) fn exr(&self, file: &str, width: usize, pixels: &[DVec3]) -> Result<String> {
        let pixels: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.as_vec3().to_array()).collect();
        write_exr(&self.out.join(file), width, &pixels)?;
        Ok(file.to_owned())
    }

    /// Writes a mesh as OBJ, and returns the file's name for the list of data.
    pub(crate) fn obj(&self, file: &str, mesh: &Mesh) -> Result<String> {
        write_obj(&self.out.join(file), mesh)?;
        Ok(file.to_owned())
    }

    /// Shows the figure's current step.
    pub(crate) fn step(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// Shows the figure's current step with its progress.
    pub(crate) fn progress(&self, what: &str) -> Progress {
        told(&self.bar, what)
    }

    /// Draws one figure, and reports the time it took.
    pub(crate) fn figure<T>(&self, title: &str, draw: impl FnOnce() -> Result<T>) -> Result<T> {
        let start = Instant::now();
        self.bar.set_prefix(title.to_owned());
        self.step(title);
        let drawn = draw()?;
        let seconds = start.elapsed().as_secs_f64();
        self.bar.suspend(|| eprintln!("{seconds:6.1} s  {title}"));
        self.bar.inc(1);
        self.pace.next(seconds);
        Ok(drawn)
    }

    /// Prints where the gallery is.
    pub(crate) fn finish(&self, page: &Path) {
        self.bar.finish_and_clear();
        println!("{} written in {:.1} s", page.display(), self.start.elapsed().as_secs_f64());
    }
}

/// Progress of a run, weighted by the usual durations of its figures.
struct Pace {
    /// The usual seconds of each figure.
    usual: Vec<f64>,
    /// The seconds of those that are done.
    done: Mutex<Vec<f64>>,
    start: Instant,
}

impl Pace {
    /// Notes that another figure is done.
    fn next(&self, seconds: f64) {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).push(seconds);
    }

    /// Completed fraction, in [0, 1], and estimated seconds left, given the seconds elapsed.
    fn at(&self, elapsed: f64) -> (f64, f64) {
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        let usual = |range: std::ops::Range<usize>| self.usual[range].iter().sum::<f64>();
        let (count, all) = (done.len().min(self.usual.len()), usual(0..self.usual.len()));
        let (taken, expected) = (done.iter().sum::<f64>(), usual(0..count));
        // The machine's speed, of which one usual minute is known before anything is done.
        let speed = (taken + 60.0) / (expected + 60.0);
        let now = self.usual.get(count).copied().unwrap_or(0.0) * speed;
        let within = (elapsed - taken).max(0.0);
        // One that takes longer than usual is always nearly done.
        let of_now = if now > 0.0 { (within / now).min(within / (within + 0.05 * now)) } else { 0.0 };
        let left = (1.0 - of_now) * now + speed * (all - expected - now / speed).max(0.0);
        ((expected + of_now * now / speed) / all, left)
    }

    /// A bar, and the time that is left.
    fn shown(&self) -> String {
        let (part, left) = self.at(self.start.elapsed().as_secs_f64());
        let full = (24.0 * part.clamp(0.0, 1.0)) as usize;
        let left = left.ceil() as u64;
        format!(
            "{}{} {:3.0} %, {}:{:02} left",
            "█".repeat(full),
            "░".repeat(24 - full),
            100.0 * part,
            left / 60,
            left % 60
        )
    }
}

/// Progress shown in the bar's message, stage by stage.
pub(crate) fn told(bar: &ProgressBar, what: &str) -> Progress {
    bar.set_message(what.to_owned());
    let (bar, what) = (bar.clone(), what.to_owned());
    let done = Arc::new([AtomicUsize::new(0), AtomicUsize::new(1)]);
    let start = {
        let done = Arc::clone(&done);
        move |steps: usize| {
            done[0].store(0, Ordering::Relaxed);
            done[1].store(steps.max(1), Ordering::Relaxed);
        }
    };
    let step = move || {
        let percent = 100 * (1 + done[0].fetch_add(1, Ordering::Relaxed)) / done[1].load(Ordering::Relaxed);
        bar.set_message(format!("{what}: {percent} %"));
    };
    Progress::new(start, step)
}

pub(crate) fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("the template is well formed")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_the_machine() {
        let pace = Pace { usual: vec![20.0, 60.0, 20.0], done: Mutex::default(), start: Instant::now() };
        assert_eq!(pace.at(0.0), (0.0, 100.0));
        let (part, left) = pace.at(10.0);
        assert!((part - 0.1).abs() < 0.02 && (left - 90.0).abs() < 2.0, "{part} {left}");
        // The first took five times as long as usual: speed (100 + 60)/(20 + 60) = 2.
        pace.next(100.0);
        let (part, left) = pace.at(100.0);
        assert!((part - 0.2).abs() < 1e-9 && (left - 160.0).abs() < 1e-9, "{part} {left}");
        // One that takes for ever never ends, and the part grows.
        let (late, left) = pace.at(1000.0);
        assert!(late > 0.7 && late < 0.8 && left > 40.0 && left < 60.0, "{late} {left}");
    }
}
