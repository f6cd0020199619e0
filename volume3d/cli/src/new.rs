//! `volume3d new`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use clap::{Args, ValueEnum};
use glam::DVec3;
use volume3d::geometry::Mesh;
use volume3d::io::{load_mesh_with_notes, parse_serialized, read_bytes, write_bytes};

use super::file_kind::{Kind, in_shell};
use super::output::check_place;
use super::report::{Outcome, Report};
use super::session::Loaded;
use super::stage::{Stage, Up};

/// Writes a scene around a mesh, and a fit of its pose.
///
/// The scene (scene.xml) has a camera that sees the whole mesh, a ground, a lamp and a sky, in the units of
/// the mesh. A mesh far from the origin, or with a radius above 10⁴ or below 10⁻⁴, is moved to the origin,
/// and scaled in the latter case, by its to_world. The fit (fit.toml) recovers the pose of the mesh from a
/// picture rendered from the scene.
///
/// Example: volume3d new bunny.obj && volume3d render bunny/scene.xml -o bunny/image.png
#[derive(Args, Debug)]
pub(super) struct Options {
    /// The mesh: .obj or .ply, optionally gzipped, or .serialized.
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// The folder for scene.xml and fit.toml, created if necessary [default: the name of the mesh].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// The axis of the mesh that points upwards.
    #[arg(long, value_name = "AXIS", value_enum, default_value_t = UpAxis::Y)]
    up: UpAxis,
    /// Replaces existing files scene.xml and fit.toml.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum UpAxis {
    Y,
    Z,
}

impl From<UpAxis> for Up {
    fn from(axis: UpAxis) -> Self {
        match axis {
            UpAxis::Y => Self::Y,
            UpAxis::Z => Self::Z,
        }
    }
}

/// Ids that the scene uses for other objects.
const TAKEN: [&str; 7] = ["camera", "ground", "lamp", "sky", "clay", "all", "lights"];

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let path = &options.mesh;
    let (mesh, plugin, notes) = read(path)?;
    let stem = stem(path);
    let folder = options.output.clone().unwrap_or_else(|| PathBuf::from(&stem));
    let [scene, fit] = ["scene.xml", "fit.toml"].map(|name| folder.join(name));
    if let Some(there) = [&scene, &fit].into_iter().find(|path| path.exists() && !options.force) {
        bail!("{} exists: --force replaces it, and -o names another folder", there.display());
    }
    let (low, high) = bounds(&mesh).map_err(|problem| anyhow!("{}: {problem}", path.display()))?;
    std::fs::create_dir_all(&folder)
        .map_err(|e| anyhow!("cannot create the folder {}: {e}", folder.display()))?;
    [&scene, &fit].into_iter().try_for_each(|path| check_place(path))?;
    let id = id(&stem);
    let stage = Stage::new(&id, plugin, &relative(&folder, path)?, (low, high), options.up.into());
    write_bytes(&scene, stage.scene().as_bytes())?;
    write_bytes(&fit, stage.fit(&in_shell(&fit), &in_shell(&folder.join("run"))).as_bytes())?;
    // Reads the scene, so that problems of the mesh show now.
    let loaded = Loaded::read(&scene, &[])?;
    let mut text = String::new();
    let (extent, triangles) = (high - low, mesh.triangles().len());
    let _ = writeln!(
        text,
        "{}: {triangles} triangles, {:.4} × {:.4} × {:.4} units, named `{id}`",
        path.display(),
        extent.x,
        extent.y,
        extent.z
    );
    notes.iter().for_each(|note| text += &format!("note: {}: {note}\n", path.display()));
    text += &stage.moved().map(|moved| format!("note: {moved}\n")).unwrap_or_default();
    loaded.deviations.iter().for_each(|note| text += &format!("note: {note}\n"));
    let _ = writeln!(text, "wrote {} and {}; try:", scene.display(), fit.display());
    let [scene, fit, image, gradient, run] =
        [scene, fit, folder.join("image.png"), folder.join("gradient.png"), folder.join("run")]
            .map(|path| in_shell(&path));
    let exr = in_shell(&folder.join("gradient.exr"));
    let _ = writeln!(text, "  volume3d render {scene} -o {image} --spp 64");
    let _ = writeln!(
        text,
        "  volume3d gradient {scene} --move {id}:translate:{} -o {exr} --png {gradient} --spp 16",
        stage.motion()
    );
    let _ = writeln!(text, "  volume3d fit {fit} -o {run}");
    Ok(Report { text, outcome: Outcome::Good })
}

/// The mesh, the plugin that reads it, and notes of the reader.
fn read(path: &Path) -> anyhow::Result<(Mesh, &'static str, Vec<String>)> {
    let shown = path.display();
    if path.is_dir() {
        bail!("{shown} is a folder; name a mesh in it");
    }
    let bytes = read_bytes(path).with_context(|| format!("cannot read {shown}"));
    let bytes = bytes.map_err(|e| anyhow!("{e:#}"))?;
    match Kind::of(path, &bytes) {
        Kind::Mesh | Kind::Unknown | Kind::Empty => {}
        Kind::Scene => bail!("{shown} is already a scene: `volume3d render {} -o image.png`", in_shell(path)),
        Kind::ForeignMesh => bail!("{shown} is a mesh in an unsupported format: save it as OBJ or PLY"),
        _ => bail!("{shown} is not a mesh; supported formats: .obj, .ply, .serialized"),
    }
    let name = path.to_string_lossy().to_ascii_lowercase();
    if name.ends_with(".serialized") {
        return Ok((parse_serialized(&bytes, path, 0)?, "serialized", vec![]));
    }
    drop(bytes);
    let (mesh, notes) = load_mesh_with_notes(path)?;
    let is_ply = name.strip_suffix(".gz").unwrap_or(&name).ends_with(".ply");
    Ok((mesh, if is_ply { "ply" } else { "obj" }, notes))
}

/// The bounding box of all triangles.
fn bounds(mesh: &Mesh) -> Result<(DVec3, DVec3), &'static str> {
    let corners = mesh.triangles().as_flattened().iter().map(|&i| mesh.positions()[i as usize]);
    let all = DVec3::splat(f64::INFINITY);
    let (low, high) = corners.fold((all, -all), |(low, high), p| (low.min(p), high.max(p)));
    let diagonal = (high - low).length();
    if mesh.triangles().is_empty() {
        Err("the mesh has no triangles")
    } else if diagonal == 0.0 {
        Err("all triangles of the mesh are at one point")
    } else if !diagonal.is_finite() {
        Err("the size of the mesh exceeds the range of numbers")
    } else {
        Ok((low, high))
    }
}

/// A file name without its extensions.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let lower = name.to_ascii_lowercase();
    let cut = [".gz", ".obj", ".ply", ".serialized"]
        .into_iter()
        .fold(lower.as_str(), |left, ending| left.strip_suffix(ending).unwrap_or(left));
    match &name[..cut.len()] {
        "" => "mesh".to_owned(),
        stem => stem.to_owned(),
    }
}

/// An id for the shape that is plain on command lines: letters, digits, `-` and `_`.
fn id(stem: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let id: String = stem.chars().map(plain).collect();
    if TAKEN.contains(&id.as_str()) || id.starts_with('-') { format!("mesh_{id}") } else { id }
}

/// The path of a file relative to the folder of a scene.
fn relative(folder: &Path, file: &Path) -> anyhow::Result<String> {
    let whole = |path: &Path| {
        // An empty path is the current folder.
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().map_err(|e| anyhow!("cannot find {}: {e}", path.display()))
    };
    let (folder, file) = (whole(folder)?, whole(file)?);
    let [from, to]: [Vec<_>; 2] = [&folder, &file].map(|path| path.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let path: PathBuf = if common == 0 {
        file.clone()
    } else {
        let up = from[common..].iter().map(|_| std::path::Component::ParentDir);
        up.chain(to[common..].iter().copied()).collect()
    };
    let text =
        path.to_str().ok_or_else(|| anyhow!("{}: the name is not UTF-8; rename the file", file.display()))?;
    Ok(text.replace('\\', "/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_become_ids() {
        for (file, stem_, id_) in [
            ("bunny.obj", "bunny", "bunny"),
            ("a/b c.v2.PLY.gz", "b c.v2", "b_c_v2"),
            ("camera.ply", "camera", "mesh_camera"),
            (".obj", "mesh", "mesh"),
            ("-x.obj", "-x", "mesh_-x"),
        ] {
            assert_eq!((stem(Path::new(file)).as_str(), id(&stem(Path::new(file))).as_str()), (stem_, id_));
        }
    }
}
