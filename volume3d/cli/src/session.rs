//! Start-up of every command (threads, signals, the scene) and its progress bar.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{anyhow, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use volume3d::Image;
use volume3d::gradient::{NonFinite, Progress};
use volume3d::io::{Note, ReadOptions, read_bytes, read_scene_with, write_png};
use volume3d::scene::{Scene, TraceCounts};

use super::file_kind::read_scene_file;
use super::{memory, signals};

/// Samples that were not finite and whose positions are listed, at most.
const NAMED: usize = 5;

#[derive(Args, Debug)]
pub(super) struct SceneOptions {
    /// The scene: Mitsuba XML.
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    /// Sets $NAME in the scene, instead of its <default>. May be repeated.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = definition)]
    define: Vec<(String, String)>,
    /// Film size, for the same view: the field of view applies along the axis for which the scene gives it.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<(usize, usize)>,
    /// Replaces or ignores unsupported parts of the scene instead of failing, and lists them on standard
    /// error. The image then differs from that of the scene.
    #[arg(long)]
    lenient: bool,
}

#[derive(Args, Debug)]
pub(super) struct RunOptions {
    /// The seed of all random numbers. The same seed gives bit-identical results with any number of threads.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub(super) seed: u64,
    #[command(flatten)]
    threads: Threads,
}

#[derive(Args, Debug)]
pub(super) struct Threads {
    /// Number of threads [default: all of the machine].
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

fn definition(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("expected NAME=VALUE".to_owned()),
    }
}

/// WIDTHxHEIGHT, both from 1 to 65536.
fn size(text: &str) -> Result<(usize, usize), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=1 << 16).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT, whole numbers from 1 to 65536".to_owned())
}

/// A scene, with the files that were read for it.
pub(super) struct Loaded {
    pub(super) scene: Scene,
    pub(super) files: Vec<PathBuf>,
    /// Notes about parts of the file that may be read differently than intended.
    pub(super) notes: Vec<Note>,
    /// The notes that change the image: printed, and stored with results.
    pub(super) deviations: Vec<String>,
}

impl SceneOptions {
    pub(super) fn path(&self) -> &Path {
        &self.scene
    }

    /// The options as words of a command line.
    pub(super) fn words(&self) -> Vec<String> {
        let define = |(name, value): &(String, String)| ["-D".to_owned(), format!("{name}={value}")];
        let size = self.size.map(|(width, height)| ["--size".to_owned(), format!("{width}x{height}")]);
        let lenient = self.lenient.then(|| "--lenient".to_owned());
        [self.scene.display().to_string()]
            .into_iter()
            .chain(self.define.iter().flat_map(define))
            .chain(size.into_iter().flatten())
            .chain(lenient)
            .collect()
    }

    pub(super) fn load(&self) -> anyhow::Result<Loaded> {
        let Self { define, size, lenient, .. } = self;
        let options = ReadOptions { variables: define.clone(), size: *size, is_lenient: *lenient };
        let loaded = Loaded::read_with(&self.scene, &options)?;
        loaded.say_deviations();
        Ok(loaded)
    }
}

impl Loaded {
    /// Reads a scene file, with values for its $names.
    pub(super) fn read(path: &Path, define: &[(String, String)]) -> anyhow::Result<Self> {
        Self::read_with(path, &ReadOptions { variables: define.to_vec(), ..ReadOptions::default() })
    }

    fn read_with(path: &Path, options: &ReadOptions) -> anyhow::Result<Self> {
        let bytes = read_scene_file(path)?;
        let files = RefCell::new(vec![path.to_path_buf()]);
        let open = |file: &Path| {
            check_file(file)?;
            let bytes = read_bytes(file)?;
            files.borrow_mut().push(file.to_path_buf());
            Ok(bytes)
        };
        let (description, notes) = read_scene_with(&bytes, path, options, &open)?;
        check_triangles(path, description.shapes.iter().map(|shape| shape.mesh.triangles().len()).sum())?;
        let scene = Scene::new(description).map_err(|e| anyhow!("{}: {e}", path.display()))?;
        check_memory(path, &scene)?;
        let told = notes.iter().filter(|note| options.is_lenient || note.changes_image);
        let deviations = told.map(ToString::to_string).collect();
        Ok(Self { scene, files: files.into_inner(), notes, deviations })
    }

    /// Prints the deviations on standard error.
    pub(super) fn say_deviations(&self) {
        self.deviations.iter().for_each(|note| say(&format!("note: {note}\n")));
    }
}

/// Memory of a gradient with its terms per pixel, at most, in bytes: two tables of 15 numbers, the images of
/// its noise, and the output images and files.
const BYTES_A_PIXEL: usize = 584;

/// Memory of a rendering per pixel, in bytes; measured with 2.4 million pixels.
const BYTES_OF_A_RENDERING: usize = 100;

/// Memory of a scene per triangle, in bytes; measured with one mesh of 980,000 triangles. Gradients take
/// more.
const BYTES_A_TRIANGLE: usize = 480;

/// Memory of a grid per byte of its file: nodes in double precision, and two flags each. The file itself has
/// been released by then.
const BYTES_OF_A_GRID: u64 = 3;

/// Refuses files that do not fit into the available memory, before they are read; for a grid, with the data
/// made from it.
fn check_file(path: &Path) -> std::io::Result<()> {
    let is_grid = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vol"));
    let bytes = std::fs::metadata(path)?.len();
    let needed = bytes.saturating_mul(if is_grid { BYTES_OF_A_GRID } else { 1 });
    match memory::available() {
        Some(available) if needed > available as u64 => Err(std::io::Error::new(
            std::io::ErrorKind::OutOfMemory,
            format!(
                "it needs {} of memory, and {} is available",
                size_of_memory(usize::try_from(needed).unwrap_or(usize::MAX)),
                size_of_memory(available)
            ),
        )),
        _ => Ok(()),
    }
}

/// Refuses meshes that do not fit into the available memory, before hierarchies are built over them.
fn check_triangles(path: &Path, triangles: usize) -> anyhow::Result<()> {
    let needed = triangles.saturating_mul(BYTES_A_TRIANGLE).saturating_sub(memory::resident());
    match memory::available() {
        Some(available) if needed > available => bail!(
            "{}: its {triangles} triangles need {} more memory, and {} is available",
            path.display(),
            size_of_memory(needed),
            size_of_memory(available)
        ),
        _ => Ok(()),
    }
}

fn size_of_memory(bytes: usize) -> String {
    format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30))
}

fn check_memory(path: &Path, scene: &Scene) -> anyhow::Result<()> {
    check_pixels(path, scene.size(), BYTES_OF_A_RENDERING)
}

/// Refuses images whose gradients do not fit into the available memory, before any work.
pub(super) fn check_size(path: &Path, size: (usize, usize)) -> anyhow::Result<()> {
    check_pixels(path, size, BYTES_A_PIXEL)
}

fn check_pixels(path: &Path, (width, height): (usize, usize), each: usize) -> anyhow::Result<()> {
    let needed = width.saturating_mul(height).saturating_mul(each);
    if let Some(available) = memory::available().filter(|available| needed > *available) {
        bail!(
            "{}: an image of {width} × {height} pixels may need {} of memory, more than the available {}; render it in \
             parts, with the film's crop_width, crop_height, crop_offset_x and crop_offset_y",
            path.display(),
            size_of_memory(needed),
            size_of_memory(available)
        );
    }
    // Every command stores at least the colour of each pixel.
    let colours = Vec::<[f64; 3]>::new().try_reserve_exact(width * height);
    colours.map_err(|error| anyhow!("{}: an image of {width} × {height} pixels: {error}", path.display()))?;
    Ok(())
}

/// Writes to standard error; failures are ignored.
pub(super) fn say(text: &str) {
    let _ = std::io::stderr().write_all(text.as_bytes());
}

/// The notes that matter for geometric gradients: which shapes are meshes of something else.
pub(super) fn geometric(notes: &[Note]) -> String {
    notes.iter().filter(|note| note.is_geometric).map(|note| format!("note: {}\n", note.text)).collect()
}

impl RunOptions {
    /// See [`Threads::begin`].
    pub(super) fn begin(&self) -> anyhow::Result<()> {
        self.threads.begin()
    }
}

impl Threads {
    /// Starts the threads, and [listens for signals](signals::listen).
    pub(super) fn begin(&self) -> anyhow::Result<()> {
        let threads = self.threads.map_or(0, |t| t as usize);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|e| anyhow!("cannot start {threads} threads: {e}; try a smaller --threads"))?;
        signals::listen()
    }
}

/// Progress without a bar, which stops at a signal.
pub(super) fn silent() -> Progress {
    Progress::none().until(signals::is_asked)
}

/// A progress bar on standard error, if that is a terminal; removed when dropped.
pub(super) struct Bar(ProgressBar);

impl Bar {
    pub(super) fn new(steps: usize, what: &'static str) -> Self {
        let style =
            ProgressStyle::with_template("{msg} {bar:32} {percent:>3}%  {elapsed} elapsed, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(steps as u64).with_style(style).with_message(what);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    /// Shows the progress of one computation, stage by stage.
    pub(super) fn progress(&self) -> Progress {
        self.timed(&Clock::default())
    }

    /// Like [`progress`](Self::progress), and measures the duration of the stages with `clock`.
    pub(super) fn timed(&self, clock: &Clock) -> Progress {
        let (start, step) = (self.0.clone(), self.0.clone());
        let (started, stepped) = (clock.clone(), clock.clone());
        let begin = move |steps: usize| {
            started.begin();
            start.reset();
            start.set_length(steps as u64);
        };
        let advance = move || {
            stepped.step();
            step.inc(1);
        };
        Progress::new(begin, advance).until(signals::is_asked)
    }

    pub(super) fn step(&self) {
        self.0.inc(1);
    }

    /// Prints a line on standard error, above the bar.
    pub(super) fn say(&self, text: &str) {
        self.0.suspend(|| say(&format!("{text}\n")));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// The duration of the stages of a computation, without the preparation before each.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock(Arc<Mutex<Stages>>);

#[derive(Debug, Default)]
struct Stages {
    /// The sum over finished stages.
    whole: Duration,
    /// Start of the current stage, and end of its last step.
    last: Option<(Instant, Instant)>,
}

impl Clock {
    fn begin(&self) {
        let (now, mut stages) = (Instant::now(), self.0.lock().unwrap_or_else(PoisonError::into_inner));
        stages.whole = stages.sum();
        stages.last = Some((now, now));
    }

    fn step(&self) {
        if let Some((_, end)) = &mut self.0.lock().unwrap_or_else(PoisonError::into_inner).last {
            *end = Instant::now();
        }
    }

    pub(super) fn seconds(&self) -> f64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).sum().as_secs_f64()
    }
}

impl Stages {
    fn sum(&self) -> Duration {
        self.whole + self.last.map_or(Duration::ZERO, |(begin, end)| end.saturating_duration_since(begin))
    }
}

/// A line of warnings about rays at implicit surfaces: if more than 1 in 1000 samples lost a ray, if a ray
/// may have passed through a surface, or if a ray met one where its slope biases gradients.
pub(super) fn lost(traces: TraceCounts, samples: usize) -> String {
    let TraceCounts { out_of_steps, too_steep, too_flat } = traces;
    let mut found = vec![];
    if out_of_steps as f64 > 1e-3 * samples as f64 {
        found.push(format!(
            "{out_of_steps} rays, for {samples} samples, ran out of steps and count as misses, which biases silhouettes \
             (is φ far below the distance?)"
        ));
    }
    if too_steep > 0 {
        found.push(format!(
            "{too_steep} found φ steeper than its bound and may have passed through (state a larger bound, or make φ a \
             distance)"
        ));
    }
    if too_flat > 0 {
        found.push(format!(
            "{too_flat} hit it where φ has a slope below 0.7, which biases gradients (make φ a distance in scene units)"
        ));
    }
    if found.is_empty() {
        return String::new();
    }
    format!("WARNING: rays at implicit surfaces: {}\n", found.join("; "))
}

/// Like [`lost`], with a picture of the lost rays next to an output file; the pixel with most of them is
/// white.
pub(super) fn lost_with_picture(
    traces: TraceCounts,
    lost_rays: Option<&Image>,
    samples: usize,
    output: &Path,
) -> anyhow::Result<String> {
    let mut text = lost(traces, samples);
    // Slopes that are too small lose no rays.
    let is_about_rays = !lost(TraceCounts { too_flat: 0, ..traces }, samples).is_empty();
    if let (true, Some(image)) = (is_about_rays, lost_rays) {
        let most = image.pixels.iter().map(|p| p.x).fold(0.0, f64::max);
        let stem = output.file_stem().unwrap_or_default().to_string_lossy();
        let path = output.with_file_name(format!("{stem}_lost_rays.png"));
        write_png(&path, &image.with_pixels(image.pixels.iter().map(|p| *p / most).collect()))?;
        let _ =
            writeln!(text, "picture of the lost rays: {}; white is {most} rays per pixel", path.display());
    }
    Ok(text)
}

/// A line with the positions of samples that were not finite; empty if there are none.
pub(super) fn located(non_finite: &[NonFinite]) -> String {
    let mut text = String::new();
    if let Some(first) = non_finite.get(..NAMED.min(non_finite.len())).filter(|f| !f.is_empty()) {
        let count = non_finite.len();
        let _ = write!(text, "{count} samples were not finite and are left out (column, row, sample):");
        for NonFinite { column, row, sample } in first {
            let _ = write!(text, " ({column}, {row}, {sample})");
        }
        text.push_str(if count > NAMED { " …\n" } else { "\n" });
    }
    text
}
