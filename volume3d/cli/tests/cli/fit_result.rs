//! What a fit says of its result: poses, whether it has reached its pictures, more steps, several starts.

use glam::DVec3;
use volume3d::io::{load_mesh, load_scene};

use super::Place;

/// The block of the scene, from a little aside and turned.
const CONFIG: &str = r#"
scene = "scene.xml"
define = { size = "8" }
steps = 4
gradient = { spp = 2 }
[reference]
scene = "scene.xml"
define = { size = "8" }
spp = 256
[[parameter]]
name = "block.translation"
rate = 0.02
start = [0.1, 0.1, 0]
[[parameter]]
name = "block.rotation"
rate = 0.05
start = [0, 0.3, 0]
"#;

fn place(config: &str) -> Place {
    let place = Place::new();
    write(&place, config);
    place
}

fn write(place: &Place, config: &str) {
    std::fs::write(place.path("fit.toml"), config).unwrap();
}

/// The numbers after a key of a result file, in brackets or not.
fn numbers(result: &str, key: &str) -> Vec<f64> {
    let begin =
        result.find(&format!("\n{key} = ")).unwrap_or_else(|| panic!("no {key} in {result}")) + key.len() + 4;
    let rest = &result[begin..];
    let end = if rest.starts_with("[\n") { rest.find("\n]") } else { rest.find('\n') };
    let text = rest[..end.unwrap_or(rest.len())].replace(['[', ']', '\n'], " ");
    text.split([',', ' ']).filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn a_pose_is_a_matrix_and_its_mesh_stays() {
    let place = place(CONFIG);
    let text = place.succeed("fit fit.toml -o run");
    assert!(text.contains("pose of `block`: ") && text.contains("(rotation vector, radians)"), "{text}");
    let result = String::from_utf8(place.bytes("run/result.toml")).unwrap();
    let (matrix, pivot) = (numbers(&result, "matrix"), numbers(&result, "pivot"));
    assert_eq!((matrix.len(), pivot.len()), (16, 3), "{result}");
    assert!(
        result.contains("unit = \"scene units\"") && numbers(&result, "start") == [0.1, 0.1, 0.0],
        "{result}"
    );
    // The matrix maps the mesh of the scene to where it is in fit.xml, which has it as a transform of the
    // mesh as it was.
    let block = |file: &str| {
        let scene = load_scene(&place.path(file)).unwrap();
        scene.shapes.into_iter().find(|shape| shape.id == "block").unwrap().mesh
    };
    let (before, after) = (block("scene.xml"), block("run/fit.xml"));
    // Files of meshes have an order of vertices of their own.
    let farthest = |from: &[DVec3], to: &[DVec3]| {
        from.iter()
            .map(|p| to.iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min))
            .fold(0.0, f64::max)
    };
    let row = |p: &DVec3, i: usize| p.dot(DVec3::from_slice(&matrix[4 * i..])) + matrix[4 * i + 3];
    let map = |p: &DVec3| DVec3::from_array([0, 1, 2].map(|i| row(p, i)));
    let mapped: Vec<DVec3> = before.positions().iter().map(map).collect();
    assert!(farthest(&mapped, after.positions()) < 1e-12, "{mapped:?} {:?}", after.positions());
    assert!(farthest(before.positions(), after.positions()) > 0.01);
    let text = String::from_utf8(place.bytes("run/fit.xml")).unwrap();
    let shape = text.split("<shape ").find(|shape| shape.contains("id=\"block\"")).unwrap();
    assert!(shape.contains("<transform name=\"to_world\">"), "{shape}");
    let file = shape.split("name=\"filename\" value=\"").nth(1).unwrap().split('"').next().unwrap();
    let kept = load_mesh(&place.path(&format!("run/{file}"))).unwrap();
    assert_eq!(kept.positions().len(), before.positions().len());
    assert_eq!(farthest(kept.positions(), before.positions()), 0.0, "the mesh is not the scene's");
    let page = String::from_utf8(place.bytes("run/report.html")).unwrap();
    for word in
        ["Pose of <code>block</code>", "class=\"matrix\"", "prefers-color-scheme:dark", "times the noise"]
    {
        assert!(page.contains(word), "{word}");
    }
    let curve = page.split("<svg").nth(1).unwrap().split('>').next().unwrap();
    assert!(
        curve.contains("viewBox") && !curve.contains("width"),
        "the curve has a size of its own, and may be cut: {curve}"
    );
}

#[test]
fn a_fit_far_from_its_pictures_says_so() {
    // Too small a rate to come near.
    let far = CONFIG.replace("rate = 0.02", "rate = 1e-6").replace("rate = 0.05", "rate = 1e-6");
    let place = place(&far);
    let output = place.command("fit fit.toml -o run").output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains("WARNING: the fit has not reached its pictures: residual ")
            && said.contains("starts = 8"),
        "{said}"
    );
    let result = String::from_utf8(place.bytes("run/result.toml")).unwrap();
    assert!(result.contains("reached = false"), "{result}");
    assert!(
        String::from_utf8(place.bytes("run/report.html"))
            .unwrap()
            .contains("The fit has not reached its pictures")
    );
    // The same where it begins at its end.
    write(&place, &far.replace("start = [0.1, 0.1, 0]\n", "").replace("start = [0, 0.3, 0]\n", ""));
    let text = place.succeed("fit fit.toml -o near");
    assert!(!text.contains("not reached"), "{text}");
    let result = String::from_utf8(place.bytes("near/result.toml")).unwrap();
    assert!(result.contains("reached = true"), "{result}");
}

#[test]
fn more_steps_may_be_asked_for() {
    let place = place(CONFIG);
    place.succeed("fit fit.toml -o run");
    write(&place, &format!("# longer\n{}", CONFIG.replace("steps = 4", "steps = 7")));
    let text = place.succeed("fit fit.toml -o run");
    assert!(text.contains("continues after step 4 of 7"), "{text}");
    assert_eq!(String::from_utf8(place.bytes("run/loss.csv")).unwrap().lines().count(), 8);
    write(&place, &CONFIG.replace("steps = 4", "steps = 5"));
    place.fail("fit fit.toml -o run", 1, &["it has taken more steps than the configuration asks for"]);
    write(&place, &CONFIG.replace("steps = 4", "steps = 9").replace("0.02", "0.03"));
    place.fail("fit fit.toml -o run", 1, &["another configuration, where only steps may change"]);
}

#[test]
fn the_best_of_several_starts_is_kept() {
    let config = CONFIG
        .replace("steps = 4", "steps = 4\nstarts = 3")
        .replace("rate = 0.02", "rate = 0.02\nspread = 0.2");
    let place = place(&config);
    let text = place.succeed("fit fit.toml -o run");
    let row = |text: &str| text.lines().position(|line| line.contains("loss before"));
    let at = row(&text).unwrap_or_else(|| panic!("no table: {text}"));
    let rows: Vec<&str> = text.lines().skip(at + 1).take(3).collect();
    let after: Vec<f64> =
        rows.iter().map(|r| r.split_whitespace().nth(2).unwrap().parse().unwrap()).collect();
    let kept = rows.iter().position(|row| row.ends_with("kept")).unwrap();
    assert!(rows[0].contains("as configured") && after.iter().all(|loss| *loss >= after[kept]), "{text}");
    assert!(String::from_utf8(place.bytes("run/report.html")).unwrap().contains("<h2>Starts</h2>"));
    let files = ["result.toml", "loss.csv", "views/001-fit.exr", "starts.txt", "state.bin"];
    place.succeed("fit fit.toml -o one --threads 1");
    files.iter().for_each(|file| {
        assert_eq!(place.bytes(&format!("run/{file}")), place.bytes(&format!("one/{file}")), "{file}");
    });
    // As if it had been killed during the last of the short fits.
    for file in ["starts/best.bin", "starts/03.bin", "starts.txt", "state.bin"] {
        std::fs::remove_file(place.path(&format!("one/{file}"))).unwrap();
    }
    place.succeed("fit fit.toml -o one");
    files.iter().for_each(|file| {
        assert_eq!(place.bytes(&format!("run/{file}")), place.bytes(&format!("one/{file}")), "{file}");
    });
    write(
        &place,
        &config.replace("spread = 0.2", "spread = 0").replace("rate = 0.05", "rate = 0.05\nspread = 0"),
    );
    place.fail("fit fit.toml -o none", 1, &["starts = 3, but no parameter has a spread"]);
}

/// The text that help shows can be pasted, whatever the width of the terminal.
#[test]
fn help_has_a_configuration_that_can_be_pasted() {
    let place = Place::new();
    for columns in ["40", "80", "200"] {
        let output = place.command("fit --help").env("COLUMNS", columns).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let begin = text.find("scene = \"start.xml\"").unwrap();
        let lines = text[begin..].lines().map(str::trim).take_while(|line| !line.starts_with('`'));
        let config: String = lines.map(|line| format!("{line}\n")).collect();
        let config = config
            .replace("start.xml", "scene.xml")
            .replace("bunny", "block")
            .replace("steps = 100", "steps = 1");
        let config =
            config.replace("[[view]]\ntarget = \"photo.png\"", "[reference]\nscene = \"scene.xml\"\nspp = 1");
        write(&place, &config);
        place.succeed(&format!("fit fit.toml -o run{columns}"));
        assert!(text.contains("volume3d fit --example > fit.toml"), "{text}");
    }
    place.fail("fit", 2, &["CONFIG.toml"]);
}
