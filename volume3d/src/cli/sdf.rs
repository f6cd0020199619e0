//! `volume3d sdf`.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::bail;
use clap::Args;
use indicatif::ProgressBar;
use volume3d::io::{load_mesh, write_sdf};
use volume3d::sdf::{Interpolation, MeshDistances, from_mesh};

use super::output::check_place;
use super::session::Threads;
use super::{Outcome, Report};

/// Makes a grid of signed distances from a triangle mesh.
///
/// A node's value is its distance to the mesh, negative inside. What is inside is decided by the winding number, which closes holes:
/// nodes of which it is not sure are counted, and a warning says so. A mesh whose triangles are turned both ways should be turned one
/// way before.
///
/// The file is a binary volume of Mitsuba 3 (.vol, float32), whose bounding box is in the mesh's own coordinates. Twice the
/// resolution takes eight times the time and memory: 64 a second, 128 a few.
#[derive(Args, Debug)]
pub(super) struct Options {
    /// The mesh: .obj or .ply.
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// The grid: .vol.
    #[arg(short, long, value_name = "GRID")]
    output: PathBuf,
    /// Cells along the longest side, 1 to 1600. A part thinner than two cells is lost.
    #[arg(long, value_name = "CELLS", default_value_t = 64)]
    resolution: usize,
    /// Empty space on all sides, as a part of the mesh's longest side.
    #[arg(long, value_name = "PART", default_value_t = 0.1, allow_negative_numbers = true)]
    margin: f64,
    #[command(flatten)]
    threads: Threads,
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let Options { mesh: path, output, resolution, margin, threads } = options;
    threads.begin()?;
    if output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("vol")) {
        bail!("{}: a grid is written as .vol", output.display());
    }
    check_place(output)?;
    let mesh = load_mesh(path)?;
    let spinner = ProgressBar::new_spinner();
    spinner.set_message(format!("distances to {} triangles", mesh.triangles().len()));
    spinner.enable_steady_tick(Duration::from_millis(200));
    let start = Instant::now();
    let found = from_mesh(&mesh, Interpolation::Cubic, *resolution, *margin);
    spinner.finish_and_clear();
    let MeshDistances { grid, doubtful } = match found {
        Ok(found) => found,
        Err(error) => bail!("{}: {error}", path.display()),
    };
    write_sdf(output, &grid)?;
    let ([nx, ny, nz], count) = (grid.size(), grid.nodes().len());
    let mut text = format!(
        "{nx} × {ny} × {nz} nodes, {:.6} apart, in {:.1} s\n",
        grid.spacing().x,
        start.elapsed().as_secs_f64()
    );
    if doubtful > 0 {
        text += &format!(
            "WARNING: {doubtful} of {count} nodes are doubtful: the mesh is open there, or its triangles are turned both \
             ways; look at the surface near them, or mend the mesh\n"
        );
    }
    text += &format!("wrote {}\n", output.display());
    Ok(Report { text, outcome: Outcome::Good })
}
