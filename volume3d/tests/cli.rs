//! The command line, from outside: options, messages, exit codes and files.

use std::path::PathBuf;
use std::process::{Command, Output};

use glam::DVec3;
use tempfile::TempDir;
use volume3d::io::{Array, Image, Precision, read_exr, read_npy, write_exr, write_npy, write_png};

const SCENE: &str = r#"<scene version="3.0.0">
  <default name="size" value="8"/>
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <film type="hdrfilm">
      <integer name="width" value="$size"/><integer name="height" value="$size"/><rfilter type="tent"/>
    </film>
    <transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
  </sensor>
  <bsdf type="twosided" id="plain"><bsdf type="diffuse"><rgb name="reflectance" value="0.6,0.5,0.4"/></bsdf></bsdf>
  <bsdf type="twosided" id="metal"><bsdf type="roughconductor"><float name="alpha" value="0.4"/></bsdf></bsdf>
  <bsdf type="twosided" id="paper"><bsdf type="diffuse">
    <texture type="bitmap" name="reflectance"><string name="filename" value="paper.png"/></texture>
  </bsdf></bsdf>
  <shape type="obj" id="sheet"><string name="filename" value="sheet.obj"/><ref id="plain"/></shape>
  <shape type="rectangle" id="back">
    <transform name="to_world"><scale value="3"/><translate z="-1"/></transform><ref id="paper"/>
  </shape>
  <shape type="cube" id="block">
    <transform name="to_world"><scale value="0.2"/><translate x="-0.9"/></transform><ref id="metal"/>
  </shape>
  <shape type="rectangle" id="lamp">
    <transform name="to_world"><rotate x="1" angle="180"/><translate z="3.5"/></transform>
    <emitter type="area"><rgb name="radiance" value="4,5,6"/></emitter>
  </shape>
  <!-- more -->
</scene>"#;

/// Two triangles whose six vertices are at four places.
const SHEET: &str =
    "v -.5 -.5 0\nv .6 -.4 0\nv .5 .5 .1\nv .5 .5 .1\nv -.4 .6 0\nv -.5 -.5 0\nf 1 2 3\nf 4 5 6\n";

/// A folder with the scene.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self::with("")
    }

    /// With more in the scene.
    fn with(more: &str) -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        std::fs::write(place.path("scene.xml"), SCENE.replace("<!-- more -->", more)).unwrap();
        std::fs::write(place.path("sheet.obj"), SHEET).unwrap();
        let pixels = vec![DVec3::splat(0.2), DVec3::splat(0.8)];
        write_png(&place.path("paper.png"), &Image { width: 2, height: 1, pixels }).unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program, with a line of arguments.
    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_volume3d"));
        command.current_dir(self.0.path()).args(line.split_whitespace());
        command
    }

    /// What it says on both channels, and its exit code.
    fn run(&self, line: &str) -> (i32, String) {
        let Output { status, stdout, stderr } = self.command(line).output().unwrap();
        let text = String::from_utf8([stdout, stderr].concat()).unwrap();
        (status.code().unwrap_or(-1), text)
    }

    fn succeed(&self, line: &str) -> String {
        let (code, text) = self.run(line);
        assert_eq!(code, 0, "{line}: {text}");
        text
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn exr(&self, name: &str) -> Image {
        read_exr(&self.path(name)).unwrap()
    }

    fn npy(&self, name: &str) -> Array {
        read_npy(&self.path(name)).unwrap()
    }
}

fn sum(image: &Image) -> f64 {
    image.pixels.iter().map(|p| p.element_sum()).sum()
}

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
    let options =
        "--spp 6 --seed 1 --stderr e.exr --stderr-blocks b.exr --image i.exr --terms part --png g.png";
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
    let other = "--move camera:fov:1 --image r.exr";
    place.succeed(&format!("gradient scene.xml -o f.exr --spp 6 --seed 1 {other}"));
    assert_eq!(place.bytes("i.exr"), place.bytes("r.exr"), "the image depends on the gradient");
    place.succeed("render scene.xml -o r.exr --spp 6 --seed 1");
    assert_ne!(place.bytes("i.exr"), place.bytes("r.exr"), "an image and a gradient share their samples");
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
    let default = gradient("");
    assert_eq!(gradient("--method warped-area --field jump-mean"), default);
    let others = [
        "--field rays",
        "--debias none",
        "--debias none --aux 4",
        "--debias roulette",
        "--debias multilevel --aux 8",
        "--adaptive",
        "--method interior",
        "--method edge",
        "--method rotation",
        "--method finite-difference --step 0.01",
    ]
    .map(gradient);
    for (i, other) in others.iter().enumerate() {
        assert!(*other != default && !others[..i].contains(other), "{i}");
    }
    assert_eq!(gradient("--debias multilevel --aux 16"), others[0]);
}

#[test]
fn failures_say_what_to_do() {
    let place = Place::new();
    std::fs::write(place.path("bad.xml"), "<scene version='3.0.0'>\n<shape type='sphere'/></scene>").unwrap();
    let image =
        |width: usize, value: f64| Image { width, height: 8, pixels: vec![DVec3::splat(value); width * 8] };
    write_exr(&place.path("narrow.exr"), &image(7, 1.0)).unwrap();
    write_exr(&place.path("nan.exr"), &image(8, f64::NAN)).unwrap();
    write_exr(&place.path("adj.exr"), &image(8, 1.0)).unwrap();
    std::fs::create_dir(place.path("folder")).unwrap();
    let before = place.bytes("scene.xml");
    let moved = "gradient scene.xml --move sheet:translate:1,0,0";
    let reverse = "gradient scene.xml --adjoint adj.exr";
    let cases = [
        ("render none.xml -o a.exr", 1, "cannot read none.xml"),
        ("render bad.xml -o a.exr", 1, "bad.xml:"),
        ("render scene.xml -o a.jpg", 1, ".exr, .npy or .png"),
        ("render scene.xml -o a.exr --png b.exr", 1, "--png writes .png"),
        ("render scene.xml -o none/a.exr", 1, "there is no folder none"),
        ("render scene.xml -o folder", 1, ".exr, .npy or .png"),
        ("render scene.xml -o a.png --png ./a.png", 1, "written twice"),
        ("render scene.xml -o paper.png", 1, "is read and will not be overwritten"),
        ("render scene.xml -o a.exr -D nothing=1", 1, "nothing"),
        ("render scene.xml -o a.exr -D nothing", 2, "NAME=VALUE"),
        ("render scene.xml -o a.exr --spp 0", 2, "whole number from 1"),
        ("render scene.xml -o a.exr --spp 1 --stderr e.exr", 1, "at least 2 samples"),
        ("render scene.xml -o a.exr --threads 0", 2, "--threads"),
        ("render scene.xml", 2, "--output"),
        ("paint scene.xml", 2, "paint"),
        ("gradient scene.xml -o a.exr", 2, "--move, or --adjoint"),
        ("gradient scene.xml --move sheet:jump:1 -o a.exr", 2, "SHAPE:translate:x,y,z"),
        ("gradient scene.xml --move sheet:translate:1,2 -o a.exr", 2, "three numbers"),
        ("gradient scene.xml --move sheet:scale:0,0,0:nan -o a.exr", 2, "finite number"),
        ("gradient scene.xml --move sheat:translate:1,0,0 -o a.exr", 1, "there are: `sheet`, "),
        ("gradient scene.xml --move mettle:roughness:1 -o a.exr", 1, "there are: `metal`, "),
        ("gradient scene.xml --move sheet:vertex:6:1,0,0 -o a.exr", 1, "its 6 vertices count from 0"),
        ("gradient scene.xml --move sheet:radiance:1,0,0 -o a.exr", 1, "that emit: `lamp`"),
        ("gradient scene.xml --move paper:reflectance:1,0,0 -o a.exr", 1, "has a texture"),
        ("gradient scene.xml --move plain:roughness:1 -o a.exr", 1, "with one: `metal`"),
        (&format!("{moved} -o a.exr --method magic"), 2, "warped-area"),
        (&format!("{moved} -o a.exr --step 0.1"), 2, "--method finite-difference"),
        (&format!("{moved} -o a.exr --method interior --aux 4"), 2, "--method warped-area"),
        (&format!("{moved} -o a.exr --method finite-difference --terms t"), 2, "--terms"),
        (&format!("{moved} -o a.exr --step -1 --method finite-difference"), 2, "positive"),
        (&format!("{moved} -o a.exr --terms none/t"), 1, "there is no folder none"),
        (&format!("{moved} -o a.exr --adjoint adj.exr --wrt camera.fov"), 2, "cannot be used with"),
        (&format!("{reverse} -o a.npy"), 2, "--wrt"),
        (&format!("{reverse} --wrt sheet -o a.npy"), 2, "SHAPE.vertex_positions"),
        (&format!("{reverse} --wrt sheet.texture -o a.npy"), 1, "no material `sheet`"),
        (&format!("{reverse} --wrt plain.texture -o a.npy"), 1, "with a texture: `paper`"),
        (&format!("{reverse} --wrt camera.fov -o a.exr"), 1, "is written as .npy"),
        (&format!("{reverse} --wrt camera.fov --wrt sheet.vertex_positions -o a.npy"), 1, "need a folder"),
        (&format!("{reverse} --wrt camera.fov --method finite-difference -o a.npy"), 2, "no reverse mode"),
        ("gradient scene.xml --adjoint narrow.exr --wrt camera.fov -o a.npy", 1, "7 × 8 pixels"),
        ("gradient scene.xml --adjoint nan.exr --wrt camera.fov -o a.npy", 1, "column 0, row 0"),
        ("gradient scene.xml --adjoint sheet.obj --wrt camera.fov -o a.npy", 1, "sheet.obj"),
        ("check scene.xml", 2, "--move"),
        ("check scene.xml --move lamp:radiance:1,1,1 --method finite-difference", 2, "checked against"),
        ("info none.xml", 1, "none.xml"),
    ];
    for (line, code, message) in cases {
        let (found, text) = place.run(line);
        assert!(found == code && text.contains(message), "{line}: exit {found}, expected {code}: {text}");
        assert!(!text.contains("panicked"), "{line}: {text}");
    }
    for name in ["a.exr", "a.npy", "a.png"] {
        assert!(!place.path(name).exists(), "{name} was written by a run that failed");
    }
    assert_eq!(place.bytes("scene.xml"), before);
}

#[test]
fn what_no_warp_sees_is_refused_by_name() {
    let place =
        Place::with("<emitter type='point' id='bulb'><point name='position' value='0,0,2'/></emitter>");
    let moved = "gradient scene.xml --move sheet:translate:1,0,0 -o a.exr";
    let (code, text) = place.run(moved);
    assert!(code == 1 && text.contains("`bulb`") && !text.contains("kappa"), "{code}: {text}");
    let text = place.succeed(&format!("{moved} --method interior"));
    assert!(text.contains("WARNING: the interior term alone is biased"), "{text}");
    place.succeed(&format!("{moved} --method finite-difference"));
    assert!(place.succeed("info scene.xml").contains("light `bulb` has no extent"));
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
    let common = "--spp 8 --seed 5";
    place.succeed(&format!("gradient scene.xml --adjoint adj.exr {wanted} -o out {common}"));
    let gradient = |name: &str| place.npy(&format!("out/{name}.npy"));
    assert_eq!(gradient("sheet.vertex_positions").shape, [6, 3]);
    assert_eq!(gradient("paper.texture").shape, [1, 2, 3]);
    assert_eq!(gradient("camera.fov").shape, [0; 0]);
    assert_eq!(gradient("lamp.radiance").shape, [3]);

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
    write_exr(&place.path("adj.exr"), &Image { width: 8, height: 8, pixels: vec![DVec3::ONE; 64] }).unwrap();
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
    let moved = "check scene.xml --move lamp:translate:0,0,-1 --spp 1600 --steps 0.03,0.01 --seed 2";
    let text = place.succeed(moved);
    assert!(text.contains("AGREE") && text.contains("weighted total"), "{text}");
    let (code, text) = place.run(&format!("{moved} --method interior"));
    assert!(code == 1 && text.contains("DIFFER"), "{code}: {text}");
    let (code, text) = place.run("check scene.xml --move sheet:translate:1,0,0 --spp 16");
    assert!(code == 3 && text.contains("OPEN") && text.contains("--spp "), "{code}: {text}");
    let text = place.succeed("check scene.xml --move lamp:radiance:1,1,1 --debias none");
    assert!(text.contains("AGREE"), "{text}");
}

#[test]
fn a_check_of_nothing_says_so() {
    let behind =
        "<shape type='cube' id='behind'><transform name='to_world'><translate z='90'/></transform></shape>";
    let place = Place::with(&format!("{behind}<!-- -->"));
    for change in ["sheet:translate:0,0,0", "behind:translate:1,0,0"] {
        let (code, text) = place.run(&format!("check scene.xml -D size=4 --spp 16 --move {change}"));
        assert!(code == 1 && text.contains("NOTHING CHANGES"), "{change}: {code}: {text}");
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
    write_exr(&place.path("adj.exr"), &Image { width: 8, height: 8, pixels: vec![DVec3::ONE; 64] }).unwrap();
    for (id, what) in [("bulb", "intensity"), ("sun", "irradiance"), ("sky", "radiance")] {
        let common = "--spp 8 --seed 3";
        place.succeed(&format!("gradient scene.xml --move {id}:{what}:1,2,3 -o f.npy {common}"));
        place.succeed(&format!("gradient scene.xml --adjoint adj.exr --wrt {id}.{what} -o r.npy {common}"));
        let forward: f64 = place.npy("f.npy").values.iter().sum();
        let reverse: f64 = place.npy("r.npy").values.iter().zip([1.0, 2.0, 3.0]).map(|(g, r)| g * r).sum();
        assert!(forward > 0.0 && (forward - reverse).abs() < 1e-5 * forward, "{id}: {forward} {reverse}");
    }
    let (code, text) = place.run("gradient scene.xml --move sun:intensity:1,1,1 -o f.npy");
    assert!(code == 1 && text.contains("no point light") && text.contains("`bulb`"), "{code}: {text}");
}

#[test]
fn what_cannot_be_held_is_refused_and_nothing_is_sent_to_the_terminal() {
    let place = Place::new();
    let (code, text) = place.run("render scene.xml -o a.exr -D size=20000");
    assert!(code == 1 && text.contains("GiB") && text.contains("crop_width"), "{code}: {text}");
    std::fs::write(place.path("bad.xml"), "<scene version='3.0.0'><shape type='\u{7f}\u{85}'/></scene>")
        .unwrap();
    let (code, text) = place.run("render bad.xml -o a.exr");
    assert!(code == 1 && !text.chars().any(|c| c.is_control() && c != '\n'), "{code}: {text:?}");
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
        "shape `sheet`: 2 vertices at the place of others",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(!text.contains("shape `block`:"), "{text}");
}

#[test]
fn help_teaches() {
    let place = Place::new();
    let whole = place.succeed("--help");
    assert!(whole.contains("Examples:") && whole.contains("130 after Ctrl-C"), "{whole}");
    let gradient = place.succeed("gradient --help");
    for word in ["right-handed", "radians", "scene units", "biased", "unbiased", "camera:fov:rate"] {
        assert!(gradient.contains(word), "{word}: {gradient}");
    }
    for command in ["render", "check", "info"] {
        assert!(place.succeed(&format!("{command} --help")).len() > 300, "{command}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_the_old_file() {
    use std::time::{Duration, Instant};

    let place = Place::new();
    let commands = [
        "render scene.xml -o old.exr -D size=256 --spp 20000",
        "gradient scene.xml --move sheet:translate:1,0,0 -o old.exr -D size=256 --spp 20000",
        "check scene.xml --move sheet:translate:1,0,0 -D size=256 --spp 200000",
    ];
    for line in commands {
        std::fs::write(place.path("old.exr"), "old").unwrap();
        let pipe = std::process::Stdio::piped;
        let child = place.command(line).stdout(pipe()).stderr(pipe()).spawn().unwrap();
        let pid = child.id();
        wait_until_listening(pid);
        let start = Instant::now();
        assert!(Command::new("kill").args(["-INT", &pid.to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{line}: {text}");
        assert!(text.contains("nothing was written"), "{line}: {text}");
        assert!(start.elapsed() < Duration::from_secs(20), "{line}: {:?}", start.elapsed());
        assert_eq!(place.bytes("old.exr"), b"old", "{line}");
        assert_eq!(
            std::fs::read_dir(place.0.path()).unwrap().count(),
            4,
            "{line}: something was left behind"
        );
    }
}

/// Waits until the process has a handler for SIGINT, as Linux tells; two seconds elsewhere.
#[cfg(unix)]
fn wait_until_listening(pid: u32) {
    use std::time::Duration;

    const SIGINT: u64 = 1 << 1;
    for _ in 0..1000 {
        let Ok(status) = std::fs::read_to_string(format!("/proc/{pid}/status")) else {
            std::thread::sleep(Duration::from_secs(2));
            return;
        };
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
        if caught & SIGINT != 0 {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}
