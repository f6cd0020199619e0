//! `volume3d sdf`.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{anyhow, bail};
use clap::Args;
use glam::DVec3;
use indicatif::ProgressBar;
use volume3d::io::{load_mesh_with_notes, read_sdf, write_obj, write_ply, write_sdf};
use volume3d::sdf::{Interpolation, MeshDistances, from_mesh, isosurface};

use super::output::check_place;
use super::report::{Outcome, Report};
use super::session::Threads;
use super::signals;

/// Converts a triangle mesh to a grid of signed distances, or such a grid to a mesh.
///
/// Mesh to grid: the value of a node is its distance to the mesh, negative inside. The inside is where the
/// winding number says so, which closes holes; a warning counts the nodes where it is ambiguous. Orient the
/// triangles consistently first.
///
/// Grid to mesh: the mesh is the zero level set of the trilinear interpolant, closed and flat shaded.
///
/// Grids are binary volumes of Mitsuba 3 (.vol, float32). The bounding box is in the coordinates of the mesh.
/// Twice the resolution takes eight times the time and memory; 64 takes a second, 128 a few.
#[derive(Args, Debug)]
pub(super) struct Options {
    /// A mesh (.obj, .ply) or a grid (.vol).
    #[arg(value_name = "INPUT")]
    input: PathBuf,
    /// The grid (.vol) of a mesh, or the mesh (.obj, .ply) of a grid.
    #[arg(short, long, value_name = "OUTPUT")]
    output: PathBuf,
    /// Cells along the longest side: 1 to 1600 for a grid, 1 to 1024 for a mesh [default: 64 for a grid; the
    /// resolution of the grid for a mesh]. Parts thinner than two cells are lost; a warning states their
    /// share of the mesh's area.
    #[arg(long, value_name = "CELLS")]
    resolution: Option<usize>,
    /// Empty space on each side of a mesh, relative to its longest side [default: 0.1].
    #[arg(long, value_name = "PART", allow_negative_numbers = true)]
    margin: Option<f64>,
    #[command(flatten)]
    threads: Threads,
}

/// Default resolution and margin of a grid.
const DEFAULTS: (usize, f64) = (64, 0.1);

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let Options { input, output, threads, .. } = options;
    threads.begin()?;
    let kind =
        |path: &Path| path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let is_grid = |path: &Path| kind(path) == "vol";
    match (is_grid(input), is_grid(output)) {
        (true, true) => bail!("{} and {} are both grids", input.display(), output.display()),
        (false, false) => bail!("{}: a grid is written as .vol", output.display()),
        (true, false) if !["obj", "ply"].contains(&kind(output).as_str()) => {
            bail!("{}: a mesh is written as .obj or .ply", output.display())
        }
        (true, false) if options.margin.is_some() => bail!("--margin applies to grids only"),
        _ => {}
    }
    check_place(output)?;
    let start = Instant::now();
    let mut text = if is_grid(output) { to_grid(options)? } else { to_mesh(options)? };
    text += &format!("wrote {} in {:.1} s\n", output.display(), start.elapsed().as_secs_f64());
    Ok(Report { text, outcome: Outcome::Good })
}

fn to_grid(options: &Options) -> anyhow::Result<String> {
    let (resolution, margin) = DEFAULTS;
    let (resolution, margin) = (options.resolution.unwrap_or(resolution), options.margin.unwrap_or(margin));
    let path = &options.input;
    let (mesh, notes) = load_mesh_with_notes(path)?;
    let spinner = spinner(format!("distances to {} triangles", mesh.triangles().len()));
    let found = from_mesh(&mesh, Interpolation::Cubic, resolution, margin);
    spinner.finish_and_clear();
    let MeshDistances { grid, doubtful, lost } =
        found.map_err(|error| anyhow!("{}: {error}", path.display()))?;
    signals::hold()?;
    write_sdf(&options.output, &grid)?;
    let ([nx, ny, nz], count) = (grid.size(), grid.nodes().len());
    let mut text = format!("{nx} × {ny} × {nz} nodes, {:.6} apart\n", grid.spacing().x);
    for note in notes {
        text += &format!("note: {}: {note}\n", path.display());
    }
    if lost > 0.0 {
        text += &format!(
            "WARNING: {:.3} % of the mesh's area has no surface in the grid: parts or gaps there are thinner than two \
             cells, {:.3e}; raise --resolution, or make them thicker\n",
            100.0 * lost,
            2.0 * grid.spacing().max_element()
        );
    }
    let (low, high) = bounds(&mesh);
    let (extent, wanted) = (grid.high() - grid.low(), (high - low).max_element() * (1.0 + 2.0 * margin));
    if extent.max_element() > 1.1 * wanted {
        text += &format!(
            "WARNING: so far from the origin, rounding to single precision makes the bounding box {:.2} times as long as \
             requested, and the cells too; move the mesh towards the origin\n",
            extent.max_element() / wanted
        );
    }
    if doubtful > 0 {
        text += &format!(
            "WARNING: {doubtful} of {count} nodes have an ambiguous sign: the mesh is open there, or its triangles are not \
             oriented consistently; inspect the surface there, or repair the mesh\n"
        );
    }
    Ok(text)
}

fn bounds(mesh: &volume3d::geometry::Mesh) -> (DVec3, DVec3) {
    let all = DVec3::splat(f64::INFINITY);
    mesh.positions().iter().fold((all, -all), |(low, high), p| (low.min(*p), high.max(*p)))
}

fn to_mesh(options: &Options) -> anyhow::Result<String> {
    let (path, output) = (&options.input, &options.output);
    let grid = read_sdf(path, Interpolation::Trilinear)?;
    let extent = grid.high() - grid.low();
    let own = (extent.max_element() / grid.spacing().min_element()).round() as usize;
    let spinner = spinner(format!("the surface of {} nodes", grid.nodes().len()));
    let found = isosurface(&grid, (grid.low(), grid.high()), options.resolution.unwrap_or(own));
    spinner.finish_and_clear();
    let mesh = found.map_err(|error| anyhow!("{}: {error}", path.display()))?;
    signals::hold()?;
    if output.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
        write_ply(output, &mesh)?;
    } else {
        write_obj(output, &mesh)?;
    }
    Ok(format!("{} vertices, {} triangles\n", mesh.positions().len(), mesh.triangles().len()))
}

fn spinner(message: String) -> ProgressBar {
    let spinner = ProgressBar::new_spinner();
    spinner.set_message(message);
    spinner.enable_steady_tick(Duration::from_millis(200));
    spinner
}
