//! Builds a fit from its configuration.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use glam::DVec3;
use volume3d::Image;
use volume3d::gradient::{ActiveParameters, Estimator, Gradient, GradientError, Pilot, Progress};
use volume3d::io::read_bytes;
use volume3d::optimize::{
    Adam, Fit, GridSteps, Group, LargeSteps, MaskTerm, Member, Objective, Optimizer, Parameters, Penalty,
    Plan, Quantity,
};
use volume3d::scene::Scene;
use volume3d::sdf::{Baked, Grid, Guided};

use super::super::contact;
use super::super::file_kind::{check_there, read_configuration};
use super::super::method::{self, Method, MethodOptions};
use super::super::session::{Bar, Loaded, silent};
use super::super::summary::INTERIOR;
use super::config::{Config, MasksConfig, RegularizerConfig, apart_from_steps, definitions};
use super::folder::Folder;
use super::message;
use super::parameter::ParameterConfig;
use super::parse::parse;
use super::views::views;

/// A fit before its first step, with its inputs.
pub(super) struct Problem {
    pub(super) config: Config,
    /// The text of the configuration.
    pub(super) text: String,
    pub(super) scene: Scene,
    pub(super) fit: Fit,
    /// Checksum of the configuration without its steps, and of all files that it names: a state is not
    /// resumed with other inputs.
    pub(super) fingerprint: u32,
    pub(super) files: Vec<PathBuf>,
}

impl Problem {
    /// Reads all inputs and renders targets. An error if the run's folder belongs to another configuration.
    pub(super) fn read(path: &Path, run: &Path) -> anyhow::Result<Self> {
        let text = read_configuration(path)?;
        let mut config = parse(&text, path)?;
        // Checked first, because rendering targets may take long.
        Folder::check(run, &text)?;
        let scenes = std::iter::once(("scene", &config.scene));
        let reference = config.reference.iter().map(|reference| ("[reference]: scene", &reference.scene));
        for (key, scene) in scenes.chain(reference).filter(|(_, scene)| !scene.is_dir()) {
            check_there(scene, &format!("{}: {key}", path.display()))?;
        }
        let loaded = Loaded::read(&config.scene, &definitions(&config.define))?;
        loaded.say_deviations();
        let Loaded { scene, mut files, deviations, .. } = loaded;
        config.deviations = deviations;
        let said = |error: anyhow::Error| anyhow!(message::with_line(&error.to_string(), &text, path));
        let parameters = parameters(&config, &scene).map_err(said)?;
        let x = start(&config, &scene, &parameters).map_err(said)?;
        let of_view = |e: anyhow::Error| if e.to_string().starts_with("view") { said(e) } else { e };
        let (views, more) = views(&config, &scene).map_err(of_view)?;
        files.extend(more);
        let follows = |q: &Quantity| {
            matches!(q, Quantity::CameraTranslation | Quantity::CameraRotation | Quantity::FieldOfView)
        };
        if let Some(camera) = parameters.groups().iter().find(|g| g.members().any(|m| follows(&m.quantity)))
            && (views.len() > 1 || views.iter().any(|v| v.camera.is_some()))
        {
            let problem = format!(
                "`{}` is a parameter of the scene's own camera, so there can be only one [[view]], without origin and fov; \
                 here are {} views{}. Leave out the others, or fit the geometry instead of the camera: `all.translation`, \
                 `all.rotation`",
                camera.name,
                views.len(),
                if views.len() == 1 { ", with a camera" } else { "" }
            );
            return Err(said(anyhow!(problem)));
        }
        let penalties = config.regularizers.iter().map(|r| penalty(r, &scene, &parameters));
        let penalties = penalties.collect::<anyhow::Result<_>>().map_err(said)?;
        let image_samples = config.gradient.image_spp.unwrap_or(config.gradient.spp);
        let plan = Plan {
            steps: config.steps,
            schedule: config.schedule,
            views_per_step: config.views_per_step.unwrap_or(views.len()),
            seed: config.seed,
        };
        let silhouettes = config.silhouettes;
        let active = parameters.active(&scene);
        if silhouettes.is_some() && !active.shapes.iter().chain(&active.implicits).any(|&active| active) {
            return Err(said(anyhow!(
                "silhouettes is given, but no shape is fitted: it selects pixels near silhouettes of fitted shapes"
            )));
        }
        let masks = config.masks.as_ref().map(|m| masks(m, &scene, &parameters));
        let masks = masks.transpose().map_err(said)?;
        let loss = config.loss.into();
        let objective = Objective {
            views,
            loss,
            penalties,
            masks,
            silhouettes,
            pixels: config.pixels_per_view,
            image_samples,
        };
        let optimizers = config.parameters.iter().zip(parameters.groups());
        let optimizers =
            optimizers.map(|(p, group)| optimizer(p, group, &scene)).collect::<anyhow::Result<_>>();
        let optimizers = optimizers.map_err(said)?;
        let fit = Fit::new(parameters, x, objective, optimizers, plan);
        let fit = if let Some(decay) = config.parameter_mean { fit.averaged(decay) } else { fit };
        let fingerprint = fingerprint(&files, &apart_from_steps(&text))?;
        files.push(path.to_path_buf());
        Ok(Self { config, text, scene, fit, fingerprint, files })
    }
}

fn masks(config: &MasksConfig, scene: &Scene, parameters: &Parameters) -> anyhow::Result<MaskTerm> {
    let id = &config.shape;
    let implicit = scene.find_implicit(id).map_err(|e| anyhow!("[masks]: {e}"))?;
    if !parameters.active(scene).implicits[implicit] {
        bail!("[masks]: no parameter of `{id}` is fitted");
    }
    Ok(MaskTerm { implicit, loss: config.loss()? })
}

/// A regularizer of a fitted shape.
fn penalty(config: &RegularizerConfig, scene: &Scene, parameters: &Parameters) -> anyhow::Result<Penalty> {
    let RegularizerConfig { shape: id, weight, .. } = config;
    let is_fitted = |quantity: Quantity| parameters.groups().iter().any(|group| group.has(quantity));
    let Some(regularizer) = config.regularizer() else {
        let implicit = scene.find_implicit(id).map_err(|e| anyhow!("regularizer: {e}"))?;
        let surface = &scene.description().implicits[implicit].surface;
        if surface.downcast::<Baked>().is_none() && surface.downcast::<Guided>().is_none() {
            bail!(
                "the eikonal regularizer applies to networks (<shape type=\"sdfnetwork\">), and `{id}` is not one"
            );
        }
        if !is_fitted(Quantity::Sdf { implicit }) {
            bail!("a regularizer of `{id}` has no effect unless `{id}.sdf` is fitted");
        }
        return Ok(Penalty::Eikonal { implicit, weight: *weight });
    };
    let shape = scene.find_shape(id).map_err(|e| anyhow!("regularizer: {e}"))?;
    if !is_fitted(Quantity::VertexPositions { shape }) {
        bail!("a regularizer of `{id}` has no effect unless `{id}.vertex_positions` is fitted");
    }
    Ok(Penalty::Mesh { shape, regularizer, weight: *weight })
}

fn optimizer(parameter: &ParameterConfig, group: &Group, scene: &Scene) -> anyhow::Result<Optimizer> {
    let ParameterConfig { rate, uniform, large_steps, redistance, ref refine, finish, beta1, beta2, .. } =
        *parameter;
    let mut adam = Adam::new(rate);
    (adam.beta1, adam.beta2, adam.uniform) = (beta1, beta2, uniform);
    let plain = Optimizer { clamp: parameter.clamp, ..adam.clone().into() };
    let steps_of_its_own = large_steps.is_some() || redistance || !refine.is_empty() || finish.is_some();
    if steps_of_its_own && group.members().any(|member| member != Member::from(group.quantity)) {
        let name = &parameter.name;
        bail!(
            "large_steps, redistance, refine and finish apply to whole parameters without tie, not to `{name}`"
        );
    }
    Ok(match group.quantity {
        Quantity::VertexPositions { shape } => {
            let mesh = &scene.description().shapes[shape].mesh;
            let large_steps = large_steps.map(|lambda| LargeSteps::new(mesh, lambda)).transpose()?;
            adam.uniform |= large_steps.is_some();
            Optimizer { large_steps, adam, ..plain }
        }
        Quantity::Sdf { implicit }
            if (large_steps.is_some() || redistance)
                && scene.description().implicits[implicit].surface.downcast::<Grid>().is_none() =>
        {
            let name = &parameter.name;
            bail!("large_steps and redistance apply to SDF grids only, and `{name}` is not one");
        }
        Quantity::Sdf { implicit }
            if finish.is_some()
                && scene.description().implicits[implicit].surface.downcast::<Baked>().is_none() =>
        {
            let name = &parameter.name;
            bail!(
                "finish applies to networks on grids (<shape type=\"sdfnetwork\">), and `{name}` is not one"
            );
        }
        _ if steps_of_its_own => {
            let smoothing = large_steps.unwrap_or(0.0);
            let grid = GridSteps { smoothing, redistance, refine: refine.clone(), finish };
            Optimizer { grid: Some(grid), ..plain }
        }
        _ => plain,
    })
}

fn parameters(config: &Config, scene: &Scene) -> anyhow::Result<Parameters> {
    let names: Vec<Vec<&str>> = config.parameters.iter().map(ParameterConfig::names).collect();
    let mut parameters = Parameters::tied(scene, &names)?;
    for (group, ParameterConfig { name, bounds, pivot, .. }) in config.parameters.iter().enumerate() {
        if let Some(pivot) = *pivot {
            let has_pivot = |q: Quantity| matches!(q, Quantity::Rotation { .. } | Quantity::Scale { .. });
            if !parameters.groups()[group].members().all(|member| has_pivot(member.quantity)) {
                bail!("a pivot applies to a rotation or scale, except of the camera, not to `{name}`");
            }
            parameters = parameters.with_pivot(group, DVec3::from_array(pivot));
        }
        let Some(bounds) = *bounds else { continue };
        match parameters.groups()[group].quantity {
            _ if parameters.groups()[group].turns() => bail!("`{name}`: a rotation has no bounds"),
            Quantity::Scale { .. } if bounds[0] <= 0.0 => {
                bail!("`{name}`: the bounds of a scale must be positive")
            }
            _ => parameters = parameters.with_bounds(group, bounds),
        }
    }
    Ok(parameters)
}

fn start(config: &Config, scene: &Scene, parameters: &Parameters) -> anyhow::Result<Vec<f64>> {
    let mut x = parameters.values(scene);
    for (group, ParameterConfig { name, start, .. }) in parameters.groups().iter().zip(&config.parameters) {
        let [low, high] = group.bounds;
        let range = group.range.clone();
        let start = start.as_deref().unwrap_or(&x[range.clone()]).to_vec();
        if start.len() != group.range.len() {
            let numbers = match group.range.len() {
                1 => "one number".to_owned(),
                n => format!("{n} numbers"),
            };
            bail!("`{name}` is {numbers}, but its start has {}", start.len());
        }
        if start.iter().any(|v| !v.is_finite()) {
            bail!("the start of `{name}` is not finite");
        }
        if let Some(outside) = start.iter().find(|v| **v < low || **v > high) {
            bail!("`{name}` starts at {outside}, outside its bounds {low} and {high}");
        }
        x[range].copy_from_slice(&start);
    }
    Ok(x)
}

fn fingerprint(files: &[PathBuf], configuration: &str) -> anyhow::Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(configuration.as_bytes());
    for file in files {
        let bytes = read_bytes(file).map_err(|e| anyhow!("cannot read {}: {e}", file.display()))?;
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(&bytes);
    }
    Ok(hasher.finalize())
}

/// The reverse mode of a method, with the seed of each step.
pub(super) fn reverse(
    estimator: Estimator,
) -> impl Fn(&Scene, &Image, &ActiveParameters, u64, &Progress) -> Result<Gradient, GradientError> {
    move |scene, adjoint, active, seed, progress| {
        estimator.with_seed(seed).reverse(scene, adjoint, active, progress)
    }
}

/// The method of all steps, and a text about it. A pilot chooses it from all views before the first step, so
/// a resumed run has the same one.
pub(super) fn chosen(config: &Config, fit: &Fit, scene: &mut Scene) -> anyhow::Result<(Estimator, String)> {
    let method = config.gradient.method()?;
    let estimator = MethodOptions::plain(method).estimator(config.gradient.spp, config.seed, None);
    if method != Method::Automatic {
        return Ok((estimator, String::new()));
    }
    let pilot = Pilot { samples: config.gradient.spp, seed: config.seed };
    let bar = Bar::new(fit.surveyed(), "pilot");
    let choice = fit.choose(&pilot, scene, &silent(), || bar.step())?;
    Ok(method::chosen(estimator, |_| Ok(choice))?)
}

/// Warnings about a method without the boundary terms of fitted parameters. The silhouettes of the shape of
/// `[masks]` are fitted to the masks.
pub(super) fn missed(config: &Config, fit: &Fit, scene: &Scene) -> anyhow::Result<String> {
    let mut active = fit.parameters().active(scene);
    if let Some(masks) = &fit.objective().masks {
        active.implicits[masks.implicit] = false;
    }
    let moves = active.is_geometric() || active.moves_lights();
    Ok(if config.gradient.method()? == Method::Interior && moves { INTERIOR } else { "" }.to_owned())
}

/// Warnings about motions without a derivative, or whose discontinuities no field follows, for the initial
/// scene.
pub(super) fn contacts(fit: &Fit, scene: &Scene) -> String {
    let active = fit.parameters().active(scene);
    let implicit =
        active.is_geometric().then(|| contact::too_coarse(scene) + &contact::through_implicits(scene));
    contact::in_contact(scene, |shape| active.shapes[shape]) + &implicit.unwrap_or_default()
}

/// Samples per pixel used to find the parameters on which a view depends; the second number if the first
/// finds none.
const LOOK: [usize; 2] = [8, 64];

/// Warns about views that depend on no fitted parameter. A parameter on which no view depends is an error.
pub(super) fn check_views(config: &Config, fit: &Fit, scene: &mut Scene) -> anyhow::Result<()> {
    let views = &fit.objective().views;
    let groups = fit.parameters().groups();
    let bar = Bar::new(views.len(), "look at views");
    let method = match config.gradient.method()? {
        Method::Automatic => Method::WarpedArea,
        method => method,
    };
    let [few, many] = LOOK.map(|n| reverse(MethodOptions::plain(method).estimator(n, config.seed, None)));
    let mut seen = vec![false; groups.len()];
    for (v, view) in views.iter().enumerate() {
        let mut unseen = fit.unseen(scene, v, &few, &silent())?;
        if !unseen.is_empty() {
            unseen = fit.unseen(scene, v, &many, &silent())?;
        }
        (0..groups.len()).filter(|g| !unseen.contains(g)).for_each(|g| seen[g] = true);
        if unseen.len() == groups.len() {
            bar.say(&format!("WARNING: view `{}` does not depend on any fitted parameter", view.name));
        }
        bar.step();
    }
    if let Some(group) = seen.iter().position(|seen| !seen) {
        bail!(
            "`{}` changes no pixel of any view: neither it nor its light is visible, so it cannot be fitted",
            groups[group].name
        );
    }
    Ok(())
}
