//! `volume3d fit`: a run, its folder, and what is refused.

use std::path::Path;

use glam::DVec3;
use volume3d::Image;
use volume3d::io::{load_image, load_scene, write_png};

use super::Place;

/// The block of the scene, from a little aside.
const CONFIG: &str = r#"
scene = "scene.xml"
define = { size = "6" }
steps = 4
gradient = { spp = 2 }
[reference]
scene = "scene.xml"
define = { size = "6" }
spp = 4
[[view]]
name = "front"
[[view]]
name = "aside"
origin = [-2, 1, 2]
look_at = [-0.9, 0, 0]
width = 5
[[parameter]]
name = "block.translation"
rate = 0.05
start = [0.1, 0.1, 0]
"#;

fn place(config: &str) -> Place {
    let place = Place::new();
    std::fs::write(place.path("fit.toml"), config).unwrap();
    place
}

/// All files below a folder, with their contents.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = vec![];
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            found.extend(files(&path).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            found.push((name, std::fs::read(&path).unwrap()));
        }
    }
    found.sort();
    found
}

fn assert_same(a: &[(String, Vec<u8>)], b: &[(String, Vec<u8>)]) {
    let names = |all: &[(String, Vec<u8>)]| all.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(a), names(b));
    for (a, b) in a.iter().zip(b) {
        assert!(a == b, "{} differs", a.0);
    }
}

#[test]
fn a_run_leaves_a_folder_that_says_all() {
    let place = place(CONFIG);
    let text = place.succeed("fit fit.toml -o run");
    assert!(text.contains("4 steps in ") && text.contains("block.translation: "), "{text}");
    assert!(text.contains("wrote run/report.html"), "{text}");
    let table = String::from_utf8(place.bytes("run/loss.csv")).unwrap();
    assert!(table.starts_with("step,loss,penalty,rate factor,|gradient| block.translation,"), "{table}");
    assert_eq!(table.lines().count(), 5, "{table}");
    let page = String::from_utf8(place.bytes("run/report.html")).unwrap();
    assert!(["<svg", "data:image/png;base64,", "aside", "difference"].iter().all(|w| page.contains(w)));
    assert_eq!(load_image(&place.path("run/views/002-fit.png"), false).unwrap().size(), (5, 6));
    load_scene(&place.path("run/fit.xml")).unwrap();
    let whole = files(&place.path("run"));

    // On another number of threads, and once more where it has ended.
    place.succeed("fit fit.toml -o one --threads 1");
    assert_same(&files(&place.path("one")), &whole);
    let text = place.succeed("fit fit.toml -o run");
    assert!(text.contains("continues after step 4 of 4"), "{text}");
    assert_same(&files(&place.path("run")), &whole);
}

/// The interior term misses what borders and lights that move leave to them, and nothing of what stands.
#[test]
fn a_fit_by_the_interior_term_warns_of_what_moves() {
    let lamps = "<emitter type='point' id='bulb'><point name='position' value='0,0,2'/></emitter>";
    let place = Place::with(lamps);
    for (name, warns) in [
        ("block.translation", true),
        ("bulb.translation", true),
        ("lamp.radiance", false),
        ("bulb.intensity", false),
    ] {
        let config = CONFIG.split("[[parameter]]").next().unwrap().replace("steps = 4", "steps = 1");
        let config = config.replace("spp = 2", "spp = 2, method = \"interior\"");
        let text = format!("{config}[[parameter]]\nname = \"{name}\"\nrate = 0.01\n");
        std::fs::write(place.path("fit.toml"), text).unwrap();
        let text = place.succeed(&format!("fit fit.toml -o {name}"));
        assert_eq!(text.contains("WARNING: the interior term alone is biased"), warns, "{name}: {text}");
    }
}

/// With a mean of parameters other numbers are written, and those of every thread count and of a run that has
/// ended are the same.
#[test]
fn a_mean_of_parameters_is_what_is_written() {
    let place = place(CONFIG);
    std::fs::write(place.path("mean.toml"), CONFIG.replace("steps = 4", "steps = 4\nparameter_mean = 0.95"))
        .unwrap();
    place.succeed("fit fit.toml -o plain");
    place.succeed("fit mean.toml -o mean");
    let whole = files(&place.path("mean"));
    assert_eq!(place.bytes("plain/loss.csv"), place.bytes("mean/loss.csv"));
    for name in ["parameters.csv", "views/001-fit.exr"] {
        let [plain, mean] = ["plain", "mean"].map(|run| place.bytes(&format!("{run}/{name}")));
        assert!(plain != mean, "{name}");
    }
    place.succeed("fit mean.toml -o one --threads 1");
    assert_same(&files(&place.path("one")), &whole);
    place.succeed("fit mean.toml -o mean");
    assert_same(&files(&place.path("mean")), &whole);
}

/// A run that is interrupted, and then killed, ends where one does that is left alone.
#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on_to_the_same_bits() {
    use std::process::{Command, Stdio};
    // With a pilot, which looks before the first step and again when the run is gone on with.
    let config = CONFIG.replace("steps = 4", "steps = 400").replace("spp = 2", "spp = 2, method = \"auto\"");
    let place = place(&config);
    let has_begun = || place.path("run/frames/00000012.png").exists();
    let mut codes = vec![];
    for signal in ["-INT", "-KILL"] {
        let mut command = place.command("fit fit.toml -o run");
        let mut run = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while !has_begun() && run.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap();
        codes.push(run.wait().unwrap().code());
    }
    // Ctrl-C ends it in order; nothing catches the other signal.
    assert_eq!(codes, [Some(130), None]);
    let text = place.succeed("fit fit.toml -o run");
    assert!(text.contains("continues after step ") && text.contains("a pilot chose "), "{text}");
    place.succeed("fit fit.toml -o whole");
    let [run, whole] = ["run", "whole"].map(|name| files(&place.path(name)));
    assert_same(&run, &whole);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let photo = Image::constant(8, 8, DVec3::splat(0.5));
    let cases = [
        ("steps = 4", "stepss = 4", "line 4: there is no key `stepss`", "did you mean `steps`?"),
        ("steps = 4", "steps = 0", "steps = 0", "one step"),
        ("steps = 4", "steps = 4.5", "line 4: steps is 4.5", "a whole number"),
        ("steps = 4", "steps = 4\nloss = { kind = \"l3\" }", "unknown variant `l3`", "did you mean `l"),
        ("steps = 4", "steps = 4\nschedule = { kind = \"exponential\", end = 0 }", "ends at 0", "above 0"),
        ("steps = 4", "steps = 4\nparameter_mean = 1", "parameter_mean is 1", "0.95 is usual"),
        ("spp = 2", "spp = 0", "gradient.spp is 0", "from 1 to"),
        ("spp = 2", "spp = 2, method = \"edges\"", "`edges`", "edge"),
        ("block.tr", "blok.tr", "nothing is called `blok`", "did you mean `block`"),
        ("block.translation", "block.tanslation", "`block.tanslation`", "did you mean `block.translation`?"),
        ("block.tr", "camera.tr", "`camera.translation`", "only one [[view]]"),
        ("name = \"block.translation\"", "", "a [[parameter]] has no name", "tie = ["),
        (
            "name = \"block.translation\"",
            "tie = [\"block.translation\", \"lamp.radiance\"]",
            "`lamp.radiance` and `block.translation` cannot be tied",
            "from 0 to inf",
        ),
        (
            "rate = 0.05",
            "rate = 1\ntie = [\"metal.roughness\"]",
            "`metal.roughness` and `block.translation` cannot be tied",
            "they are 1 and 3 numbers",
        ),
        (
            "name = \"block.translation\"\nrate = 0.05\nstart = [0.1, 0.1, 0]",
            "tie = [\"block.vertex_positions\", \"block.vertex_positions.x\"]\nrate = 1\nlarge_steps = 1",
            "`block.vertex_positions.x` is the same parameter",
            "block.vertex_positions",
        ),
        (
            "name = \"block.translation\"\nrate = 0.05\nstart = [0.1, 0.1, 0]",
            "name = \"block.vertex_positions.x\"\nrate = 1\nlarge_steps = 1",
            "large_steps applies to vertex_positions",
            "block.vertex_positions.x",
        ),
        (
            "rate = 0.05",
            "rate = 1\npivot = [0, 0, 0]",
            "a pivot applies to a rotation or scale",
            "`block.translation`",
        ),
        ("rate = 0.05", "rate = 0", "the rate of `block.translation` is 0", "positive"),
        ("rate = 0.05", "rate = 1\nbounds = [1, 0]", "bounds", "in order"),
        ("rate = 0.05", "rate = 1\nlarge_steps = 1", "large_steps applies to vertex_positions", "block"),
        ("[0.1, 0.1, 0]", "[0.1, 0.1]", "is 3 numbers", "its start has 2"),
        ("name = \"aside\"", "name = \"front\"", "views 1 and 2", "`front`"),
        (
            "name = \"aside\"",
            "target = \"none.png\"",
            "view `2`: target = \"none.png\"",
            "there is no none.png",
        ),
        ("name = \"aside\"", "target = \"scene.xml\"", "scene.xml", "not a PNG"),
        ("name = \"aside\"", "target = \"photo.png\"", "8 × 8 pixels, but view `2` is 5 × 6", "width = 8"),
        ("look_at = [-0.9, 0, 0]", "look_at = [-2, 1, 2]", "view `aside`", "has no orientation"),
        (
            "rate = 0.05",
            "rate = 1\nbounds = [-1, 1, \"x\"]",
            "line ",
            "bounds is \"x\", but must be a number",
        ),
        ("rate = 0.05", "rate = 1\nbounds = [-1, 1, 2]", "line ", "expected 2 numbers, found 3"),
        ("rate = 0.05", "rate = 1\nbounds = [-1]", "line ", "expected 2 numbers, found 1"),
        ("[-2, 1, 2]", "[-2, 1, 2, 99]", "line ", "expected 3 numbers, found 4"),
        ("[-0.9, 0, 0]", "[-0.9, 0, 0, 99]", "line ", "expected 3 numbers, found 4"),
        ("width = 5", "up = [0, 1, 0, 99]", "line ", "expected 3 numbers, found 4"),
        ("steps = 4", "steps = 4\nbackground = [0, 1, 0, 99]", "line 5", "expected 3 numbers, found 4"),
        (
            "steps = 4",
            "steps = 4\nloss = { kind = \"relative\", epsilon = 0 }",
            "fit.toml: the epsilon of a relative loss is 0",
            "0.01 is usual",
        ),
        ("width = 5", "width = 0", "view `aside`", "0"),
        ("width = 5", "width = 500000000", "view `aside`", "memory"),
    ];
    for (what, instead, words, more) in cases {
        let config = CONFIG.replacen(what, instead, 1);
        assert_ne!(config, CONFIG, "{what}");
        let place = place(&config);
        write_png(&place.path("photo.png"), &photo).unwrap();
        place.fail("fit fit.toml -o run", 1, &[words, more]);
        assert!(!place.path("run/state.bin").exists(), "{instead}");
    }
}

/// Two blocks that go the same way, by one component each.
#[test]
fn tied_parameters_have_the_same_values() {
    let tied = CONFIG
        .replace("name = \"block.translation\"", "tie = [\"block.translation.x\", \"sheet.translation.x\"]")
        .replace("start = [0.1, 0.1, 0]", "start = [0.1]");
    let place = place(&tied);
    place.succeed("fit fit.toml -o run");
    let table = String::from_utf8(place.bytes("run/parameters.csv")).unwrap();
    let row = table.lines().nth(1).unwrap();
    let value: f64 = row.strip_prefix("block.translation.x,0,").unwrap().parse().unwrap();
    assert!(table.lines().count() == 2 && value != 0.1, "{table}");
    let before = load_scene(&place.path("scene.xml")).unwrap();
    let after = load_scene(&place.path("run/fit.xml")).unwrap();
    for shape in [0, 2] {
        let first = |d: &volume3d::scene::Description| d.shapes[shape].mesh.positions()[0];
        let moved = first(&after) - first(&before);
        assert!((moved - value * DVec3::X).length() < 1e-6, "{moved} {value}");
    }
}

#[test]
fn what_nobody_sees_cannot_be_fitted() {
    let hidden =
        CONFIG.replace("origin = [-2, 1, 2]", "origin = [0, 0, 60]").replace("[-0.9, 0, 0]", "[0, 0, 90]");
    let text = place(&hidden).succeed("fit fit.toml -o run");
    assert!(text.contains("WARNING: view `aside` does not depend on any fitted parameter"), "{text}");
    let only = hidden.replace("[[view]]\nname = \"front\"\n", "");
    place(&only).fail("fit fit.toml -o run", 1, &["`block.translation` changes no pixel of any view"]);
    let far = CONFIG.replace("rate = 0.05", "rate = 1000");
    let text = place(&far).succeed("fit fit.toml -o run");
    assert!(text.contains("has left all views"), "{text}");
}

#[test]
fn a_folder_is_one_runs() {
    let place = place(CONFIG);
    place.fail("fit none.toml -o run", 1, &["cannot read none.toml"]);
    place.fail("fit fit.toml", 2, &["--output"]);
    place.fail("fit fit.toml -o .", 1, &[". is neither empty"]);
    std::fs::create_dir(place.path("own")).unwrap();
    let inside = CONFIG.replace("\"scene.xml\"", "\"../scene.xml\"");
    std::fs::write(place.path("own/config.toml"), inside).unwrap();
    place.fail("fit own/config.toml -o own", 1, &["own/config.toml is in the folder of the run"]);
    std::fs::create_dir(place.path("other")).unwrap();
    std::fs::write(place.path("other/thesis.txt"), "mine").unwrap();
    place.fail("fit fit.toml -o other", 1, &["other is neither empty"]);
    place.fail("fit fit.toml -o other/thesis.txt", 1, &["thesis.txt is not a folder"]);
    place.succeed("fit fit.toml -o run");
    std::fs::write(place.path("fit.toml"), CONFIG.replace("0.05", "0.04")).unwrap();
    place.fail("fit fit.toml -o run", 1, &["another configuration"]);
    // The same words, but another scene.
    std::fs::write(place.path("fit.toml"), CONFIG).unwrap();
    let scene = String::from_utf8(place.bytes("scene.xml")).unwrap();
    std::fs::write(place.path("scene.xml"), scene.replace("0.6,0.5,0.4", "0.6,0.5,0.5")).unwrap();
    place.fail("fit fit.toml -o run", 1, &["state.bin is the state of another fit"]);
    std::fs::write(place.path("scene.xml"), scene).unwrap();
    std::fs::write(place.path("run/state.bin"), "damage").unwrap();
    place.fail("fit fit.toml -o run", 1, &["run/state.bin", "damaged; remove it"]);
}
