//! Every line of a shell in the README and in the guide runs as it is written.

use std::path::{Path, PathBuf};
use std::process::Command;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use tempfile::TempDir;
use volume3d::Image;
use volume3d::io::write_exr;

/// Lines that are not run here, with who runs them or why nobody does.
const ELSEWHERE: [(&str, &str); 10] = [
    ("pip install ./volume3d/python", "`.ci/run` installs the package and runs its tests"),
    ("cargo run --release -p figures", "the smoke run of the figures, with --quality draft"),
    ("cargo run --release -p figures -- mesh trade", "the same"),
    ("cargo run --release -p figures -- accuracy", "the same"),
    ("cargo run --release -p figures -- --help", "it prints the options"),
    ("cargo run --release -p figures -- poses --quality short --record", "it takes up to 40 minutes"),
    ("cargo run --release -p figures -- poses --quality full --record", "it takes hours"),
    ("cargo test --release --workspace", "this test is a part of it"),
    ("cargo run --release -p figures -- explore", "the tests of the figures ask its server"),
    (
        "cargo run --release -p figures -- peers --scenes SCENES --times 2,20 --out OUT",
        "its words in capitals stand for the reader's own; the tests of the figures run it",
    ),
];

/// What goes before a command of the program.
const PROGRAM: &str = "volume3d ";
const EXAMPLE: &str = "cargo run --release -p volume3d --example ";
const INSTALL: &str = "cargo install --path ";

/// Pixels along each side of the picture here, instead of the guide's 128, and seconds of a study instead of
/// a minute: the lines take as long as they say.
const SIZE: usize = 20;
const STUDY: &str = " --budget 2";
/// Samples of a check, about as many in all as the guide's 256 on its 128 × 128 pixels.
const CHECK: &str = " --spp 8192";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The texts with lines to run.
fn documents() -> Vec<(String, String)> {
    let guide = root().join("volume3d/guide");
    let names =
        std::fs::read_dir(guide).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let pages = names.filter(|name| name.ends_with(".md"));
    let mut names: Vec<String> = pages.map(|name| format!("volume3d/guide/{name}")).collect();
    names.sort();
    names.splice(0..0, ["README.md", "figures/README.md"].map(str::to_owned));
    names.into_iter().map(|name| (name.clone(), read(&name))).collect()
}

/// The blocks of a kind in a text.
fn blocks<'t>(text: &'t str, kind: &str) -> Vec<&'t str> {
    let opening = format!("\n```{kind}\n");
    text.split(&opening).skip(1).map(|rest| rest.split("\n```").next().unwrap()).collect()
}

/// Steps of the fit here, instead of 80.
const STEPS: &str = "steps = 3\n";

/// A folder with the guide's scene, a mesh for it, an adjoint image, and the scenes that come with the
/// program.
fn place() -> TempDir {
    let place = tempfile::tempdir().unwrap();
    let guide = read("volume3d/guide/start.md");
    let scene = blocks(&guide, "xml")[0].replace("value=\"128\"", &format!("value=\"{SIZE}\""));
    assert!(scene.contains(&format!("value=\"{SIZE}\"")), "the guide's scene has another size by now");
    std::fs::write(place.path().join("scene.xml"), scene).unwrap();
    std::fs::write(place.path().join("bunny.obj"), BUNNY).unwrap();
    let adjoint = Image { width: SIZE, height: SIZE, pixels: vec![DVec3::ONE; SIZE * SIZE] };
    write_exr(&place.path().join("adjoint.exr"), &adjoint).unwrap();
    let fit = blocks(&guide, "toml")[0].replace("steps = 80\n", STEPS);
    assert!(fit.contains(STEPS), "the guide's fit has another number of steps by now");
    std::fs::write(place.path().join("fit.toml"), fit).unwrap();
    let scenes = place.path().join("volume3d/scenes");
    std::fs::create_dir_all(&scenes).unwrap();
    std::fs::write(scenes.join("table.xml"), read("volume3d/scenes/table.xml")).unwrap();
    let fit = read("volume3d/scenes/fit.toml").replace("steps = 80\n", STEPS);
    assert!(fit.contains(STEPS), "the fit has another number of steps by now");
    std::fs::write(scenes.join("fit.toml"), fit).unwrap();
    let scene = std::fs::read_to_string(place.path().join("scene.xml")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(place.path().join(name), text).unwrap();
    let short = |fit: &str, steps: &str| {
        let fit = fit.replace(steps, STEPS).replace("size = \"64\"", &format!("size = \"{SIZE}\""));
        assert!(fit.contains(STEPS), "the guide's fit has another number of steps by now");
        fit
    };
    // A surface in the place of the bunny, and a fit of three steps with all that the guide's has.
    let guide = read("volume3d/guide/surfaces.md");
    for (name, surface) in ["start.xml", "network.xml"].into_iter().zip(blocks(&guide, "xml")) {
        write(name, &with_shape(&scene, "bunny", surface));
    }
    let fits = blocks(&guide, "toml");
    let fit = short(fits[0], "steps = 240\n").replace("refine = [80, 160]", "refine = [1, 2]");
    assert!(fit.contains("[1, 2]"), "the guide's fit is refined at other steps by now");
    let (shared, _) = fit.split_once("[[parameter]]").unwrap();
    write("surface.toml", &fit);
    write("network.toml", &(shared.replace("start.xml", "network.xml") + &fits[1].replace("[120]", "[2]")));
    // A ball, and its vertices.
    let guide = read("volume3d/guide/mesh.md");
    write("ico.obj", blocks(&guide, "obj")[0]);
    write("ball.xml", &with_shape(&scene, "bunny", blocks(&guide, "xml")[0]));
    write("mesh.toml", &short(blocks(&guide, "toml")[0], "steps = 100\n"));
    // Textures, and colours of vertices.
    let guide = read("volume3d/guide/texture.md");
    let (scenes, fit) = (blocks(&guide, "xml"), short(blocks(&guide, "toml")[0], "steps = 60\n"));
    write("texture.xml", &with_shape(&scene, "ground", scenes[0]));
    write("grey.xml", scenes[1]);
    write("texture.toml", &fit);
    let (before, rest) = scene.split_once("<bsdf type=\"twosided\" id=\"clay\">").unwrap();
    let bare = format!("{before}{}", rest.split_once("</bsdf>\n    </bsdf>").unwrap().1);
    write("coloured.xml", &with_shape(&bare, "bunny", scenes[2]));
    write("coloured.ply", &coloured());
    let of_colours = fit.replace("floor.texture", "clay.texture").replace(", floor = \"floor.png\"", "");
    write("coloured.toml", &of_colours.replace("texture.xml", "coloured.xml"));
    place
}

/// A scene with something else in the place of a shape.
fn with_shape(scene: &str, id: &str, instead: &str) -> String {
    let at = scene.find(&format!("id=\"{id}\"")).unwrap();
    let begin = scene[..at].rfind("<shape").unwrap();
    let end = at + scene[at..].find("</shape>").unwrap() + "</shape>".len();
    format!("{}{instead}{}", &scene[..begin], &scene[end..])
}

/// The mesh of these tests as PLY, with grey vertices, at the size of the guide's scene.
fn coloured() -> String {
    let lines = |letter: &str| {
        BUNNY.lines().filter_map(|l| l.strip_prefix(letter).map(str::trim).map(str::to_owned)).collect()
    };
    let (vertices, faces): (Vec<String>, Vec<String>) = (lines("v"), lines("f"));
    let numbers = |line: &str| line.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
         property uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    );
    for line in &vertices {
        let p = numbers(line);
        text += &format!("{} {} {} 128 128 128\n", 0.2 * p[0], 0.2 * p[1], 0.2 * p[2]);
    }
    for line in &faces {
        let f = numbers(line);
        text += &format!("3 {} {} {}\n", f[0] - 1.0, f[1] - 1.0, f[2] - 1.0);
    }
    text
}

/// What the guide says of a mesh without texture coordinates: the colours of its vertices are a texture that
/// can be fitted.
#[test]
fn colours_of_vertices_are_fitted() {
    let place = place();
    assert_eq!(fault(place.path(), "volume3d fit coloured.toml -o coloured"), None);
    let table = std::fs::read_to_string(place.path().join("coloured/parameters.csv")).unwrap();
    assert!(table.contains("clay.texture"), "{table}");
}

/// The configuration with all keys runs beside a scene of this kind.
#[test]
fn the_example_of_a_fit_runs() {
    let place = place();
    let mut command = Command::new(env!("CARGO_BIN_EXE_volume3d"));
    let output = command.args(["fit", "--example"]).output().unwrap();
    let example = String::from_utf8(output.stdout).unwrap();
    let fit = example.replace("steps = 40\n", STEPS).replace("size = \"48\"", &format!("size = \"{SIZE}\""));
    assert!(fit.contains(STEPS) && output.status.success(), "{example}");
    std::fs::write(place.path().join("example.toml"), fit).unwrap();
    assert_eq!(fault(place.path(), "volume3d fit example.toml -o example"), None);
}

/// What the guide says in words of a network: its fit runs, too.
#[test]
fn the_fit_of_a_network_runs() {
    let place = place();
    assert_eq!(fault(place.path(), "volume3d fit network.toml -o network"), None);
    assert!(place.path().join("network/meshes/bunny.obj").exists());
}

/// An octahedron, ten units high and standing on the ground, as closed as a bunny.
const BUNNY: &str = "v -4 4 0\nv 4 4 0\nv 0 0 0\nv 0 10 0\nv 0 4 -4\nv 0 4 4\n\
    f 2 4 6\nf 4 1 6\nf 1 3 6\nf 3 2 6\nf 4 2 5\nf 1 4 5\nf 3 1 5\nf 2 3 5\n";

/// Runs a line of the program in a folder; what is wrong with it, if anything.
fn fault(place: &Path, line: &str) -> Option<String> {
    let arguments = line.strip_prefix(PROGRAM)?;
    let more = match arguments.split_once(' ') {
        Some(("tune", _)) => STUDY,
        Some(("check", _)) => CHECK,
        // Several pages begin with it.
        Some(("new", _)) => " --force",
        _ => "",
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_volume3d"));
    let output =
        command.current_dir(place).args(format!("{arguments}{more}").split_whitespace()).output().unwrap();
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    // A new fit takes a minute; a few steps show that it runs.
    let fit = place.join("bunny/fit.toml");
    if let (true, Ok(text)) = (arguments.starts_with("new "), std::fs::read_to_string(&fit)) {
        std::fs::write(&fit, text.replace("steps = 60\n", STEPS)).unwrap();
    }
    (output.status.code() != Some(0)).then(|| format!("{line}: {}: {said}", output.status))
}

/// What is wrong with a line that installs the program from a folder, if anything: this package must be
/// there, with a program of the name that the other lines call.
fn fault_of_installing(line: &str, folder: &str) -> Option<String> {
    let same =
        root().join(folder).canonicalize().ok() == Path::new(env!("CARGO_MANIFEST_DIR")).canonicalize().ok();
    let program = Path::new(env!("CARGO_BIN_EXE_volume3d")).file_stem();
    let named = program.is_some_and(|name| name == PROGRAM.trim());
    (!same || !named).then(|| format!("{line}: installs no `{}`", PROGRAM.trim()))
}

#[test]
fn every_line_runs() {
    let place = place();
    let (mut faults, mut run) = (vec![], 0);
    let mut elsewhere = ELSEWHERE.map(|_| false);
    for (document, text) in documents() {
        for line in blocks(&text, "sh").into_iter().flat_map(str::lines) {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.is_empty() {
                continue;
            }
            let fault = if let Some(known) = ELSEWHERE.iter().position(|(known, _)| *known == line) {
                elsewhere[known] = true;
                None
            } else if line.starts_with(PROGRAM) {
                run += 1;
                fault(place.path(), line)
            } else if let Some(folder) = line.strip_prefix(INSTALL) {
                fault_of_installing(line, folder)
            } else if let Some(example) = line.strip_prefix(EXAMPLE) {
                // Each takes up to half a minute, and is compiled with the tests.
                let source = root().join(format!("volume3d/examples/{example}.rs"));
                (!source.is_file()).then(|| format!("{line}: there is no such example"))
            } else {
                Some(format!(
                    "{line}: nobody knows how to run this; add it to the list of those that are run elsewhere, with by whom"
                ))
            };
            faults.extend(fault.map(|fault| format!("{document}: {fault}")));
        }
    }
    for ((line, _), seen) in ELSEWHERE.iter().zip(elsewhere) {
        if !seen {
            faults.push(format!("{line}: is listed as run elsewhere, but no document has it"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(run > 8, "only {run} lines of the program were found");
}

/// Pictures are in the pages of the documentation as they are in the guide's folder.
#[test]
fn pages_have_their_pictures() {
    let folder = root().join("volume3d/guide/pictures");
    let mut seen = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "png") {
            continue;
        }
        let (bytes, stem) =
            (std::fs::read(&path).unwrap(), path.file_stem().unwrap().to_string_lossy().into_owned());
        let encoded = std::fs::read_to_string(path.with_extension("png.b64")).unwrap();
        assert_eq!(encoded, STANDARD.encode(&bytes), "{stem}");
        assert!(bytes.len() < 1 << 16, "{stem}: {} bytes", bytes.len());
        let page = read(&format!("volume3d/guide/{stem}.md"));
        assert!(page.contains(&format!("[picture]: pictures/{stem}.png")), "{stem}");
        assert!(page.contains("][picture]") && page.contains("views.png"), "{stem}");
        seen += 1;
    }
    assert!(seen > 1, "{seen} pictures");
}

/// The program can be had before it is called.
#[test]
fn installation_comes_first() {
    for (document, text) in documents() {
        let lines: Vec<&str> = blocks(&text, "sh").into_iter().flat_map(str::lines).collect();
        let first = |prefix: &str| lines.iter().position(|line| line.starts_with(prefix));
        // Pages that go on from the first.
        let goes_on = ["methods.md", "size.md", "surfaces.md", "mesh.md", "texture.md"]
            .iter()
            .any(|page| document.ends_with(page));
        if let (Some(call), false) = (first(PROGRAM), goes_on) {
            assert!(first(INSTALL).is_some_and(|install| install < call), "{document}");
        }
    }
}

/// A line that nobody knows, and one that fails, are noticed.
#[test]
fn what_does_not_run_is_noticed() {
    let place = place();
    assert!(fault(place.path(), "volume3d info scene.xml").is_none());
    assert!(fault(place.path(), "volume3d info scenes.xml").is_some());
    assert!(fault(place.path(), "volume3d paint scene.xml").is_some());
    assert!(fault_of_installing("", "volume3d/cli").is_none());
    assert!(fault_of_installing("", "flatland").is_some());
    assert_eq!(blocks("a\n```sh\nb\nc\n```\n```text\nd\n```\n", "sh"), ["b\nc"]);
}
