//! The configuration of a fit, read from TOML.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::ValueEnum;
use flatland::sdf::shapes::Ball;
use glam::DVec3;
use serde::Deserialize;
use volume3d::optimize::{Loss, MaskLoss, Regularizer, Schedule};

use super::super::method::Method;
use super::super::spp::MAX_SAMPLES;
use super::numbers::numbers;
use super::parameter::ParameterConfig;

/// A configuration. Its keys are explained in `example.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Config {
    pub(super) scene: PathBuf,
    #[serde(default)]
    pub(super) define: BTreeMap<String, String>,
    pub(super) steps: u64,
    /// The number of starts, of which the best is kept.
    #[serde(default = "one")]
    pub(super) starts: usize,
    /// Notes about the scene that change images; not part of the file.
    #[serde(skip)]
    pub(super) deviations: Vec<String>,
    #[serde(default)]
    pub(super) seed: u64,
    #[serde(default)]
    pub(super) loss: LossKind,
    #[serde(default)]
    pub(super) gradient: GradientConfig,
    #[serde(default)]
    pub(super) schedule: Schedule,
    pub(super) parameter_mean: Option<f64>,
    pub(super) views_per_step: Option<usize>,
    pub(super) pixels_per_view: Option<usize>,
    pub(super) silhouettes: Option<usize>,
    #[serde(default, deserialize_with = "numbers")]
    pub(super) background: Option<[f64; 3]>,
    pub(super) reference: Option<Reference>,
    #[serde(default, rename = "view")]
    pub(super) views: Vec<ViewConfig>,
    #[serde(default, rename = "parameter")]
    pub(super) parameters: Vec<ParameterConfig>,
    #[serde(default, rename = "regularizer")]
    pub(super) regularizers: Vec<RegularizerConfig>,
    pub(super) masks: Option<MasksConfig>,
    pub(super) dtu: Option<DtuConfig>,
    pub(super) photographs: Option<PhotographsConfig>,
}

/// Views from files of other programs.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PhotographsConfig {
    /// `transforms.json`, or the folder of a COLMAP model.
    pub(super) cameras: PathBuf,
    /// The pictures of a COLMAP model.
    pub(super) images: Option<PathBuf>,
    /// Columns and rows.
    pub(super) size: Option<[usize; 2]>,
    pub(super) views: Option<Vec<usize>>,
}

/// Views from a folder in the layout of the DTU data set.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DtuConfig {
    pub(super) folder: PathBuf,
    pub(super) views: Option<Vec<usize>>,
    #[serde(default)]
    pub(super) cut: bool,
}

/// The loss of the views' masks.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MasksConfig {
    pub(super) shape: String,
    #[serde(default, deserialize_with = "numbers")]
    center: Option<[f64; 3]>,
    #[serde(default = "unit")]
    radius: f64,
    weight: Option<f64>,
    alpha: Option<f64>,
    samples: Option<usize>,
}

fn one() -> usize {
    1
}

fn unit() -> f64 {
    1.0
}

impl MasksConfig {
    pub(super) fn loss(&self) -> anyhow::Result<MaskLoss> {
        let usual =
            MaskLoss::new(Ball::new(DVec3::from_array(self.center.unwrap_or_default()), self.radius)?);
        let loss = MaskLoss {
            weight: self.weight.unwrap_or(usual.weight),
            alpha: self.alpha.unwrap_or(usual.alpha),
            samples: self.samples.unwrap_or(usual.samples),
            ..usual
        };
        loss.check()?;
        Ok(loss)
    }
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum LossKind {
    L2 {},
    L1 {},
    Relative {
        #[serde(default = "epsilon")]
        epsilon: f64,
    },
    Multiscale {
        #[serde(default = "levels")]
        levels: usize,
    },
}

fn epsilon() -> f64 {
    0.01
}

fn levels() -> usize {
    5
}

impl Default for LossKind {
    fn default() -> Self {
        Self::Multiscale { levels: levels() }
    }
}

impl From<LossKind> for Loss {
    fn from(kind: LossKind) -> Self {
        match kind {
            LossKind::L2 {} => Self::L2,
            LossKind::L1 {} => Self::L1,
            LossKind::Relative { epsilon } => Self::Relative { epsilon },
            LossKind::Multiscale { levels } => Self::Multiscale { levels },
        }
    }
}

/// The estimator of gradients.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct GradientConfig {
    method: String,
    pub(super) spp: usize,
    pub(super) image_spp: Option<usize>,
}

impl Default for GradientConfig {
    fn default() -> Self {
        Self { method: "auto".to_owned(), spp: 16, image_spp: None }
    }
}

impl GradientConfig {
    pub(super) fn method_name(&self) -> &str {
        &self.method
    }

    pub(super) fn method(&self) -> anyhow::Result<Method> {
        let known: Vec<&Method> =
            Method::value_variants().iter().filter(|m| **m != Method::FiniteDifference).collect();
        let name = |m: &Method| m.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
        known.iter().find(|m| name(m) == self.method).map(|m| **m).ok_or_else(|| {
            let names: Vec<String> = known.iter().map(|m| name(m)).collect();
            anyhow!("gradient.method is `{}`, but must be one of {}", self.method, names.join(", "))
        })
    }
}

/// A scene from which targets are rendered.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reference {
    pub(super) scene: PathBuf,
    #[serde(default)]
    pub(super) define: BTreeMap<String, String>,
    #[serde(default = "reference_spp")]
    pub(super) spp: usize,
}

fn reference_spp() -> usize {
    1024
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum EncodingConfig {
    Srgb,
    Linear,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ViewConfig {
    pub(super) name: Option<String>,
    pub(super) target: Option<PathBuf>,
    /// The transfer function of the target's integers, unless it is that of the file.
    pub(super) encoding: Option<EncodingConfig>,
    /// A layer of an OpenEXR target, or the full name of one of its channels.
    pub(super) layer: Option<String>,
    pub(super) weights: Option<PathBuf>,
    pub(super) mask: Option<PathBuf>,
    #[serde(deserialize_with = "numbers")]
    pub(super) origin: Option<[f64; 3]>,
    #[serde(deserialize_with = "numbers")]
    pub(super) look_at: Option<[f64; 3]>,
    #[serde(deserialize_with = "numbers")]
    pub(super) up: Option<[f64; 3]>,
    pub(super) fov: Option<f64>,
    pub(super) width: Option<usize>,
    pub(super) height: Option<usize>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RegularizerConfig {
    pub(super) shape: String,
    kind: RegularizerKind,
    pub(super) weight: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RegularizerKind {
    Laplacian,
    EdgeLength,
    NormalConsistency,
    Eikonal,
}

impl RegularizerConfig {
    /// The regularizer of a mesh; nothing if it is for networks.
    pub(super) fn regularizer(&self) -> Option<Regularizer> {
        match self.kind {
            RegularizerKind::Laplacian => Some(Regularizer::Laplacian),
            RegularizerKind::EdgeLength => Some(Regularizer::EdgeLength),
            RegularizerKind::NormalConsistency => Some(Regularizer::NormalConsistency),
            RegularizerKind::Eikonal => None,
        }
    }
}

/// The values of a scene's $names, in the form that its reader takes.
pub(super) fn definitions(define: &BTreeMap<String, String>) -> Vec<(String, String)> {
    define.iter().map(|(name, value)| (name.clone(), value.clone())).collect()
}

/// A configuration without `steps`, comments and order, for comparisons; unchanged if it is not TOML.
pub(super) fn apart_from_steps(text: &str) -> String {
    let table = toml::from_str::<toml::Table>(text).ok();
    let rest = table.map(|mut table| {
        table.remove("steps");
        table
    });
    rest.map_or_else(|| text.to_owned(), |rest| rest.to_string())
}

/// The largest number of starts.
const MOST_STARTS: usize = 64;

impl Config {
    /// Refuses values out of range and keys that exclude one another.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        if self.steps == 0 {
            bail!("steps = 0: a fit needs at least one step");
        }
        if self.parameters.is_empty() {
            bail!(
                "there are no parameters to fit: add a line [[parameter]], and below it name = \"bunny.translation\" and \
                 rate = 0.02 (`volume3d info SCENE` lists names)"
            );
        }
        self.parameters.iter().try_for_each(|parameter| parameter.check(self.steps))?;
        if !(1..=MOST_STARTS).contains(&self.starts) {
            bail!("starts = {}, but must be from 1 to {MOST_STARTS}; 8 is usual", self.starts);
        }
        let changes = self.parameters.iter().find(|p| !p.refine.is_empty() || p.finish.is_some());
        if let (Some(parameter), true) = (changes, self.starts > 1) {
            bail!(
                "starts = {} excludes refine and finish: leave out those of `{}`, or starts",
                self.starts,
                parameter.name
            );
        }
        if let Some(pixels) = self.pixels_per_view {
            if pixels == 0 {
                bail!("pixels_per_view = 0: a step needs at least one pixel");
            }
            if matches!(self.loss, LossKind::Multiscale { levels } if levels > 1) {
                bail!(
                    "pixels_per_view excludes a multiscale loss, which compares blocks of pixels: take loss = {{ kind = \
                     \"l2\" }} or l1"
                );
            }
        }
        let of_reference = self.reference.as_ref().map_or(1, |r| r.spp);
        let of_image = self.gradient.image_spp.unwrap_or(1);
        for (key, samples) in [
            ("gradient.spp", self.gradient.spp),
            ("gradient.image_spp", of_image),
            ("reference.spp", of_reference),
        ] {
            if !(1..=MAX_SAMPLES).contains(&samples) {
                bail!("{key} is {samples}, but must be from 1 to {MAX_SAMPLES} samples per pixel");
            }
        }
        self.gradient.method()?;
        if let Some(problem) = self.schedule.problem() {
            bail!("{problem}");
        }
        if let Some(mean) = self.parameter_mean.filter(|mean| !(0.0..1.0).contains(mean)) {
            bail!("parameter_mean is {mean}, but must be from 0 to below 1; 0.95 is usual");
        }
        if let LossKind::Relative { epsilon } = self.loss
            && !(epsilon > 0.0 && epsilon.is_finite())
        {
            bail!("the epsilon of a relative loss is {epsilon}, but must be positive; 0.01 is usual");
        }
        if let LossKind::Multiscale { levels: 0 } = self.loss {
            bail!("a multiscale loss needs at least one level, not 0");
        }
        if self.views_per_step == Some(0) {
            bail!("views_per_step = 0: a step needs at least one view");
        }
        if let Some((table, key, path)) = self.photographed() {
            if !self.views.is_empty() || self.reference.is_some() {
                bail!(
                    "[{table}] excludes [[view]] and [reference]: the views are those of its {key} = \"{}\"",
                    path.display()
                );
            }
            if self.dtu.is_some() && self.photographs.is_some() {
                bail!("[dtu] excludes [photographs]: only one of them can name the views");
            }
        } else if self.views.is_empty() && self.reference.is_none() {
            bail!(
                "there are no targets: add a [[view]] with a target = \"PICTURE\", or a [reference] with a scene to render"
            );
        }
        for (i, view) in self.views.iter().enumerate() {
            if view.target.is_none() && self.reference.is_none() {
                bail!("view {} has no target, and there is no [reference] to render one from", i + 1);
            }
            if view.origin.is_none() && (view.look_at.is_some() || view.up.is_some()) {
                bail!(
                    "view {} has look_at or up, but no origin: add the position of its camera, as origin = [0, 1, 4]",
                    i + 1
                );
            }
        }
        let with_mask = self.views.iter().position(|view| view.mask.is_some());
        match (&self.masks, with_mask) {
            (None, Some(view)) => {
                bail!(
                    "view {} has a mask, but there is no [masks] with the shape to which it belongs",
                    view + 1
                )
            }
            (Some(masks), None) if self.dtu.is_some() => {
                masks.loss().map(|_| ()).map_err(|e| anyhow!("[masks]: {e}"))?;
            }
            (Some(_), None) => bail!("[masks] needs views with a mask = \"PICTURE\""),
            (Some(masks), _) => masks.loss().map(|_| ()).map_err(|e| anyhow!("[masks]: {e}"))?,
            (None, None) => {}
        }
        for regularizer in &self.regularizers {
            let RegularizerConfig { shape, weight, .. } = regularizer;
            if !(*weight >= 0.0 && weight.is_finite()) {
                bail!("the weight of the regularizer of `{shape}` is {weight}, but must not be negative");
            }
        }
        Ok(())
    }

    /// The table, key and value that name the file or folder of all photographs, if there is one.
    fn photographed(&self) -> Option<(&'static str, &'static str, &Path)> {
        let dtu = self.dtu.as_ref().map(|dtu| ("dtu", "folder", dtu.folder.as_path()));
        dtu.or_else(|| self.photographs.as_ref().map(|p| ("photographs", "cameras", p.cameras.as_path())))
    }

    /// Whether all targets are photographs with cameras, none of which is a `[[view]]`.
    pub(super) fn is_photographed(&self) -> bool {
        self.photographed().is_some()
    }

    /// All paths of files and folders.
    pub(super) fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let views =
            self.views.iter_mut().flat_map(|v| v.target.iter_mut().chain(&mut v.weights).chain(&mut v.mask));
        let reference = self.reference.iter_mut().map(|r| &mut r.scene);
        let dtu = self.dtu.iter_mut().map(|dtu| &mut dtu.folder);
        let photographs = self.photographs.iter_mut();
        let photographs = photographs.flat_map(|p| std::iter::once(&mut p.cameras).chain(&mut p.images));
        std::iter::once(&mut self.scene).chain(views).chain(reference).chain(dtu).chain(photographs)
    }
}
