//! `volume3d gradient`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use clap::error::ErrorKind;
use volume3d::Image;
use volume3d::gradient::{self, FiniteDifference, Regions, Survey, Tangent};

use super::budget::{Budget, Pilot, percent};
use super::method::{MethodOptions, chosen};
use super::missing::left_out;
use super::movement::{Moves, change};
use super::one_sided::one_sided;
use super::output::{Output, Pixels, Written, check_distinct};
use super::parameter::Name;
use super::report::{Report, usage};
use super::session::{
    Bar, Clock, RunOptions, SceneOptions, check_size, geometric, located, lost_with_picture,
};
use super::signals;
use super::spp::check_error_exists;
use super::summary::{INTERIOR, NOTHING_SEEN, outlier, root_mean_square, totals};
use super::{contact, reverse};

/// Differentiates an image along a change (--move), or a loss with respect to parameters (--adjoint, --wrt).
///
/// Forward mode: the image dI/dθ, in linear RGB per unit of θ; all --move depend on the same θ.
///
/// Reverse mode: the derivatives ∂L/∂p = Σ ∂L/∂I · ∂I/∂p of a loss L of the image I, summed over pixels and
/// channels, for every parameter p given by --wrt, from one run. --adjoint is the image ∂L/∂I.
///
/// By default a pilot run with few samples chooses between two unbiased methods and splits the samples
/// between their parts; a line says what it chose (see --method). With --method warped-area, the field is
/// always the exact mean, and --spp is the number of its samples.
///
/// With the same --seed, --spp and --method, forward and reverse mode are transposes of each other up to
/// rounding (for edge sampling if all shapes of --wrt move; not with a pilot, which chooses for each).
///
/// Refused: moving shapes or a moving camera in a scene with a bump or normal map or under a light whose beam
/// ends abruptly. --method finite-difference supports such scenes. Edge sampling also refuses ideal mirrors,
/// glass, masks and lights without extent; --allow-missing uses it, leaves out these discontinuities and says
/// so.
///
/// A WARNING says that one sample carries at least 2% of the sum of |gradient| (over pixels; in reverse mode
/// over positions) and at least 256 times its share. Then the distribution has heavy tails, as in penumbrae
/// of small lights, and standard errors are more often too small than not.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
    /// Reverse mode: the image ∂L/∂I as .exr or .npy (height × width × 3), in the size of the film.
    #[arg(long, value_name = "ADJ.exr", requires = "parameters", conflicts_with_all = ["moves", "png", "standard_error", "block_errors", "image", "terms"])]
    adjoint: Option<PathBuf>,
    /// Reverse mode: a parameter. May be repeated; then -o is a folder.
    ///
    ///   parameter                shape of its array
    ///   SHAPE.vertex_positions   (vertices of its file, 3); see below
    ///   SHAPE.sdf                (parameters), implicit surfaces
    ///   THING.translation        (3)
    ///   THING.rotation           (3), radians about the world's axes, through the mean of the
    ///                            vertices or the position of a light or implicit surface
    ///   THING.scale              number, relative to the mean of the vertices
    ///   SHAPE.radiance           (3)
    ///   SHAPE.radiance_texture   (height, width, 3), texture of the emitted radiance
    ///   LIGHT.radiance           (3), constant environment
    ///   LIGHT.intensity          (3), point light
    ///   LIGHT.irradiance         (3), directional light
    ///   LIGHT.texture            (height, width, 3), environment map, spot or projector
    ///   MATERIAL.reflectance     (3)
    ///   MATERIAL.roughness       number
    ///   MATERIAL.texture         (height, width, 3), linear; the sum over all materials that
    ///                            share the texture
    ///   MATERIAL.roughness_texture, MATERIAL.metallic_texture
    ///                            (height, width, 3); the renderer uses the luminance
    ///   camera.translation       (3), of the origin
    ///   camera.rotation          (3), radians about the world's axes, through the origin or the
    ///                            centre of an orthographic sensor
    ///   camera.fov               number, per radian, horizontal; not for orthographic sensors
    ///
    /// THING is a shape, instance or group of shapes; an implicit surface; a point light, spot,
    /// projector, directional light or environment map, as far as it can move; `all`, which is
    /// all geometry; or `lights`, which is all emitters.
    /// A component of a vector or colour is a parameter, too: SHAPE.translation.x,
    /// SHAPE.vertex_positions.y, SHAPE.radiance.r.
    /// Vertices of a file that share a position move together; each has the full derivative
    /// with respect to that position, not a share of it.
    #[arg(long = "wrt", value_name = "WHAT.PARAMETER", requires = "adjoint", verbatim_doc_comment)]
    parameters: Vec<Name>,
    /// The gradient. Forward mode: an image (.exr, .npy or .png). Reverse mode: an array (.npy, float64), or
    /// an existing folder, which gets a file WHAT.PARAMETER.npy for every --wrt.
    #[arg(short, long, value_name = "GRAD.exr")]
    output: PathBuf,
    /// The standard error of each pixel of the gradient, from 8 independent groups of samples (fewer if there
    /// are fewer samples). Errors of pixels are correlated, so they do not give the error of a sum of pixels:
    /// that of the whole image is printed, and --stderr-blocks writes that of blocks.
    #[arg(long = "stderr", value_name = "ERR.exr")]
    standard_error: Option<PathBuf>,
    /// The standard error of the mean of each block of 8 × 8 pixels, as an image with one pixel per block.
    #[arg(long = "stderr-blocks", value_name = "ERR.exr")]
    block_errors: Option<PathBuf>,
    /// The rendered image, from the gradient's area samples. A pilot may leave few of these, and the image is
    /// noisy accordingly; with --method warped-area they are all of --spp, and the image does not depend on
    /// --move. Do not compute the adjoint of a reverse run with the same --seed from it, because their
    /// product would be biased: use the image of `volume3d render`.
    #[arg(long, value_name = "IMG.exr")]
    image: Option<PathBuf>,
    /// Writes the terms of the gradient separately: PREFIX_interior.exr (the interior term),
    /// PREFIX_primary.exr (discontinuities that move on the film) and PREFIX_secondary.exr (shadows,
    /// reflections).
    #[arg(long, value_name = "PREFIX")]
    terms: Option<String>,
    /// A picture of the gradient: the mean of the channels, blue negative, white zero, red positive. Each
    /// .exr of --terms and --stderr gets a .png of the same name, too.
    #[arg(long, value_name = "GRAD.png")]
    png: Option<PathBuf>,
    #[command(flatten)]
    method: MethodOptions,
    #[command(flatten)]
    budget: Budget,
    /// Finite differences: h in (I(θ + h) − I(θ − h))/2h [default: 0.001].
    #[arg(long, value_name = "H", value_parser = step, allow_negative_numbers = true)]
    step: Option<f64>,
    #[command(flatten)]
    run: RunOptions,
}

const EXAMPLES: &str = "\
Examples:
  volume3d gradient scene.xml --move box:translate:1,0,0 -o gradient.exr --png gradient.png
  volume3d gradient scene.xml --move camera:rotate:0,1,0 -o gradient.exr --terms part
  volume3d gradient scene.xml --adjoint adjoint.exr --wrt box.vertex_positions -o gradient.npy";

/// A step of finite differences.
pub(super) fn step(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|h: &f64| *h > 0.0 && h.is_finite());
    number.ok_or_else(|| "expected a positive, finite number".to_owned())
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    options.method.check("gradient", options.step.is_some())?;
    let error = |kind, text: &str| Err(usage("gradient", kind, text.to_owned()));
    match &options.adjoint {
        None if options.moves.moves.is_empty() => {
            error(ErrorKind::MissingRequiredArgument, "say what changes: --move, or --adjoint with --wrt")
        }
        None if options.terms.is_some() && options.method.is_finite_difference() => {
            error(ErrorKind::ArgumentConflict, "finite differences have no --terms")
        }
        None => forward(options),
        Some(_) if options.method.is_finite_difference() => {
            error(ErrorKind::ArgumentConflict, "finite differences have no reverse mode (--adjoint)")
        }
        Some(adjoint) => reverse::run(&reverse::Request {
            scene: &options.scene,
            run: &options.run,
            method: &options.method,
            adjoint,
            parameters: &options.parameters,
            output: &options.output,
            budget: &options.budget,
        }),
    }
}

/// The output files of forward mode; those that were not requested are empty.
struct Outputs {
    gradient: Vec<Output>,
    standard_error: Vec<Output>,
    block_errors: Option<Output>,
    image: Option<Output>,
    terms: Option<[Vec<Output>; 3]>,
}

impl Outputs {
    fn new(options: &Options) -> anyhow::Result<Self> {
        let mut gradient = vec![Output::new(&options.output, Pixels::Signed)?];
        if let Some(path) = &options.png {
            gradient.push(Output::picture(path, Pixels::Signed)?);
        }
        let with_picture = |path: &Path, pixels| -> anyhow::Result<_> {
            let mut outputs = vec![Output::new(path, pixels)?];
            if options.png.is_some() && path.extension().is_some_and(|e| e == "exr") {
                outputs.push(Output::picture(&path.with_extension("png"), pixels)?);
            }
            Ok(outputs)
        };
        let term =
            |prefix: &String, name| with_picture(Path::new(&format!("{prefix}_{name}.exr")), Pixels::Signed);
        let error = options.standard_error.as_ref();
        let terms = options.terms.as_ref().map(|prefix| -> anyhow::Result<_> {
            Ok([term(prefix, "interior")?, term(prefix, "primary")?, term(prefix, "secondary")?])
        });
        Ok(Self {
            gradient,
            standard_error: error.map_or(Ok(vec![]), |path| with_picture(path, Pixels::Radiance))?,
            block_errors: options
                .block_errors
                .as_ref()
                .map(|p| Output::new(p, Pixels::Radiance))
                .transpose()?,
            image: options.image.as_ref().map(|path| Output::new(path, Pixels::Radiance)).transpose()?,
            terms: terms.transpose()?,
        })
    }

    fn paths(&self) -> Vec<&Path> {
        let terms = self.terms.iter().flatten().flatten();
        let all = self
            .gradient
            .iter()
            .chain(&self.standard_error)
            .chain(&self.block_errors)
            .chain(&self.image)
            .chain(terms);
        all.map(Output::path).collect()
    }
}

fn forward(options: &Options) -> anyhow::Result<Report> {
    let outputs = Outputs::new(options)?;
    check_distinct(&outputs.paths(), &[options.scene.path().to_path_buf()])?;
    options.run.begin()?;
    let loaded = options.scene.load()?;
    check_distinct(&outputs.paths(), &loaded.files)?;
    let scene = &loaded.scene;
    check_size(options.scene.path(), scene.size())?;
    let change = change(scene, &options.moves.moves)?;
    let terms = outputs.terms.is_some();
    let survey = |pilot: &gradient::Pilot, clock: &_| {
        pilot.survey_along(scene, &change, &Bar::new(0, "pilot").timed(clock))
    };
    let run = |samples, seed, what, seen: Option<&Survey>| {
        let start = Instant::now();
        let estimator = options.method.estimator(samples, seed, options.step);
        let (estimator, words) =
            chosen(estimator, |pilot| match seen.filter(|seen| seen.is_that_of(pilot)) {
                Some(seen) => Ok(pilot.choice(seen)),
                None => Ok(pilot.choice(&survey(pilot, &Clock::default())?)),
            })?;
        let bar = Bar::new(0, what);
        let result = if terms {
            estimator.forward_terms(scene, &change, &bar.progress())?
        } else {
            estimator.forward(scene, &change, &bar.progress())?
        };
        signals::stop_if_asked()?;
        anyhow::Ok((result, start.elapsed().as_secs_f64(), words))
    };
    let seed = options.run.seed;
    let by_survey = if options.method.is_automatic() {
        options.budget.plan_by_survey(seed, |pilot, clock| Ok(survey(pilot, clock)?))?
    } else {
        None
    };
    let (plan, seen) = match by_survey {
        Some((plan, seen)) => (plan, Some(seen)),
        None => {
            let plan = options.budget.plan(scene, seed, |samples, seed| {
                let (result, seconds, _) = run(samples, seed, "pilot", None)?;
                Ok(Pilot::of_image(seconds, &result.gradient, &result.standard_error))
            })?;
            (plan, None)
        }
    };
    let samples = plan.samples;
    check_error_exists(options.standard_error.as_ref().or(options.block_errors.as_ref()), samples)?;

    let (result, seconds, chosen) = run(samples, seed, "gradient", seen.as_ref())?;
    signals::hold()?;

    let (width, height) = result.gradient.size();
    let mut text = plan.text + &chosen;
    text += &format!(
        "{width} × {height} pixels, {samples} spp, {} auxiliary rays, {seconds:.2} s\n\
         root mean square of the gradient {:.3e}, of its standard error {:.3e}\n",
        result.auxiliary_rays,
        root_mean_square(&result.gradient),
        root_mean_square(&result.standard_error),
    );
    if options.budget.is_open() {
        let reached = Pilot::of_image(seconds, &result.gradient, &result.standard_error).relative();
        text += &format!("its error is {} of the gradient\n", percent(reached));
    }
    text += &located(&result.non_finite);
    let (lost_rays, count) = (result.lost_rays.as_ref(), samples * width * height);
    text += &lost_with_picture(result.traces, lost_rays, count, &options.output)?;
    if change.is_geometric() {
        text += &geometric(&loaded.notes);
        text += &contact::too_coarse(scene);
    }
    text += &left_out(&result.left_out);
    let step = options.step.unwrap_or(FiniteDifference::default().step);
    text += &one_sided(result.one_sided.as_ref().map(|found| (step, found)));
    if options.method.is_interior() && (change.is_geometric() || change.moves_lights()) {
        text += INTERIOR;
    }
    if result.is_zero() && change != Tangent::still(scene) {
        text += NOTHING_SEEN;
    }
    text += &result.outlier().map(|largest| outlier(largest, result.largest_share())).unwrap_or_default();
    text += &contact::parted(scene, &change.positions);
    text += &contact::along_pixels_of(scene, &change);
    if change.is_geometric() && !options.method.is_finite_difference() {
        text += &contact::through_implicits(scene);
    }
    text += &totals(&result.regions);
    let mut written = Written::after(text).noting(&loaded.deviations);
    for output in &outputs.gradient {
        output.write_with_comments(&result.gradient, &left_out(&result.left_out), &mut written)?;
    }
    for output in &outputs.standard_error {
        output.write(&result.standard_error, &mut written)?;
    }
    if let Some(output) = &outputs.block_errors {
        let Regions { columns, rows, block_errors, .. } = result.regions;
        output.write(&Image { width: columns, height: rows, pixels: block_errors }, &mut written)?;
    }
    if let Some(output) = &outputs.image {
        output.write(&result.image, &mut written)?;
    }
    if let (Some(outputs), Some(terms)) = (&outputs.terms, &result.terms) {
        for (outputs, term) in outputs.iter().zip([&terms.interior, &terms.primary, &terms.secondary]) {
            for output in outputs {
                output.write(term, &mut written)?;
            }
        }
    }
    Ok(written.report())
}
