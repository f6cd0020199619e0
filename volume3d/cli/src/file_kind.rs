//! Recognises files of the wrong kind, and names the command that accepts them.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use volume3d::io::read_bytes;

/// Kinds of files that users confuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Text that begins like XML.
    Scene,
    /// A mesh in a supported format.
    Mesh,
    /// A mesh in an unsupported format.
    ForeignMesh,
    Picture,
    /// The configuration of a fit.
    Configuration,
    /// A grid of signed distances or a network, which a scene refers to.
    Surface,
    Array,
    /// Text in UTF-16, as some editors save it.
    Utf16,
    Empty,
    Unknown,
}

/// File name extensions in lower case; a `.gz` after them is ignored.
const ENDINGS: [(Kind, &[&str]); 6] = [
    (Kind::Mesh, &["obj", "ply", "serialized"]),
    (
        Kind::ForeignMesh,
        &[
            "stl", "off", "gltf", "glb", "fbx", "dae", "blend", "3ds", "usd", "usda", "usdc", "usdz", "x3d",
            "3mf",
        ],
    ),
    (
        Kind::Picture,
        &[
            "png", "jpg", "jpeg", "exr", "hdr", "bmp", "tif", "tiff", "webp", "heic", "pfm", "svg", "gif",
            "tga",
        ],
    ),
    (Kind::Configuration, &["toml"]),
    (Kind::Surface, &["vol", "safetensors"]),
    (Kind::Array, &["npy", "npz", "csv"]),
];

/// First bytes of files without a known extension.
const BEGINNINGS: [(Kind, &[u8]); 8] = [
    (Kind::Picture, b"\x76\x2f\x31\x01"),
    (Kind::Picture, b"\x89PNG"),
    (Kind::Picture, b"\xff\xd8\xff"),
    (Kind::Picture, b"#?RADIANCE"),
    (Kind::Mesh, b"ply\n"),
    (Kind::Mesh, b"ply\r\n"),
    (Kind::Array, b"\x93NUMPY"),
    (Kind::Surface, b"VOL"),
];

impl Kind {
    /// The kind of a file by its first bytes and its name.
    pub(super) fn of(path: &Path, bytes: &[u8]) -> Self {
        if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
            return Self::Utf16;
        }
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
        if text.is_empty() {
            return Self::Empty;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
        let by_name = ENDINGS.iter().find(|(_, endings)| endings.contains(&ending)).map(|(kind, _)| *kind);
        // Some formats of meshes and pictures are XML.
        if text.starts_with(b"<") && !["dae", "x3d", "svg"].contains(&ending) {
            return Self::Scene;
        }
        let by_bytes =
            || BEGINNINGS.iter().find(|(_, begin)| bytes.starts_with(begin)).map(|(kind, _)| *kind);
        by_name.or_else(by_bytes).unwrap_or(Self::Unknown)
    }
}

/// Advice for text in UTF-16.
const UTF16: &str = "is text in UTF-16: save it as UTF-8";

/// Reads a scene file. The error for a file of another kind names the command that accepts it.
pub(super) fn read_scene_file(path: &Path) -> anyhow::Result<Vec<u8>> {
    let shown = path.display();
    if path.is_dir() {
        bail!("{shown} is a folder, not a scene{}", among(path, "xml"));
    }
    let bytes = read_bytes(path).with_context(|| format!("cannot read {shown}"));
    let bytes = bytes.map_err(|e| anyhow!("{e:#}"))?;
    let word = in_shell(path);
    let is = match Kind::of(path, &bytes) {
        Kind::Scene => return Ok(bytes),
        Kind::Mesh => format!("is a mesh, not a scene: `volume3d new {word}` writes a scene for it"),
        Kind::ForeignMesh => {
            "is a mesh in an unsupported format: save it as OBJ or PLY, and `volume3d new` writes a scene for it"
                .to_owned()
        }
        Kind::Picture => "is a picture, not a scene: give a scene (.xml); pictures are targets of a fit, see \
                          `volume3d fit --example`"
            .to_owned(),
        Kind::Configuration => {
            format!("is the configuration of a fit, not a scene: `volume3d fit {word} -o run` runs it")
        }
        Kind::Surface => "is an implicit surface, not a scene: a scene refers to it by <shape type=\"sdfgrid\"> or \
                          <shape type=\"sdfnetwork\">"
            .to_owned(),
        Kind::Array => "is an array, not a scene: give a scene (.xml)".to_owned(),
        Kind::Utf16 => UTF16.to_owned(),
        Kind::Empty => "is empty; a scene begins with <scene version=\"3.0.0\">".to_owned(),
        Kind::Unknown => "is not a scene: a scene is Mitsuba XML and begins with <scene version=\"3.0.0\">; \
                          `volume3d new MESH` writes one"
            .to_owned(),
    };
    bail!("{shown} {is}")
}

/// Reads the configuration of a fit. The error for a file of another kind says what to do instead.
pub(super) fn read_configuration(path: &Path) -> anyhow::Result<String> {
    let shown = path.display();
    if path.join("state.bin").is_file() {
        bail!("{shown} is the folder of a run: name its configuration, and this folder after -o");
    }
    if path.is_dir() {
        bail!("{shown} is a folder, not the configuration of a fit{}", among(path, "toml"));
    }
    let bytes = read_bytes(path).with_context(|| format!("cannot read {shown}"));
    let bytes = bytes.map_err(|e| anyhow!("{e:#}"))?;
    const EXAMPLE: &str = "`volume3d fit --example > fit.toml` writes one to start from";
    match Kind::of(path, &bytes) {
        Kind::Configuration | Kind::Unknown | Kind::Empty => {}
        Kind::Mesh => {
            let word = in_shell(path);
            bail!(
                "{shown} is a mesh: `volume3d new {word}` writes a scene and a configuration (fit.toml) for it"
            )
        }
        Kind::Scene => bail!("{shown} is a scene, not the configuration of a fit: {EXAMPLE}"),
        Kind::Picture => bail!("{shown} is a picture, not the configuration of a fit: {EXAMPLE}"),
        Kind::Utf16 => bail!("{shown} {UTF16}"),
        Kind::ForeignMesh | Kind::Surface | Kind::Array => {
            bail!("{shown} is not the configuration of a fit: {EXAMPLE}")
        }
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|byte| **byte == b'\n').count();
        anyhow!("{shown}: line {line} is not UTF-8, as TOML must be: save the file as UTF-8")
    })
}

/// Checks that a file named by a key of a configuration exists. The error suggests a similar name in its
/// folder. `key` names the key in messages.
pub(super) fn check_there(path: &Path, key: &str) -> anyhow::Result<()> {
    if path.exists() && !path.is_dir() {
        return Ok(());
    }
    let shown = path.display();
    if path.is_dir() {
        bail!("{key} = \"{shown}\" is a folder; name a file in it");
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let whole = folder.canonicalize().map_err(|_| {
        anyhow!(
            "{key} = \"{shown}\": there is no folder {}; paths are relative to the folder of the configuration",
            folder.display()
        )
    })?;
    let wanted = path.file_name().unwrap_or_default().to_string_lossy();
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let distance = |found: &str| strsim::osa_distance(&wanted.to_lowercase(), &found.to_lowercase());
    // The order of files in a folder is unspecified, so ties are broken by name.
    let near =
        names.min_by_key(|found| (distance(found), found.clone())).filter(|found| distance(found) <= 3);
    let near = near.map_or(String::new(), |found| format!("; did you mean {found}?"));
    bail!("{key} = \"{shown}\": there is no {wanted} in {}{near}", whole.display())
}

/// Names up to three files of a folder with an extension.
fn among(folder: &Path, ending: &str) -> String {
    const SHOWN: usize = 3;
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)));
    files.sort();
    let shown: Vec<String> = files.iter().take(SHOWN).map(|path| path.display().to_string()).collect();
    match files.len() {
        0 => format!(", and has no .{ending} file"),
        n if n > SHOWN => format!("; in it are {} and {} more", shown.join(", "), n - SHOWN),
        _ => format!("; in it: {}", shown.join(", ")),
    }
}

/// A path as one word of a command line.
pub(super) fn in_shell(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_their_bytes_and_names() {
        for (name, bytes, kind) in [
            ("a.xml", &b"\xef\xbb\xbf <scene/>"[..], Kind::Scene),
            ("a.obj", b"v 0 0 0", Kind::Mesh),
            ("a.PLY.GZ", b"\x1f\x8b", Kind::Mesh),
            ("scan", b"ply\nformat", Kind::Mesh),
            ("a.dae", b"<COLLADA>", Kind::ForeignMesh),
            ("a.toml", b"steps = 1", Kind::Configuration),
            ("a", b"\x89PNG\r\n", Kind::Picture),
            ("a.xml", b"\xff\xfe<\0", Kind::Utf16),
            ("a.xml", b" \r\n", Kind::Empty),
            ("a.py", b"import mitsuba", Kind::Unknown),
        ] {
            assert_eq!(Kind::of(Path::new(name), bytes), kind, "{name}");
        }
    }

    #[test]
    fn paths_are_quoted_where_a_shell_would_part_them() {
        assert_eq!(in_shell(Path::new("a/b-1.obj")), "a/b-1.obj");
        assert_eq!(in_shell(Path::new("my mesh's.obj")), "'my mesh'\\''s.obj'");
    }
}
