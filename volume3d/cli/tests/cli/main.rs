//! The command line, from outside: options, messages, exit codes and files.

mod bounds;
mod fit;
mod fit_result;
mod hostile;
mod messages;
mod new;
mod not_finite;
mod photographs;
mod place;
mod refused;
mod sdf;
#[cfg(unix)]
mod signals;
mod tune;

use glam::DVec3;
use volume3d::Image;
use volume3d::io::{Array, Precision, write_exr, write_npy};

use place::{Place, sum};

#[test]
fn an_image_in_every_format() {
    let place = Place::new();
    let text = place.succeed("render scene.xml -o a.exr --png a.png --stderr e.exr --spp 9 --seed 3");
    assert!(text.contains("8 × 8 pixels, 9 spp, ") && text.contains("wrote e.exr"), "{text}");
    place.succeed("render scene.xml -o a.npy --spp 9 --seed 3");
    let image = place.exr("a.exr");
    assert!(sum(&image) > 1.0);
    assert_eq!(place.npy("a.npy").to_image().unwrap(), image);
    assert_eq!(place.npy("a.npy").shape, [8, 8, 3]);
    assert!(sum(&place.exr("e.exr")) > 0.0);
    assert!(place.bytes("a.png").starts_with(b"\x89PNG"));

    let default = place.succeed("render scene.xml -o b.exr -D size=6 --seed 4");
    assert!(default.contains("6 × 6 pixels, 4 spp"), "{default}");
    place.succeed("render scene.xml -o c.exr --spp 9 --seed 4");
    assert_ne!(place.bytes("c.exr"), place.bytes("a.exr"));
}

#[test]
fn a_gradient_with_all_that_goes_with_it() {
    let place = Place::new();
    let options = "--method warped-area --spp 6 --seed 1 --stderr e.exr --stderr-blocks b.exr --image i.exr \
                   --terms part --png g.png";
    let text = place.succeed(&format!("gradient scene.xml --move sheet:translate:1,0,0 -o g.exr {options}"));
    assert!(text.contains("auxiliary rays") && text.contains("wrote g.png (blue -"), "{text}");
    assert!(text.contains("total: red ") && text.contains("together "), "{text}");
    let gradient = place.exr("g.exr");
    assert!(place.exr("b.exr").pixels.len() == 1 && sum(&place.exr("b.exr")) > 0.0);
    let parts = ["interior", "primary", "secondary"].map(|t| place.exr(&format!("part_{t}.exr")));
    for (i, whole) in gradient.pixels.iter().enumerate() {
        let sum: DVec3 = parts.iter().map(|p| p.pixels[i]).sum();
        let size: f64 = parts.iter().map(|p| p.pixels[i].length()).sum();
        assert!((sum - *whole).length() <= 4.0 * f64::from(f32::EPSILON) * size, "{i}: {sum} {whole}");
    }
    assert!(parts[1].pixels.iter().any(|p| *p != DVec3::ZERO), "no primary term");
    let other = "--method warped-area --move camera:fov:1 --image r.exr";
    place.succeed(&format!("gradient scene.xml -o f.exr --spp 6 --seed 1 {other}"));
    assert_eq!(place.bytes("i.exr"), place.bytes("r.exr"), "the image depends on the gradient");
    place.succeed("render scene.xml -o r.exr --spp 6 --seed 1");
    assert_ne!(place.bytes("i.exr"), place.bytes("r.exr"), "an image and a gradient share their samples");
}

/// A pilot says how many samples an error takes, the same on every machine and with samples that are not
/// those of the result.
#[test]
fn an_error_or_a_time_decides_how_many_samples() {
    let place = Place::new();
    let forward = "gradient scene.xml --move sheet:translate:1,0,0 --seed 1 -o";
    let text = place.succeed(&format!("{forward} a.npy --error 0.2"));
    let samples = |text: &str| {
        let before = text.split(" spp, ").next().unwrap_or_default();
        before.rsplit(' ').next().unwrap_or_default().to_owned()
    };
    assert!(text.contains("a pilot of ") && text.contains("its error is "), "{text}");
    let threads = place.succeed(&format!("{forward} b.npy --error 0.2 --threads 1"));
    assert_eq!(samples(&text), samples(&threads));
    place.succeed(&format!("{forward} c.npy --spp {}", samples(&text)));
    assert_eq!(place.bytes("a.npy"), place.bytes("b.npy"));
    assert_eq!(place.bytes("a.npy"), place.bytes("c.npy"));
    let text = place.succeed(&format!("{forward} d.npy --error 1e-9 --time 0.2s"));
    assert!(text.contains(" spp, "), "{text}");
    for time in ["0.05s", "2s"] {
        let text = place.succeed(&format!("{forward} t.npy --time {time}"));
        assert!(text.contains("pilot") && text.contains(" s: ") && text.contains("its error is "), "{text}");
        place.succeed(&format!("{forward} s.npy --spp {}", samples(&text)));
        assert_eq!(place.bytes("t.npy"), place.bytes("s.npy"), "{text}");
    }
    for method in ["edge", "warped-area"] {
        let text = place.succeed(&format!("{forward} t.npy --method {method} --time 0.5s"));
        assert!(text.contains("a pilot of ") && text.contains("its error is "), "{text}");
    }
    let reverse = "gradient scene.xml --adjoint adjoint.exr --wrt sheet.vertex_positions -o e.npy";
    place.succeed("render scene.xml -o adjoint.exr --spp 4");
    for budget in ["--error 0.5", "--time 1s"] {
        let text = place.succeed(&format!("{reverse} {budget}"));
        assert!(text.contains("of the gradient, from the pilot"), "{text}");
    }
    // What never changes has no noise.
    place.succeed("gradient scene.xml --move lamp:radiance:0,0,0 -o f.npy --error 0.01");
}

#[test]
fn everything_moves() {
    let place = Place::new();
    let moves = [
        "sheet:translate:1,0,0",
        "sheet:rotate:0,0,0:0,0,1",
        "block:scale:-1,0,0:1",
        "sheet:vertex:5:-1,0,0",
        "lamp:radiance:1,1,1",
        "all:rotate:0,0,0:0,0.3,1",
        "lights:translate:1,0.3,-1",
        "paper:texture:1,1,1",
        "plain:reflectance:1,0,0",
        "metal:roughness:1",
        "camera:translate:0,0,-1",
        "camera:rotate:0,0.5,0",
        "camera:fov:-1",
    ];
    for change in moves {
        place.succeed(&format!("gradient scene.xml --spp 16 --move {change} -o g.npy"));
        let one = place.npy("g.npy");
        assert!(one.values.iter().any(|x| *x != 0.0), "{change}: all zero");
        place.succeed(&format!("gradient scene.xml --spp 16 --move {change} --move {change} -o g.npy"));
        // Derivatives are linear in the change; doubling is exact but for the squares under normalisations.
        for (one, two) in one.values.iter().zip(&place.npy("g.npy").values) {
            assert!((2.0 * one - two).abs() <= 1e-5 * two.abs(), "{change}: {one} {two}");
        }
    }
}

#[test]
fn every_method() {
    let place = Place::new();
    let gradient = |options: &str| {
        place.succeed(&format!("gradient scene.xml --spp 4 --move sheet:translate:1,0,0 -o g.exr {options}"));
        place.bytes("g.exr")
    };
    let default = gradient("--method warped-area");
    assert_eq!(gradient("--method warped-area --field jump-mean"), default);
    assert_eq!(gradient("--field jump-mean"), default);
    // No implicit surface is there that one could follow.
    assert_eq!(gradient("--implicit-field bangaru --nearest 4"), default);
    let others = [
        "--field softened",
        "",
        "--field rays",
        "--debias none",
        "--debias none --aux 4",
        "--debias roulette",
        "--debias multilevel --aux 8",
        "--method interior",
        "--method edge",
        "--method rotation",
        "--method finite-difference --step 0.01",
    ]
    .map(gradient);
    for (i, other) in others.iter().enumerate() {
        assert!(*other != default && !others[..i].contains(other), "{i}");
    }
    assert_eq!(gradient("--method auto"), others[1]);
    assert_eq!(gradient("--debias multilevel --aux 16"), others[2]);
}

/// By default a pilot chooses, says what, and chooses alike on any number of threads, forward and in reverse.
#[test]
fn a_pilot_chooses() {
    let place = Place::new();
    let scene = std::fs::read_to_string(place.path("scene.xml")).unwrap();
    let diffuse = scene.replace(
        r#"<bsdf type="roughconductor"><float name="alpha" value="0.4"/></bsdf>"#,
        r#"<bsdf type="diffuse"/>"#,
    );
    assert_ne!(diffuse, scene);
    std::fs::write(place.path("diffuse.xml"), diffuse).unwrap();
    place.succeed("render scene.xml -o adjoint.exr --spp 4");
    for what in ["--move sheet:translate:1,0,0", "--adjoint adjoint.exr --wrt sheet.vertex_positions"] {
        for (scene, words) in [("scene", "edge sampling was no candidate"), ("diffuse", "times that of")] {
            let run = |name: &str, options: &str| {
                let text =
                    place.succeed(&format!("gradient {scene}.xml --spp 16 {what} -o {name} {options}"));
                (text.lines().find(|l| l.starts_with("a pilot chose ")).map(str::to_owned), place.bytes(name))
            };
            let first = run("a.npy", "");
            assert!(first.0.as_ref().is_some_and(|line| line.contains(words)), "{:?}", first.0);
            assert_eq!(first, run("b.npy", "--threads 1"));
            assert_ne!(first.1, run("c.npy", "--seed 1").1);
            assert_eq!(run("d.npy", "--method edge").0, None);
        }
    }
    // Nothing is to be chosen.
    let text = place.succeed("gradient scene.xml --move lamp:radiance:1,1,1 -o a.npy");
    assert!(!text.contains("a pilot chose"), "{text}");
}

/// Edge sampling refuses what moves before a mirror, unless its jumps may be left out; then that is
/// printed, and kept in the file.
#[test]
fn what_is_left_out_is_said_and_kept() {
    let glass = r#"<bsdf type="conductor" id="glass"/><emitter type="point" id="bulb"><point name="position" value="0,3,3"/></emitter>
      <shape type="rectangle" id="wall"><transform name="to_world"><translate z="-2"/></transform><ref id="glass"/></shape>"#;
    let place = Place::with(glass);
    let moved = "gradient scene.xml --spp 1 --move sheet:translate:1,0,0 -o g.exr";
    place.succeed(moved);
    let edges = format!("{moved} --method edge");
    place.fail(&edges, 1, &["`wall` reflects as an ideal mirror", "allow missing mirrors"]);
    place.fail(&format!("{moved} --allow-missing mirror"), 1, &["point light `bulb`"]);
    let text = place.succeed(&format!("{moved} --allow-missing mirror,point-light"));
    let said = [
        "discontinuities reflected by material `glass` of shape `wall`, an ideal mirror",
        "the shadows of point light `bulb`",
    ];
    let header = String::from_utf8_lossy(&place.bytes("g.exr")).into_owned();
    for words in said {
        assert!(text.contains(words) && header.contains(words), "{words}: {text}");
    }
    place.fail(&format!("{moved} --method warped-area --allow-missing mirror"), 2, &["--method edge"]);
    place.fail(&format!("{moved} --allow-missing fog"), 2, &["mirror", "relief"]);
}

/// Σ adjoint · (∂I/∂θ θ̇) = Σ (∂L/∂θ) θ̇, where every number went through a file.
#[test]
fn forward_and_reverse_are_transposes() {
    let place = Place::new();
    // Eighths are exact in single precision.
    let pixels: Vec<DVec3> = (0..64)
        .map(|i| DVec3::new((i % 7) as f64 - 3.0, (i % 5) as f64 - 1.5, (i % 3) as f64) / 8.0)
        .collect();
    let adjoint = Image { width: 8, height: 8, pixels };
    write_exr(&place.path("adj.exr"), &adjoint).unwrap();
    write_npy(&place.path("adj.npy"), &Array::from(&adjoint), Precision::Double).unwrap();
    std::fs::create_dir(place.path("out")).unwrap();
    let names = [
        "sheet.vertex_positions",
        "lamp.radiance",
        "plain.reflectance",
        "metal.roughness",
        "paper.texture",
        "camera.translation",
        "camera.rotation",
        "camera.fov",
    ];
    let wanted: String = names.iter().map(|n| format!(" --wrt {n}")).collect();
    let common = "--method warped-area --spp 8 --seed 5";
    place.succeed(&format!("gradient scene.xml --adjoint adj.exr {wanted} -o out {common}"));
    // What overlaps with these is asked for by itself.
    for name in ["all.translation", "block.rotation.y", "sheet.vertex_positions.z", "paper.texture.g"] {
        place.succeed(&format!("gradient scene.xml --adjoint adj.exr --wrt {name} -o out {common}"));
    }
    let gradient = |name: &str| place.npy(&format!("out/{name}.npy"));
    assert_eq!(gradient("sheet.vertex_positions").shape, [6, 3]);
    assert_eq!(gradient("paper.texture").shape, [1, 2, 3]);
    assert_eq!(gradient("camera.fov").shape, [0; 0]);
    assert_eq!(gradient("lamp.radiance").shape, [3]);
    assert_eq!(gradient("block.rotation.y").shape, [0; 0]);
    assert_eq!(gradient("sheet.vertex_positions.z").shape, [6]);
    assert_eq!(gradient("paper.texture.g").shape, [1, 2]);
    let third = |values: &[f64]| values.iter().skip(2).step_by(3).copied().collect::<Vec<f64>>();
    let heights = third(&gradient("sheet.vertex_positions").values);
    assert_eq!(gradient("sheet.vertex_positions.z").values, heights);

    // A parameter asked for alone has the same derivative, whichever way the adjoint is stored.
    let one = "--wrt sheet.vertex_positions -o one.npy";
    place.succeed(&format!("gradient scene.xml --adjoint adj.npy {one} {common}"));
    let (alone, among) = (place.npy("one.npy"), gradient("sheet.vertex_positions"));
    assert_eq!(alone, among);
    // Vertices 0 and 5, 2 and 3 of the file are at one place.
    assert_eq!((&among.values[..3], &among.values[6..9]), (&among.values[15..], &among.values[9..12]));

    let vertex = |i: usize| (i * 3, "sheet.vertex_positions");
    let cases = [
        ("sheet:vertex:0:1,-2,.5", vertex(0), [1.0, -2.0, 0.5]),
        ("sheet:vertex:3:0,1,2", vertex(2), [0.0, 1.0, 2.0]),
        ("lamp:radiance:1,2,3", (0, "lamp.radiance"), [1.0, 2.0, 3.0]),
        ("plain:reflectance:1,2,-3", (0, "plain.reflectance"), [1.0, 2.0, -3.0]),
        ("camera:translate:1,2,-3", (0, "camera.translation"), [1.0, 2.0, -3.0]),
        ("camera:rotate:1,2,-3", (0, "camera.rotation"), [1.0, 2.0, -3.0]),
        ("camera:fov:2", (0, "camera.fov"), [2.0, 0.0, 0.0]),
        ("metal:roughness:2", (0, "metal.roughness"), [2.0, 0.0, 0.0]),
        ("paper:texture:1,0:1,2,-3", (3, "paper.texture"), [1.0, 2.0, -3.0]),
        ("paper:texture:0,0:0,2,0", (0, "paper.texture.g"), [2.0, 0.0, 0.0]),
        ("all:translate:1,2,-3", (0, "all.translation"), [1.0, 2.0, -3.0]),
        ("block:rotate:-.9,0,0:0,2,0", (0, "block.rotation.y"), [2.0, 0.0, 0.0]),
    ];
    for (change, (at, name), rate) in cases {
        place.succeed(&format!("gradient scene.xml --move {change} -o f.npy {common}"));
        let image = place.npy("f.npy").to_image().unwrap();
        let products = || image.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| *g * *a);
        let forward: f64 = products().map(DVec3::element_sum).sum();
        let size: f64 = products().map(|p| p.abs().element_sum()).sum();
        let reverse: f64 = gradient(name).values[at..].iter().zip(rate).map(|(g, r)| g * r).sum();
        // The forward image is stored in single precision; otherwise they are one sum in another order.
        let tolerance = f64::from(f32::EPSILON) * size + 1e-12;
        assert!(
            (forward - reverse).abs() <= tolerance && size > 0.0,
            "{change}: {forward} {reverse} ± {tolerance}"
        );
    }
}

#[test]
fn threads_change_nothing() {
    let place = Place::new();
    place.write_adjoint(vec![DVec3::ONE; 64]);
    let mut seen: Vec<[Vec<u8>; 3]> = vec![];
    for threads in [1, 2, 7] {
        let common = format!("--spp 8 --threads {threads}");
        place.succeed(&format!("render scene.xml -o r.exr {common}"));
        place.succeed(&format!("gradient scene.xml --move camera:rotate:1,0,0 -o g.exr {common}"));
        let reverse = "--adjoint adj.exr --wrt sheet.vertex_positions";
        place.succeed(&format!("gradient scene.xml {reverse} -o v.npy {common}"));
        seen.push(["r.exr", "g.exr", "v.npy"].map(|name| place.bytes(name)));
    }
    assert!(seen[0] == seen[1] && seen[0] == seen[2]);
}

#[test]
fn a_check_tells_right_from_wrong() {
    let place = Place::new();
    let moved = "check scene.xml --move lamp:translate:0,0,-1 --spp 4800 --steps 0.1,0.03 --seed 2";
    let text = place.succeed(moved);
    assert!(text.contains("AGREE") && text.contains("weighted total"), "{text}");
    place.fail(&format!("{moved} --method interior"), 1, &["DIFFER"]);
    place.fail("check scene.xml --move sheet:translate:1,0,0 --spp 16", 3, &["OPEN", "--spp "]);
    let text = place.succeed("check scene.xml --move lamp:radiance:1,1,1 --debias none --spp 1024");
    assert!(text.contains("AGREE"), "{text}");
}

/// A lit square that fills part of a few pixels and moves away: at small steps hardly a sample sees its edges
/// move, or none.
#[test]
fn a_check_is_not_misled_by_what_no_sample_saw() {
    let square = "<shape type='rectangle' id='square'><emitter type='area'><rgb name='radiance' value='1 1 1'/></emitter>
         <transform name='to_world'><scale x='0.31' y='0.27'/><rotate z='1' angle='13'/><translate x='0.1' z='1'/></transform></shape>";
    let place = Place::with(square);
    let verdicts = |spp: usize| -> Vec<i32> {
        let check = "check scene.xml -D size=6 --move square:translate:0,0,1";
        (0..15).map(|seed| place.run(&format!("{check} --spp {spp} --seed {seed}")).0).collect()
    };
    for spp in [16, 256] {
        let verdicts = verdicts(spp);
        assert!(verdicts.iter().all(|code| [0, 3].contains(code)), "{spp} spp: {verdicts:?}");
    }
}

#[test]
fn a_check_of_nothing_says_so() {
    let behind =
        "<shape type='cube' id='behind'><transform name='to_world'><translate z='90'/></transform></shape>";
    let place = Place::with(&format!("{behind}<!-- -->"));
    for change in ["sheet:translate:0,0,0", "behind:translate:1,0,0"] {
        let line = format!("check scene.xml -D size=4 --spp 16 --move {change}");
        let text = place.fail(&line, 1, &["NOTHING CHANGES"]);
        assert!(
            !text.contains("NaN") && !text.contains("inf") && !text.contains("AGREE"),
            "{change}: {text}"
        );
    }
}

/// Lights that are no shapes are named as `info` lists them, forward and in reverse.
#[test]
fn lights_are_parameters() {
    let place = Place::with(
        "<emitter type='point' id='bulb'><point name='position' value='0,0,2'/></emitter>
         <emitter type='directional' id='sun'><vector name='direction' value='0,0,-1'/></emitter>
         <emitter type='constant' id='sky'><rgb name='radiance' value='0.1'/></emitter>",
    );
    place.write_adjoint(vec![DVec3::ONE; 64]);
    for (id, what) in [("bulb", "intensity"), ("sun", "irradiance"), ("sky", "radiance")] {
        let common = "--spp 8 --seed 3";
        place.succeed(&format!("gradient scene.xml --move {id}:{what}:1,2,3 -o f.npy {common}"));
        place.succeed(&format!("gradient scene.xml --adjoint adj.exr --wrt {id}.{what} -o r.npy {common}"));
        let forward: f64 = place.npy("f.npy").values.iter().sum();
        let reverse: f64 = place.npy("r.npy").values.iter().zip([1.0, 2.0, 3.0]).map(|(g, r)| g * r).sum();
        assert!(forward > 0.0 && (forward - reverse).abs() < 1e-5 * forward, "{id}: {forward} {reverse}");
    }
    place.fail(
        "gradient scene.xml --move sun:intensity:1,1,1 -o f.npy",
        1,
        &["a directional light", "`bulb`"],
    );
}

/// What is read is listed without a scene; without either the command line is refused.
#[test]
fn info_lists_what_is_read() {
    let place = Place::new();
    let text = place.succeed("info --support");
    assert!(text.contains("| texture | bitmap, checkerboard, mesh_attribute |"), "{text}");
    assert_eq!(place.run("info").0, 2);
}

#[test]
fn info_lists_ids_and_findings() {
    let text = Place::new().succeed("info scene.xml");
    for line in [
        "`sheet`: 6 vertices, 2 triangles, `plain`",
        "`metal`: rough conductor, roughness 0.4",
        "texture `texture_0` of 2 × 1",
        "emits [4, 5, 6]",
        "shape `sheet`: 4 border edges",
        "shape `sheet`: 2 vertices at the position of others",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(!text.contains("shape `block`:"), "{text}");
}

#[test]
fn lint_says_where_and_what_to_do_and_fails_where_gradients_are_wrong() {
    let place = Place::new();
    let text = place.succeed("lint scene.xml");
    assert!(
        text.contains("hint: shape `sheet`: 4 border edges") && text.contains("close the mesh"),
        "{text}"
    );
    assert!(
        text.contains("such as the edge of vertices") && text.contains("no finding that makes"),
        "{text}"
    );
    let light = "<emitter type='point' id='bulb'><point name='position' value='0,0,2'/></emitter>";
    let hinted = Place::with(light).succeed("lint scene.xml");
    assert!(
        hinted.contains("hint: light `bulb` has no extent") && hinted.contains("warped-area"),
        "{hinted}"
    );
}

#[test]
fn help_teaches() {
    let place = Place::new();
    let whole = place.succeed("--help");
    assert!(whole.contains("Examples:") && whole.contains("130: Ctrl-C"), "{whole}");
    let gradient = place.succeed("gradient --help");
    for word in ["right-handed", "radians", "scene units", "biased", "unbiased", "camera:fov:rate"] {
        assert!(gradient.contains(word), "{word}: {gradient}");
    }
    for command in ["new", "render", "check", "tune", "info", "lint", "fit"] {
        assert!(place.succeed(&format!("{command} --help")).len() > 300, "{command}");
    }
}
