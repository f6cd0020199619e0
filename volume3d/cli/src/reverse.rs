//! The reverse mode of `volume3d gradient`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{anyhow, bail};
use glam::DVec3;
use volume3d::Image;
use volume3d::gradient::{Estimator, Gradient, Tangent};
use volume3d::io::{Precision, read_exr, read_npy, write_npy};
use volume3d::optimize::Parameters;
use volume3d::scene::Scene;

use super::budget::{Budget, Pilot, percent};
use super::method::{MethodOptions, chosen};
use super::missing::left_out;
use super::output::{Written, check_array, check_distinct};
use super::parameter::{Name, arrays};
use super::report::Report;
use super::session::{Bar, RunOptions, SceneOptions, located as located_samples, lost};
use super::signals;
use super::summary::{INTERIOR, NOTHING_SEEN, outlier};
use super::{contact, session};

/// The options of `volume3d gradient` that apply to reverse mode.
pub(super) struct Request<'o> {
    pub(super) scene: &'o SceneOptions,
    pub(super) run: &'o RunOptions,
    pub(super) method: &'o MethodOptions,
    pub(super) adjoint: &'o Path,
    pub(super) parameters: &'o [Name],
    pub(super) output: &'o Path,
    pub(super) budget: &'o Budget,
}

/// Number of pilot runs whose spread estimates the noise.
const RUNS: u64 = 4;

pub(super) fn run(request: &Request<'_>) -> anyhow::Result<Report> {
    let paths = request.outputs()?;
    let outputs: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let mut inputs = vec![request.scene.path().to_path_buf(), request.adjoint.to_path_buf()];
    check_distinct(&outputs, &inputs)?;
    let adjoint = read_adjoint(request.adjoint)?;
    request.run.begin()?;
    let loaded = request.scene.load()?;
    inputs.extend(loaded.files);
    check_distinct(&outputs, &inputs)?;
    let scene = &loaded.scene;
    check_size(request.adjoint, &adjoint, scene)?;
    session::check_size(request.scene.path(), scene.size())?;
    let parameters = Parameters::new(scene, request.parameters)?;
    let active = parameters.active(scene);

    let choose = |samples, seed| {
        let estimator = request.method.estimator(samples, seed, None);
        chosen(estimator, |p| p.for_active(scene, Some(&adjoint), &active, &Bar::new(0, "pilot").progress()))
    };
    let run = |estimator: &Estimator, what| {
        let gradient = estimator.reverse(scene, &adjoint, &active, &Bar::new(0, what).progress())?;
        signals::stop_if_asked()?;
        anyhow::Ok(gradient)
    };
    let numbers = |gradient: &Gradient| -> Vec<f64> {
        let arrays = arrays(&parameters, scene, &gradient.by_parameter);
        arrays.into_iter().flat_map(|array| array.values).collect()
    };
    // The spread of these runs is the noise of one of them.
    let plan = request.budget.plan(scene, request.run.seed, |samples, seed| {
        let start = Instant::now();
        let (estimator, _) = choose(samples, seed)?;
        let chosen = start.elapsed().as_secs_f64();
        let runs = (0..RUNS)
            .map(|index| Ok(numbers(&run(&estimator.with_seed(seed ^ index), "pilot")?)))
            .collect::<anyhow::Result<Vec<_>>>()?;
        let seconds = chosen + (start.elapsed().as_secs_f64() - chosen) / RUNS as f64;
        Ok(Pilot::of_runs(seconds, &runs))
    })?;
    let (samples, start) = (plan.samples, Instant::now());
    let (estimator, chosen) = choose(samples, request.run.seed)?;
    let gradient = run(&estimator, "reverse")?;
    signals::hold()?;
    let seconds = start.elapsed().as_secs_f64();

    let mut text = plan.text + &chosen;
    text += &format!("{} × {} pixels, {samples} spp, {seconds:.2} s\n", adjoint.width, adjoint.height);
    if let Some(foreseen) = plan.foreseen {
        text += &format!("its predicted error is {} of the gradient, from the pilot\n", percent(foreseen));
    }
    text += &located_samples(&gradient.non_finite);
    text += &lost(gradient.traces, samples * adjoint.width * adjoint.height);
    text += &left_out(&gradient.left_out);
    if request.method.is_interior() && (active.is_geometric() || active.moves_lights()) {
        text += INTERIOR;
    }
    let asked = adjoint.pixels.iter().any(|a| *a != DVec3::ZERO);
    if asked && gradient.by_parameter == Tangent::still(scene) {
        text += NOTHING_SEEN;
    }
    let heavy = gradient.outlier().map(|largest| outlier(largest, gradient.largest_share()));
    text += &heavy.unwrap_or_default();
    let mut written = Written::after(text).noting(&loaded.deviations);
    for (array, path) in arrays(&parameters, scene, &gradient.by_parameter).iter().zip(&paths) {
        let size = array.values.iter().map(|x| x * x).sum::<f64>().sqrt();
        write_npy(path, array, Precision::Double)?;
        let lost = array.values.iter().filter(|x| !x.is_finite()).count();
        if lost > 0 {
            written.not_finite(&format!("{lost} of {} numbers of {}", array.values.len(), path.display()));
        }
        written.text += &format!("wrote {}, shape {:?}, norm {size:.3e}\n", path.display(), array.shape);
    }
    let text = &mut written.text;
    *text += &contact::in_contact(scene, |shape| active.shapes[shape]);
    *text += &contact::along_pixels(scene, |shape| active.shapes[shape] || active.camera);
    if active.is_geometric() {
        *text += &contact::too_coarse(scene);
        *text += &contact::through_implicits(scene);
    }
    Ok(written.report())
}

impl Request<'_> {
    /// An output file for each parameter.
    fn outputs(&self) -> anyhow::Result<Vec<PathBuf>> {
        let (output, count) = (self.output, self.parameters.len());
        if output.is_dir() {
            return Ok(self.parameters.iter().map(|p| output.join(p.file_name())).collect());
        }
        if count > 1 {
            bail!("{count} parameters need a folder, but {} is not one; create it first", output.display());
        }
        check_array(output)?;
        Ok(vec![output.to_path_buf()])
    }
}

fn read_adjoint(path: &Path) -> anyhow::Result<Image> {
    let is_array = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    if !is_array && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        bail!("{}: an adjoint has negative values, and is read from .exr or .npy", path.display());
    }
    let image = if is_array {
        let array = read_npy(path)?;
        array.to_image().ok_or_else(|| {
            anyhow!("{}: an adjoint is height × width × 3, not {:?}", path.display(), array.shape)
        })?
    } else {
        read_exr(path)?
    };
    if let Some(at) = image.pixels.iter().position(|p| !p.is_finite()) {
        let (x, y) = (at % image.width, at / image.width);
        bail!(
            "{}: the adjoint in column {x}, row {y} (counted from 0 at the top left) is not finite",
            path.display()
        );
    }
    Ok(image)
}

fn check_size(path: &Path, adjoint: &Image, scene: &Scene) -> anyhow::Result<()> {
    let (width, height) = scene.size();
    if (adjoint.width, adjoint.height) != (width, height) {
        let (w, h) = (adjoint.width, adjoint.height);
        bail!("{}: the adjoint has {w} × {h} pixels, but the film has {width} × {height}", path.display());
    }
    Ok(())
}
