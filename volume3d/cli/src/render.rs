//! `volume3d render`.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use volume3d::gradient::render;

use super::output::{Output, Pixels, Written, check_distinct};
use super::report::Report;
use super::session::{Bar, RunOptions, SceneOptions, located, lost_with_picture};
use super::signals;
use super::spp::{check_error_exists, samples};
use super::summary::totals;

/// Renders a scene.
///
/// Pixels are linear RGB radiance. The extension of an output file sets its format: .exr and .npy (float32,
/// height × width × 3) have the unchanged values; .png is sRGB, clamped to [0, 1], without exposure or tone
/// curve.
///
/// The samples are independent of those of `volume3d gradient` with the same --seed, so an adjoint may be
/// computed from this image.
///
/// Example: volume3d render scene.xml -o image.exr --stderr error.exr --spp 1024 -D width=640
#[derive(Args, Debug)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    /// The image: .exr, .npy or .png.
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// A picture of the image, in addition.
    #[arg(long, value_name = "OUT.png")]
    png: Option<PathBuf>,
    /// The standard error of each pixel, from 8 independent groups of samples (fewer if there are fewer
    /// samples). Errors of pixels are correlated, so they do not give the error of a sum of pixels; that of
    /// the whole image is printed.
    #[arg(long = "stderr", value_name = "ERR.exr")]
    standard_error: Option<PathBuf>,
    /// Samples per pixel [default: sample_count of the scene].
    #[arg(long, value_name = "N", value_parser = samples)]
    spp: Option<usize>,
    #[command(flatten)]
    run: RunOptions,
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let mut outputs = vec![Output::new(&options.output, Pixels::Radiance)?];
    if let Some(path) = &options.png {
        outputs.push(Output::picture(path, Pixels::Radiance)?);
    }
    let error = options.standard_error.as_ref().map(|p| Output::new(p, Pixels::Radiance)).transpose()?;
    let paths: Vec<_> = outputs.iter().chain(&error).map(Output::path).collect();
    check_distinct(&paths, &[options.scene.path().to_path_buf()])?;

    options.run.begin()?;
    let loaded = options.scene.load()?;
    check_distinct(&paths, &loaded.files)?;
    let samples = options.spp.unwrap_or(loaded.scene.description().samples);
    check_error_exists(options.standard_error.as_ref(), samples)?;

    let start = Instant::now();
    let rendering = render(&loaded.scene, samples, options.run.seed, &Bar::new(0, "render").progress())?;
    let seconds = start.elapsed().as_secs_f64();
    signals::hold()?;

    let (width, height) = rendering.image.size();
    let mut text = format!("{width} × {height} pixels, {samples} spp, {seconds:.2} s\n");
    text += &located(&rendering.non_finite);
    let lost_rays = rendering.lost_rays.as_ref();
    text += &lost_with_picture(rendering.traces, lost_rays, samples * width * height, &options.output)?;
    text += &totals(&rendering.regions);
    let mut written = Written::after(text).noting(&loaded.deviations);
    for output in &outputs {
        output.write(&rendering.image, &mut written)?;
    }
    if let Some(output) = &error {
        output.write(&rendering.standard_error, &mut written)?;
    }
    Ok(written.report())
}
