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

/// Writes a scene around a mesh, and a fit that runs.
///
/// The scene (scene.xml) has a camera that sees the whole mesh, a ground, a lamp and a sky, in the units of
/// the mesh; one far from the origin, or larger than 10⁴ or smaller than 10⁻⁴, is moved and scaled by its
/// to_world. The fit (fit.toml) finds the mesh's pose again in a picture that is rendered from the scene.
///
/// Example: volume3d new bunny.obj && volume3d render bunny/scene.xml -o bunny/image.png
#[derive(Args, Debug)]
pub(super) struct Options {
    /// The mesh: .obj or .ply, which may be gzipped, or .serialized.
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// The folder for scene.xml and fit.toml, which is made if there is none; unless given, one with the name
    /// of the mesh.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// The axis of the mesh that points upwards.
    #[arg(long, value_name = "AXIS", value_enum, default_value_t = UpAxis::Y)]
    up: UpAxis,
    /// Replaces scene.xml and fit.toml if they are there.
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

/// Names that a scene has already.
const TAKEN: [&str; 7] = ["camera", "ground", "lamp", "sky", "clay", "all", "lights"];

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let path = &options.mesh;
    let (mesh, plugin, notes) = read(path)?;
    let stem = stem(path);
    let folder = options.output.clone().unwrap_or_else(|| PathBuf::from(&stem));
    let [scene, fit] = ["scene.xml", "fit.toml"].map(|name| folder.join(name));
    if let Some(there) = [&scene, &fit].into_iter().find(|path| path.exists() && !options.force) {
        bail!("{} is there already: --force replaces it, and -o names another folder", there.display());
    }
    let (low, high) = bounds(&mesh).map_err(|problem| anyhow!("{}: {problem}", path.display()))?;
    std::fs::create_dir_all(&folder)
        .map_err(|e| anyhow!("cannot make the folder {}: {e}", folder.display()))?;
    [&scene, &fit].into_iter().try_for_each(|path| check_place(path))?;
    let id = id(&stem);
    let stage = Stage::new(&id, plugin, &relative(&folder, path)?, (low, high), options.up.into());
    write_bytes(&scene, stage.scene().as_bytes())?;
    write_bytes(&fit, stage.fit(&in_shell(&fit), &in_shell(&folder.join("run"))).as_bytes())?;
    // It is read at once, so that what is wrong with the mesh is known here.
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
    let _ = writeln!(text, "wrote {} and {}; next:", scene.display(), fit.display());
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

/// A mesh with the plugin that reads it, and what its reader notes.
fn read(path: &Path) -> anyhow::Result<(Mesh, &'static str, Vec<String>)> {
    let shown = path.display();
    if path.is_dir() {
        bail!("{shown} is a folder; name a mesh in it");
    }
    let bytes = read_bytes(path).with_context(|| format!("cannot read {shown}"));
    let bytes = bytes.map_err(|e| anyhow!("{e:#}"))?;
    match Kind::of(path, &bytes) {
        Kind::Mesh | Kind::Unknown | Kind::Empty => {}
        Kind::Scene => bail!("{shown} is a scene already: `volume3d render {} -o image.png`", in_shell(path)),
        Kind::ForeignMesh => bail!("{shown} is a mesh in a format that is not read: save it as OBJ or PLY"),
        _ => bail!("{shown} is not a mesh: .obj, .ply and .serialized are read"),
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

/// The box around all triangles.
fn bounds(mesh: &Mesh) -> Result<(DVec3, DVec3), &'static str> {
    let corners = mesh.triangles().as_flattened().iter().map(|&i| mesh.positions()[i as usize]);
    let all = DVec3::splat(f64::INFINITY);
    let (low, high) = corners.fold((all, -all), |(low, high), p| (low.min(p), high.max(p)));
    let diagonal = (high - low).length();
    if mesh.triangles().is_empty() {
        Err("the mesh has no triangles")
    } else if diagonal == 0.0 {
        Err("all triangles of the mesh are one point")
    } else if !diagonal.is_finite() {
        Err("the mesh is larger than can be computed with")
    } else {
        Ok((low, high))
    }
}

/// The name of a file without its endings.
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

/// A name for the shape that command lines can hold: letters, digits, `-` and `_`.
fn id(stem: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let id: String = stem.chars().map(plain).collect();
    if TAKEN.contains(&id.as_str()) || id.starts_with('-') { format!("mesh_{id}") } else { id }
}

/// The path of a file as a scene in a folder names it.
fn relative(folder: &Path, file: &Path) -> anyhow::Result<String> {
    let whole = |path: &Path| {
        // An empty path is this folder.
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
        path.to_str().ok_or_else(|| anyhow!("{}: its name is not UTF-8; give it another", file.display()))?;
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
