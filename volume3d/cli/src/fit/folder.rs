//! The folder of a run.

use std::fmt::Write as _;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use flatland::sdf::Sdf as _;
use volume3d::Image;
use volume3d::gradient::render;
use volume3d::io::{
    load_image, read_text, signed_range, write_animation, write_bytes, write_exr, write_obj, write_png,
    write_scene, write_signed_png,
};
use volume3d::optimize::{Fit, Group, Quantity, State, read_checkpoint, write_checkpoint};
use volume3d::scene::{Camera, Film, Scene};
use volume3d::sdf::isosurface;

use super::super::session::{Bar, say, silent};
use super::config::Config;
use super::views::view_file;
use super::{curve, report};

/// Pictures of the first view that the animation is made of, at most.
const FRAMES: u64 = 32;

/// Samples a pixel of pictures that are only looked at.
const PICTURE: usize = 64;

/// Where the state is kept.
const STATE: &str = "state.bin";

/// Purposes of random numbers, apart from those of the fit.
const LOOKED_AT: u64 = 1 << 33;

/// Cells along the longest side of a fitted grid's box, for its mesh.
const ISOSURFACE: usize = 128;

/// Numbers of a parameter that are listed one by one; larger ones are in the scene.
const LISTED: usize = 12;

/// A folder that is one fit's.
pub(super) struct Folder {
    path: PathBuf,
    /// Held until the program ends, however it does.
    _lock: Option<File>,
}

/// The lock file of a run. It stays after the run; only the lock on it counts.
const LOCK: &str = "lock";

/// The lock of a folder; nothing, with a warning, where the file system has none.
fn lock(path: &Path) -> anyhow::Result<Option<File>> {
    let place = path.join(LOCK);
    let file = File::options().create(true).truncate(false).write(true).open(&place);
    let file = file.map_err(|e| anyhow!("cannot make {}: {e}", place.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => {
            bail!(
                "another process is at the run in {}; wait for it, or choose another folder",
                path.display()
            )
        }
        Err(TryLockError::Error(error)) => {
            say(&format!(
                "WARNING: {} cannot be locked ({error}): let no other process fit in this folder meanwhile\n",
                place.display()
            ));
            Ok(None)
        }
    }
}

impl Folder {
    /// That a folder is not there, or is empty, or that of a run of this configuration; nothing is written.
    pub(super) fn check(path: &Path, config: &str) -> anyhow::Result<()> {
        if path.join(LOCK).exists() {
            lock(path)?;
        }
        Self::check_configuration(path, config)
    }

    fn check_configuration(path: &Path, config: &str) -> anyhow::Result<()> {
        let copy = path.join("config.toml");
        match read_text(&copy) {
            Ok(found) if found == config => Ok(()),
            // Nothing has come of the other configuration.
            Ok(_) if !path.join(STATE).exists() => Ok(()),
            Ok(_) => bail!(
                "{} is the folder of a run with another configuration; choose another folder, or remove it",
                path.display()
            ),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                // A write that was killed leaves a temporary file, and a run that was killed early its lock.
                let is_ours = |name: &str| name == LOCK || name.starts_with(".tmp");
                let is_other = |e: std::io::Result<std::fs::DirEntry>| {
                    e.is_ok_and(|e| !is_ours(&e.file_name().to_string_lossy()))
                };
                if std::fs::read_dir(path).is_ok_and(|mut entries| entries.any(is_other)) {
                    bail!("{} is not empty, and not the folder of a run; choose another", path.display());
                }
                Ok(())
            }
            Err(_) if path.is_file() => bail!("{} is not a folder", path.display()),
            Err(error) => bail!("cannot read {}: {error}", copy.display()),
        }
    }

    /// Makes the folder, or finds it as this configuration has left it.
    pub(super) fn open(path: &Path, config: &str, inputs: &[PathBuf]) -> anyhow::Result<Self> {
        Self::check(path, config)?;
        let make = |path: &Path| {
            std::fs::create_dir_all(path)
                .map_err(|e| anyhow!("cannot make the folder {}: {e}", path.display()))
        };
        make(path)?;
        let folder = Self { path: path.to_path_buf(), _lock: lock(path)? };
        // Another process may have been quicker.
        Self::check_configuration(path, config)?;
        let within = |input: &&PathBuf| {
            let [input, path] =
                [input.as_path(), path].map(|p| p.canonicalize().unwrap_or_else(|_| p.to_path_buf()));
            input.starts_with(path)
        };
        if let Some(input) = inputs.iter().find(within) {
            bail!(
                "{} is in the folder of the run, {}; choose another folder",
                input.display(),
                path.display()
            );
        }
        let copy = folder.file("config.toml");
        if read_text(&copy).ok().as_deref() != Some(config) {
            write_bytes(&copy, config.as_bytes())?;
        }
        ["views", "frames", "meshes"].iter().try_for_each(|name| make(&folder.file(name)))?;
        Ok(folder)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Where the state is kept.
    pub(super) fn state_path(&self) -> PathBuf {
        self.file(STATE)
    }

    /// The state that a run has left.
    pub(super) fn state(&self, fingerprint: u32) -> anyhow::Result<Option<State>> {
        Ok(read_checkpoint(&self.state_path(), fingerprint)?)
    }

    /// Keeps the state, and the losses so far.
    pub(super) fn keep(&self, fit: &Fit, fingerprint: u32) -> anyhow::Result<()> {
        write_bytes(&self.file("loss.csv"), &losses(fit)?)?;
        write_bytes(&self.file("loss.svg"), curve::losses(fit).as_bytes())?;
        Ok(write_checkpoint(&self.state_path(), fit.state(), fingerprint)?)
    }

    /// Targets, and where the fit begins.
    pub(super) fn begin(&self, fit: &Fit, scene: &mut Scene) -> anyhow::Result<()> {
        let views = &fit.objective().views;
        let bar = Bar::new(views.len(), "render the start");
        for (v, view) in views.iter().enumerate() {
            self.picture(v, "target", &view.target)?;
            self.picture(v, "start", &looked_at(fit, scene, v, PICTURE)?)?;
            bar.step();
        }
        Ok(())
    }

    fn picture(&self, view: usize, what: &str, image: &Image) -> anyhow::Result<()> {
        let name = view_file(view, what);
        write_exr(&self.file(&format!("{name}.exr")), image)?;
        Ok(write_png(&self.file(&format!("{name}.png")), image)?)
    }

    /// A picture of the first view, if it is time for one.
    pub(super) fn frame(&self, config: &Config, fit: &Fit, scene: &mut Scene) -> anyhow::Result<()> {
        let done = fit.steps_taken();
        let is_time = |k: u64| k * config.steps / FRAMES.min(config.steps);
        if (0..=FRAMES).any(|k| is_time(k) == done) {
            write_png(&self.frame_path(done), &looked_at(fit, scene, 0, PICTURE)?)?;
        }
        Ok(())
    }

    fn frame_path(&self, step: u64) -> PathBuf {
        self.file(&format!("frames/{step:08}.png"))
    }

    /// What there is at the end: of the mean of parameters, if the fit has one.
    pub(super) fn finish(
        &self,
        config: &Config,
        fit: &Fit,
        scene: &mut Scene,
        camera: Camera,
        film: Film,
    ) -> anyhow::Result<String> {
        fit.apply_result(scene)?;
        let views = &fit.objective().views;
        let bar = Bar::new(views.len(), "render the fit");
        let mut ranges = vec![];
        for (v, view) in views.iter().enumerate() {
            let image = looked_at(fit, scene, v, 4 * PICTURE)?;
            self.picture(v, "fit", &image)?;
            let pixels = image.pixels.iter().zip(&view.target.pixels).map(|(i, t)| *i - *t).collect();
            let difference = image.with_pixels(pixels);
            let path = self.file(&format!("{}.png", view_file(v, "difference")));
            ranges.push(signed_range(&difference));
            write_signed_png(&path, &difference, ranges[v])?;
            bar.step();
        }
        drop(bar);
        let frames = (0..=config.steps).map(|step| self.frame_path(step)).filter(|path| path.exists());
        let frames = frames.map(|path| load_image(&path, false)).collect::<Result<Vec<_>, _>>()?;
        write_animation(&self.file("animation.png"), &frames, 120)?;
        for member in fit.parameters().groups().iter().flat_map(Group::members) {
            let path = |id: &str| self.file(&format!("meshes/{}.obj", file_name(id)));
            match member.quantity {
                Quantity::VertexPositions { shape } => {
                    let shape = &scene.description().shapes[shape];
                    write_obj(&path(&shape.id), &shape.mesh)?;
                }
                Quantity::Sdf { implicit } => {
                    let shape = &scene.description().implicits[implicit];
                    // What reaches the border of its grid makes no closed mesh; the grid is beside fit.xml.
                    let mesh = shape.bounds().map(|bounds| isosurface(shape, bounds, ISOSURFACE));
                    match mesh {
                        Some(Ok(mesh)) => write_obj(&path(&shape.id), &mesh)?,
                        Some(Err(error)) => {
                            say(&format!("WARNING: no mesh of `{}` is written: {error}\n", shape.id));
                        }
                        None => {}
                    }
                }
                _ => {}
            }
        }
        write_bytes(&self.file("parameters.csv"), &values(fit, scene)?)?;
        if views.iter().any(|v| v.camera.is_some()) {
            scene.set_camera(camera)?;
        }
        scene.set_film(film)?;
        write_scene(&self.file("fit.xml"), scene)?;
        let page = report::page(config, fit, &values_listed(fit), &ranges, |name| self.file(name))?;
        write_bytes(&self.file("report.html"), page.as_bytes())?;
        Ok(format!("{}wrote {}\n", values_listed(fit), self.file("report.html").display()))
    }
}

/// A name that any system takes for a file.
fn file_name(id: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    id.chars().map(keep).collect()
}

/// What a view sees of the scene as it is, from samples that the fit does not use.
fn looked_at(fit: &Fit, scene: &mut Scene, view: usize, samples: usize) -> anyhow::Result<Image> {
    fit.objective().look(scene, view)?;
    Ok(render(scene, samples, LOOKED_AT + view as u64, &silent())?.image)
}

fn losses(fit: &Fit) -> anyhow::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(vec![]);
    let mut header = ["step", "loss", "penalty", "rate factor"].map(str::to_owned).to_vec();
    for group in fit.parameters().groups() {
        header.extend([format!("|gradient| {}", group.name), format!("signal {}", group.name)]);
    }
    header.extend(["samples not finite", "derivatives clamped"].map(str::to_owned));
    table.write_record(&header)?;
    for (step, record) in fit.state().records.iter().enumerate() {
        let mut row = vec![(step + 1).to_string()];
        row.extend([record.loss, record.penalty, record.factor].map(|v| v.to_string()));
        let pairs = record.norms.iter().zip(&record.signals);
        row.extend(pairs.flat_map(|(norm, signal)| [norm.to_string(), signal.to_string()]));
        row.extend([record.non_finite, record.clamped].map(|count| count.to_string()));
        table.write_record(&row)?;
    }
    Ok(table.into_inner()?)
}

/// All numbers that are few, with where they began.
fn values(fit: &Fit, scene: &Scene) -> anyhow::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(vec![]);
    table.write_record(["parameter", "index", "value"])?;
    for group in fit.parameters().groups() {
        let many = matches!(group.quantity, Quantity::VertexPositions { .. } | Quantity::Sdf { .. });
        if many && group.range.len() > LISTED {
            let dimensions = group.first().dimensions(scene);
            table.write_record([&group.name, &format!("{dimensions:?}"), "in fit.xml"])?;
            continue;
        }
        for (i, value) in fit.result()[group.range.clone()].iter().enumerate() {
            table.write_record([&group.name, &i.to_string(), &value.to_string()])?;
        }
    }
    Ok(table.into_inner()?)
}

/// The same, a line for each parameter.
fn values_listed(fit: &Fit) -> String {
    let mut text = String::new();
    for group in fit.parameters().groups() {
        let values = &fit.result()[group.range.clone()];
        if values.len() > LISTED {
            let _ = writeln!(text, "{}: {} numbers", group.name, values.len());
        } else {
            let values: Vec<String> = values.iter().map(|v| format!("{v:.6}")).collect();
            let _ = writeln!(text, "{}: {}", group.name, values.join(", "));
        }
    }
    text
}
