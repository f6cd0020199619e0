//! Shared context of all figures: effort, output directory and progress.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::ValueEnum;
use glam::DVec3;
use indicatif::{ProgressBar, ProgressStyle};
use volume3d::geometry::Mesh;
use volume3d::gradient::Progress;
use volume3d::io::write_obj;

use crate::gallery::{Drawing, dark_file};
use crate::output::{Table, write_animation, write_csv, write_exr, write_png};
use crate::plot::{Canvas, dark, light};

/// How many samples to spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    /// Enough to see every effect; all figures in about four minutes on two cores.
    Draft,
    /// Enough to print.
    Full,
}

/// Settings and outputs shared by all figures.
pub(crate) struct Context {
    quality: Quality,
    out: PathBuf,
    seed: u64,
    figures: ProgressBar,
    start: Instant,
    /// All drawings by file name.
    drawings: Mutex<BTreeMap<String, Drawing>>,
}

impl Context {
    /// The context of a run of `count` figures.
    pub(crate) fn new(quality: Quality, out: PathBuf, seed: u64, count: usize) -> Self {
        let figures =
            ProgressBar::new(count as u64).with_style(style("{pos}/{len} {bar:24} {elapsed} {msg}"));
        figures.enable_steady_tick(Duration::from_millis(200));
        Self { quality, out, seed, figures, start: Instant::now(), drawings: Mutex::default() }
    }

    /// `draft` or `full`, by the requested quality.
    pub(crate) fn spend<T>(&self, draft: T, full: T) -> T {
        match self.quality {
            Quality::Draft => draft,
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
        let drawing = Drawing { size: canvas.size(), parts: canvas.parts().to_vec() };
        self.drawings.lock().unwrap_or_else(PoisonError::into_inner).insert(file.to_owned(), drawing);
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
        self.figures.set_message(what.to_owned());
    }

    /// Shows the figure's current step with its progress.
    pub(crate) fn progress(&self, what: &str) -> Progress {
        told(&self.figures, what)
    }

    /// Draws one figure, and reports the time it took.
    pub(crate) fn figure<T>(&self, title: &str, draw: impl FnOnce() -> Result<T>) -> Result<T> {
        let start = Instant::now();
        self.step(title);
        let drawn = draw()?;
        let seconds = start.elapsed().as_secs_f64();
        self.figures.suspend(|| eprintln!("{seconds:6.1} s  {title}"));
        self.figures.inc(1);
        Ok(drawn)
    }

    /// Prints where the gallery is.
    pub(crate) fn finish(&self, page: &Path) {
        self.figures.finish_and_clear();
        println!("{} written in {:.1} s", page.display(), self.start.elapsed().as_secs_f64());
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
