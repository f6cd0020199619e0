//! The folder of a run.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use flatland::sdf::Sdf as _;
use volume3d::Image;
use volume3d::io::{
    load_image, read_exr, read_text, signed_range, write_animation, write_bytes, write_exr, write_obj,
    write_png, write_signed_png,
};
use volume3d::optimize::{Fit, Group, Quantity, State, read_checkpoint, write_checkpoint};
use volume3d::scene::{Camera, Film, Scene};
use volume3d::sdf::isosurface;

use super::super::session::{Bar, say};
use super::config::{Config, apart_from_steps};
use super::pictures::{LOOKED_AT, PICTURE, looked_at, sheet};
use super::quality::{JUDGED, Quality, judged};
use super::result::LISTED;
use super::views::view_file;
use super::{curve, placed_scene, report, result};

/// The largest number of frames of the animation, pictures of the first view.
const FRAMES: u64 = 32;

/// The largest number of views in the overview of targets, starts and fits.
const ROWS: usize = 3;

/// The file of the state.
const STATE: &str = "state.bin";

/// Cells along the longest side of the box of a fitted implicit surface, for its mesh.
const ISOSURFACE: usize = 128;

/// The folder of a fit.
pub(super) struct Folder {
    path: PathBuf,
    /// Held until the program ends, even if it is killed.
    _lock: Option<File>,
}

/// The lock file of a run. It stays after the run; only the lock on it counts.
const LOCK: &str = "lock";

/// Locks a folder; nothing, with a warning, if the file system has no locks.
fn lock(path: &Path) -> anyhow::Result<Option<File>> {
    let place = path.join(LOCK);
    let file = File::options().create(true).truncate(false).write(true).open(&place);
    let file = file.map_err(|e| anyhow!("cannot create {}: {e}", place.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => {
            bail!(
                "another process uses the run folder {}; wait for it, or choose another folder",
                path.display()
            )
        }
        Err(TryLockError::Error(error)) => {
            say(&format!(
                "WARNING: {} cannot be locked ({error}): do not run another fit in this folder at the same time\n",
                place.display()
            ));
            Ok(None)
        }
    }
}

impl Folder {
    /// Checks that a folder does not exist, is empty, or belongs to a run of this configuration; writes
    /// nothing.
    pub(super) fn check(path: &Path, config: &str) -> anyhow::Result<()> {
        if path.join(LOCK).exists() {
            lock(path)?;
        }
        Self::check_configuration(path, config)
    }

    fn check_configuration(path: &Path, config: &str) -> anyhow::Result<()> {
        let copy = path.join("config.toml");
        match read_text(&copy) {
            // The number of steps may change at any time.
            Ok(found) if found == config || apart_from_steps(&found) == apart_from_steps(config) => Ok(()),
            // The run with the other configuration has no state yet.
            Ok(_) if !path.join(STATE).exists() => Ok(()),
            Ok(_) => bail!(
                "{} is the folder of a run with another configuration, where only steps may change; choose another folder, \
                 or remove it",
                path.display()
            ),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                // A killed write leaves a temporary file, and a run that was killed early its lock.
                let is_ours = |name: &str| name == LOCK || name.starts_with(".tmp");
                let is_other = |e: std::io::Result<std::fs::DirEntry>| {
                    e.is_ok_and(|e| !is_ours(&e.file_name().to_string_lossy()))
                };
                if std::fs::read_dir(path).is_ok_and(|mut entries| entries.any(is_other)) {
                    bail!("{} is neither empty nor the folder of a run; choose another", path.display());
                }
                Ok(())
            }
            Err(_) if path.is_file() => bail!("{} is not a folder", path.display()),
            Err(error) => bail!("cannot read {}: {error}", copy.display()),
        }
    }

    /// Creates the folder, or opens it if it belongs to this configuration.
    pub(super) fn open(path: &Path, config: &str, inputs: &[PathBuf]) -> anyhow::Result<Self> {
        Self::check(path, config)?;
        let make = |path: &Path| {
            std::fs::create_dir_all(path)
                .map_err(|e| anyhow!("cannot create the folder {}: {e}", path.display()))
        };
        make(path)?;
        let folder = Self { path: path.to_path_buf(), _lock: lock(path)? };
        // Another process may have written to the folder before it was locked.
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

    /// The path of a file of the run.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Path of the state of one of several starts; its folder is created.
    pub(super) fn start_path(&self, name: &str) -> anyhow::Result<PathBuf> {
        let folder = self.file("starts");
        std::fs::create_dir_all(&folder)
            .map_err(|e| anyhow!("cannot create the folder {}: {e}", folder.display()))?;
        Ok(folder.join(format!("{name}.bin")))
    }

    /// The path of the state.
    pub(super) fn state_path(&self) -> PathBuf {
        self.file(STATE)
    }

    /// The state of an earlier run, if there is one.
    pub(super) fn state(&self, fingerprint: u32) -> anyhow::Result<Option<State>> {
        Ok(read_checkpoint(&self.state_path(), fingerprint)?)
    }

    /// Writes the state, and the losses so far.
    pub(super) fn keep(&self, fit: &Fit, fingerprint: u32) -> anyhow::Result<()> {
        write_bytes(&self.file("loss.csv"), &losses(fit)?)?;
        write_bytes(&self.file("loss.svg"), curve::losses(fit).as_bytes())?;
        Ok(write_checkpoint(&self.state_path(), fit.state(), fingerprint)?)
    }

    /// Writes pictures of the targets and of the start.
    pub(super) fn begin(&self, fit: &Fit, scene: &mut Scene) -> anyhow::Result<()> {
        let views = &fit.objective().views;
        let bar = Bar::new(views.len(), "render the start");
        for (v, view) in views.iter().enumerate() {
            self.picture(v, "target", &view.target)?;
            self.picture(v, "start", &looked_at(fit, scene, v, PICTURE, LOOKED_AT)?)?;
            bar.step();
        }
        Ok(())
    }

    fn picture(&self, view: usize, what: &str, image: &Image) -> anyhow::Result<()> {
        let name = view_file(view, what);
        write_exr(&self.file(&format!("{name}.exr")), image)?;
        Ok(write_png(&self.file(&format!("{name}.png")), image)?)
    }

    /// Writes a frame of the animation, if one is due.
    pub(super) fn frame(&self, config: &Config, fit: &Fit, scene: &mut Scene) -> anyhow::Result<()> {
        let done = fit.steps_taken();
        let is_time = |k: u64| k * config.steps / FRAMES.min(config.steps);
        if (0..=FRAMES).any(|k| is_time(k) == done) {
            write_png(&self.frame_path(done), &looked_at(fit, scene, 0, PICTURE, LOOKED_AT)?)?;
        }
        Ok(())
    }

    fn frame_path(&self, step: u64) -> PathBuf {
        self.file(&format!("frames/{step:08}.png"))
    }

    /// Writes the results; those of the parameter mean, if the fit has one. Returns a text about them, and a
    /// warning if the fit has not reached its pictures.
    pub(super) fn finish(
        &self,
        config: &Config,
        (fit, start, table): (&Fit, &[f64], &str),
        scene: &mut Scene,
        (camera, film): (Camera, Film),
    ) -> anyhow::Result<(String, String)> {
        fit.apply_result(scene)?;
        let views = &fit.objective().views;
        let bar = Bar::new(views.len(), "render the fit");
        let (mut ranges, mut views_judged, mut rows) = (vec![], vec![], vec![]);
        for (v, view) in views.iter().enumerate() {
            let image = looked_at(fit, scene, v, JUDGED, LOOKED_AT)?;
            self.picture(v, "fit", &image)?;
            views_judged.push(judged(config, fit, scene, v, &image)?);
            let pixels = image.pixels.iter().zip(&view.target.pixels).map(|(i, t)| *i - *t).collect();
            let difference = image.with_pixels(pixels);
            let path = self.file(&format!("{}.png", view_file(v, "difference")));
            ranges.push(signed_range(&difference));
            write_signed_png(&path, &difference, ranges[v])?;
            if rows.len() < ROWS {
                let start = read_exr(&self.file(&format!("{}.exr", view_file(v, "start"))))?;
                rows.push(vec![view.target.clone(), start, image]);
            }
            bar.step();
        }
        drop(bar);
        write_png(&self.file("views.png"), &sheet(&rows))?;
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
                    // A surface that reaches the border of its grid has no closed mesh; its grid is saved
                    // with fit.xml.
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
        let toml = result::toml(fit, start, scene, &views_judged);
        write_bytes(&self.file("result.toml"), toml.as_bytes())?;
        placed_scene::write(&self.file("fit.xml"), scene, fit.parameters(), fit.result())?;
        let found = report::Found { fit, start, ranges: &ranges, views: &views_judged, table };
        let page = report::page(config, &found, |name| self.file(name))?;
        write_bytes(&self.file("report.html"), page.as_bytes())?;
        let warning = Quality::of(&views_judged).warning(&views_judged, config);
        Ok((format!("{}wrote {}\n", result::listed(fit), self.file("report.html").display()), warning))
    }
}

/// A file name that any system accepts.
fn file_name(id: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    id.chars().map(keep).collect()
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

/// A table of the values of all parameters with few numbers.
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
