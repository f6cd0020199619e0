//! Mistakes of newcomers: a table of inputs and messages.

use glam::DVec3;
use volume3d::Image;
use volume3d::io::write_png;

use super::Place;

/// A fit of the block in the scene of all tests.
const FIT: &str = r#"scene = "scene.xml"
steps = 2
define = { size = "6" }
gradient = { spp = 2 }

[reference]
scene = "scene.xml"
spp = 4
define = { size = "6" }

[[parameter]]
name = "block.translation"
rate = 0.04
start = [0.1, 0.1, 0]
"#;

const REFERENCE: &str = "[reference]\nscene = \"scene.xml\"\nspp = 4\ndefine = { size = \"6\" }\n";

/// What is replaced in the configuration, by what, and what the message must say of it.
const CHANGED: [(&str, &str, &[&str]); 64] = [
    // Types.
    (
        "steps = 2",
        "steps = 2\nloss = \"l2\"",
        &["line 3: loss is \"l2\", but must be a table, such as loss = { kind = \"l2\" }"],
    ),
    ("steps = 2", "steps = 2\nloss = 2", &["line 3: loss is 2, but must be a table, such as"]),
    ("steps = 2", "steps = 2\nloss = {}", &["line 3: `loss = {}` has no kind; a loss has { kind = \"l2\" }"]),
    (
        "steps = 2",
        "steps = 2\nloss = { kind = \"l2\", levels = 3 }",
        &["line 3: this kind has no key `levels`"],
    ),
    (
        "steps = 2",
        "steps = 2\nloss = { kind = \"l3\" }",
        &["line 3: kind: unknown variant `l3`", "did you mean `l"],
    ),
    (
        "steps = 2",
        "steps = 2\nschedule = \"cosine\"",
        &["line 3: schedule is \"cosine\", but must be a table", "{ kind = \"constant\" }"],
    ),
    ("{ spp = 2 }", "16", &["line 4: gradient is 16, but must be a table, such as gradient = { spp = 16 }"]),
    (
        "rate = 0.04",
        "rate = \"0.04\"",
        &["line 13: rate is \"0.04\", but must be a number", "leave out the quotes"],
    ),
    (
        "steps = 2",
        "steps = 2.0",
        &["line 2: steps is 2.0, but must be a whole number", "leave out the decimal point"],
    ),
    ("steps = 2", "steps = \"2\"", &["line 2: steps is \"2\"", "leave out the quotes"]),
    ("steps = 2", "steps = -2", &["line 2: steps is -2, but must be a whole number, 0 or more"]),
    (
        "size = \"6\" }\ngradient",
        "size = 6 }\ngradient",
        &["line 3: size is 6, but must be text in quotes; put it in quotes"],
    ),
    ("[0.1, 0.1, 0]", "0.1", &["line 14: start is 0.1, but must be a list in brackets"]),
    ("[0.1, 0.1, 0]", "[\"0.1\"]", &["line 14: start is \"0.1\", but must be a number"]),
    ("[0.1, 0.1, 0]", "[0.1]", &["line 12: `block.translation` is 3 numbers, but its start has 1"]),
    (
        "rate = 0.04",
        "rate = 0.04\nuniform = \"yes\"",
        &["line 14: uniform is \"yes\", but must be true or false"],
    ),
    (
        "scene = \"scene.xml\"\nsteps",
        "scene = 3\nsteps",
        &["line 1: scene is 3, but must be a path in quotes"],
    ),
    // Values.
    (
        "rate = 0.04",
        "rate = -1",
        &["line 12: the rate of `block.translation` is -1, but must be positive", "such as 0.02"],
    ),
    ("rate = 0.04", "rate = nan", &["the rate of `block.translation` is NaN"]),
    ("steps = 2", "steps = 0", &["steps = 0: a fit needs at least one step"]),
    (
        "{ spp = 2 }",
        "{ spp = 2, method = \"warped\" }",
        &["gradient.method is `warped`, but must be one of auto, warped-area"],
    ),
    ("steps = 2", "steps = 2\nstarts = 0", &["starts = 0, but must be from 1 to 64; 8 is usual"]),
    ("rate = 0.04", "rate = 0.04\nspread = -1", &["the spread of `block.translation` is -1"]),
    // Keys that are missing, unknown, or elsewhere.
    ("rate = 0.04\n", "", &["line 11: `[[parameter]]` has no `rate`; add rate = 0.02"]),
    ("steps = 2\n", "", &["fit.toml: there is no `steps` at the top of the file; add steps = 100"]),
    (
        "scene = \"scene.xml\"\nsteps",
        "steps",
        &["there is no `scene` at the top of the file; add scene = \"scene.xml\""],
    ),
    ("name = \"block.translation\"\n", "", &["a [[parameter]] has no name"]),
    ("name = \"block.translation\"", "tie = []", &["a [[parameter]] has no name", "tie = ["]),
    (
        "steps = 2",
        "stepps = 2",
        &["line 2: there is no key `stepps` at the top of the file", "did you mean `steps`?"],
    ),
    (
        "rate = 0.04",
        "learning_rate = 0.04",
        &["line 13: there is no key `learning_rate` in [[parameter]]", "rate = 0.02"],
    ),
    ("steps = 2", "iterations = 2", &["line 2: there is no key `iterations`", "steps = 100"]),
    (
        "steps = 2",
        "steps = 2\nspp = 16",
        &["line 3: `spp` is not a key of the top", "it belongs to gradient = { … } or [reference]"],
    ),
    (
        "rate = 0.04",
        "rate = 0.04\nloss = { kind = \"l2\" }",
        &[
            "line 14: `loss` is not a key of [[parameter]], under which it stands; it belongs to the top of the file",
        ],
    ),
    (
        "start = [0.1, 0.1, 0]",
        "[[view]]\nloss = { kind = \"l2\" }",
        &["line 15: `loss` is not a key of [[view]]", "the top of the file"],
    ),
    (
        "start = [0.1, 0.1, 0]",
        "[[view]]\nrate = 1",
        &["line 15: `rate` is not a key of [[view]]", "belongs to [[parameter]]"],
    ),
    (
        "[[parameter]]",
        "[parameter]",
        &["line 11: write [[parameter]] instead of [parameter]: there may be several"],
    ),
    (
        "[reference]",
        "[[reference]]",
        &["line 6: write [reference] instead of [[reference]]: there is only one"],
    ),
    ("start = [0.1, 0.1, 0]", "[view]\norigin = [0, 1, 4]", &["line 14: write [[view]] instead of [view]"]),
    ("steps = 2", "steps = 2\nsteps = 3", &["line 3: `steps` is given twice"]),
    ("start = [0.1, 0.1, 0]", "[reference]", &["line 14: `[reference]` is given twice"]),
    // Text that is no TOML.
    ("rate = 0.04", "rate = 0,04", &["line 13: `rate = 0,04` is not TOML", "numbers with a decimal point"]),
    (
        "scene = \"scene.xml\"\nsteps",
        "scene = scene.xml\nsteps",
        &["line 1: `scene = scene.xml` is not TOML", "text and paths in quotes"],
    ),
    ("\"scene.xml\"\nsteps", "\"C:\\users\\scene.xml\"\nsteps", &["line 1: ", "write paths with /"]),
    (
        "steps = 2",
        "steps = 2,",
        &["line 2: `steps = 2,` is not TOML", "lines end without a comma or semicolon"],
    ),
    (
        "steps = 2",
        "steps = 2;",
        &["line 2: `steps = 2;` is not TOML", "lines end without a comma or semicolon"],
    ),
    ("steps = 2", "steps: 2", &["line 2: `steps: 2` is not TOML", "write KEY = VALUE"]),
    ("rate = 0.04", "rate = 0.04\nuniform = True", &["line 14: ", "write true and false in small letters"]),
    // Names of parameters.
    (
        "block.translation",
        "block.position",
        &["line 12: `block.position` names no parameter; did you mean `block.translation`?"],
    ),
    (
        "block.translation",
        "block",
        &[
            "line 12: `block` names no parameter; it is an object, a dot and a kind, such as `block.translation`",
        ],
    ),
    (
        "block.translation",
        "block.pose",
        &["a pose is two parameters, `block.translation` and `block.rotation`"],
    ),
    ("block.translation", "block.color", &["did you mean `block.reflectance`?"]),
    ("block.translation", "block.reflectance", &["what belongs to it has `metal.reflectance`"]),
    ("block.translation", "Block.translation", &["nothing is called `Block`; did you mean `block`"]),
    (
        "block.translation",
        "block.translation.x",
        &["line 12: `block.translation.x` is one number, but its start has 3"],
    ),
    ("block.translation", "metal.texture", &["`metal` is a material"]),
    // Views and pictures.
    (
        "[[parameter]]",
        "[[view]]\norigin = [0, 1, 4]\n[[view]]\norigin = [1, 1, 4]\n[[parameter]]\nname = \"camera.translation\"\nrate = 1\n[[parameter]]",
        &[
            "line 16: `camera.translation` is a parameter of the scene's own camera, so there can be only one [[view]]",
            "here are 2 views",
        ],
    ),
    (
        REFERENCE,
        "[[view]]\nname = \"front\"\ntarget = \"phot.png\"\n",
        &["view `front`: target = \"phot.png\": there is no phot.png in /", "did you mean photo.png?"],
    ),
    (
        REFERENCE,
        "[[view]]\ntarget = \"photos/a.png\"\n",
        &[
            "view `1`: target = \"photos/a.png\": there is no folder photos",
            "relative to the folder of the configuration",
        ],
    ),
    (REFERENCE, "[[view]]\ntarget = \".\"\n", &["view `1`: target = \".\" is a folder"]),
    (
        REFERENCE,
        "[[view]]\ntarget = \"photo.png\"\n",
        &["photo.png: the picture is 8 × 8 pixels, but view `1` is 6 × 6", "width = 8"],
    ),
    (REFERENCE, "", &["there are no targets: add a [[view]] with a target"]),
    (
        "[[parameter]]",
        "[[view]]\nlook_at = [0, 1, 4]\n[[parameter]]",
        &["view 1 has look_at or up, but no origin"],
    ),
    (
        "scene = \"scene.xml\"\nsteps",
        "scene = \"sheet.obj\"\nsteps",
        &["sheet.obj is a mesh, not a scene: `volume3d new sheet.obj`"],
    ),
    (
        "scene = \"scene.xml\"\nsteps",
        "scene = \".\"\nsteps",
        &[". is a folder, not a scene; in it: ./scene.xml"],
    ),
];

#[test]
fn mistakes_in_a_configuration_are_answered() {
    let place = Place::new();
    write_png(&place.path("photo.png"), &Image::constant(8, 8, DVec3::splat(0.5))).unwrap();
    let mut faults = vec![];
    for (what, instead, words) in CHANGED {
        let config = FIT.replacen(what, instead, 1);
        assert_ne!(config, FIT, "{what}");
        std::fs::write(place.path("fit.toml"), config).unwrap();
        let (code, text) = place.run("fit fit.toml -o run");
        if code != 1 || words.iter().any(|word| !text.contains(word)) || text.contains("panicked") {
            faults.push(format!("{instead:?}: exit {code}, expected {words:?}:\n  {text}"));
        }
    }
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), CHANGED.len(), faults.join("\n"));
    assert!(!place.path("run").exists());
}

/// Line ends, byte order marks and encodings of other systems are read, or named in the error.
#[test]
fn files_of_other_editors_are_read_or_named() {
    let place = Place::new();
    let write = |bytes: &[u8]| std::fs::write(place.path("fit.toml"), bytes).unwrap();
    for text in
        [FIT.replace('\n', "\r\n"), format!("\u{feff}{FIT}"), FIT.replace("{ spp = 2 }", "{ spp = 2, }")]
    {
        write(text.as_bytes());
        place.succeed("fit fit.toml -o run");
        std::fs::remove_dir_all(place.path("run")).unwrap();
    }
    let utf16: Vec<u8> =
        std::iter::once(0xfeff).chain(FIT.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    write(&utf16);
    place.fail("fit fit.toml -o run", 1, &["fit.toml is text in UTF-16: save it as UTF-8"]);
    write(&[FIT.as_bytes(), b"# caf\xe9\n"].concat());
    place.fail("fit fit.toml -o run", 1, &["fit.toml: line 15 is not UTF-8"]);
    write(b"");
    place.fail("fit fit.toml -o run", 1, &["there is no `scene` at the top of the file"]);
    write(b"{\"scene\": \"scene.xml\"}");
    place.fail("fit fit.toml -o run", 1, &["not JSON"]);
}

/// Every command that takes a scene, with what is none.
#[test]
fn what_is_no_scene_is_called_by_its_name() {
    let place = Place::new();
    std::fs::write(place.path("fit.toml"), FIT).unwrap();
    place.write_adjoint(vec![DVec3::ONE; 64]);
    std::fs::write(place.path("notes.txt"), "to do").unwrap();
    for (file, words) in [
        ("sheet.obj", "sheet.obj is a mesh, not a scene: `volume3d new sheet.obj` writes a scene for it"),
        (
            "fit.toml",
            "fit.toml is the configuration of a fit, not a scene: `volume3d fit fit.toml -o run` runs it",
        ),
        ("paper.png", "paper.png is a picture, not a scene"),
        ("notes.txt", "notes.txt is not a scene: a scene is Mitsuba XML and begins with <scene"),
        (".", ". is a folder, not a scene; in it: ./scene.xml"),
        ("none.xml", "cannot read none.xml"),
    ] {
        for line in [
            "render FILE -o a.exr",
            "gradient FILE --move block:translate:1,0,0 -o a.exr",
            "gradient FILE --adjoint adj.exr --wrt block.translation -o a.npy",
            "check FILE --move block:translate:1,0,0",
            "tune FILE --move block:translate:1,0,0",
            "info FILE",
            "lint FILE",
        ] {
            place.fail(&line.replace("FILE", file), 1, &[words]);
        }
    }
    for (file, words) in [
        ("scene.xml", "scene.xml is a scene, not the configuration of a fit: `volume3d fit --example"),
        ("sheet.obj", "sheet.obj is a mesh: `volume3d new sheet.obj` writes a scene and a configuration"),
        (".", ". is a folder, not the configuration of a fit; in it: ./fit.toml"),
    ] {
        place.fail(&format!("fit {file} -o run"), 1, &[words]);
    }
}
