//! What is refused or stopped, and says so.

use glam::DVec3;
use volume3d::Image;
use volume3d::io::write_exr;

use super::Place;

#[test]
fn failures_say_what_to_do() {
    let place = Place::new();
    std::fs::write(place.path("bad.xml"), "<scene version='3.0.0'>\n<shape type='sfere'/></scene>").unwrap();
    let image =
        |width: usize, value: f64| Image { width, height: 8, pixels: vec![DVec3::splat(value); width * 8] };
    write_exr(&place.path("narrow.exr"), &image(7, 1.0)).unwrap();
    write_exr(&place.path("nan.exr"), &image(8, f64::NAN)).unwrap();
    place.write_adjoint(vec![DVec3::ONE; 64]);
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
        ("render scene.xml -o paper.png", 1, "is an input and will not be overwritten"),
        ("render scene.xml -o a.exr -D nothing=1", 1, "nothing"),
        ("render scene.xml -o a.exr -D nothing", 2, "NAME=VALUE"),
        ("render scene.xml -o a.exr --spp 0", 2, "whole number from 1"),
        ("render scene.xml -o a.exr --spp 1 --stderr e.exr", 1, "at least 2 samples"),
        ("render scene.xml -o a.exr --threads 0", 2, "--threads"),
        ("render scene.xml", 2, "--output"),
        ("paint scene.xml", 2, "paint"),
        ("gradient scene.xml -o a.exr", 2, "--move, or --adjoint"),
        ("gradient scene.xml -o a.exr", 2, "Usage: volume3d gradient"),
        ("gradient scene.xml --move sheet:jump:1 -o a.exr", 2, "THING:translate:x,y,z"),
        ("gradient scene.xml --move sheet:translate:1,2 -o a.exr", 2, "three numbers"),
        ("gradient scene.xml --move sheet:scale:0,0,0:nan -o a.exr", 2, "finite number"),
        (
            "gradient scene.xml --move sheat:translate:1,0,0 -o a.exr",
            1,
            "nothing is called `sheat`; did you mean `sheet`",
        ),
        (
            "gradient scene.xml --move mettle:roughness:1 -o a.exr",
            1,
            "objects with a parameter `roughness`: `metal`",
        ),
        ("gradient scene.xml --move sheet:vertex:6:1,0,0 -o a.exr", 1, "its 6 vertices count from 0"),
        (
            "gradient scene.xml --move sheet:radiance:1,0,0 -o a.exr",
            1,
            "closest first, objects with a parameter `radiance`: `lamp`",
        ),
        (
            "gradient scene.xml --move paper:reflectance:1,0,0 -o a.exr",
            1,
            "--move paper takes `paper:texture:r,g,b`",
        ),
        (
            "gradient scene.xml --move plain:roughness:1 -o a.exr",
            1,
            "objects with a parameter `roughness`: `metal`",
        ),
        ("gradient scene.xml --move lamp:irradiance:1,1,1 -o a.exr", 1, "takes `lamp:vertex:INDEX:x,y,z`"),
        ("gradient scene.xml --move paper:texture:2,0:1,0,0 -o a.exr", 1, "it is 2 × 1, counted from 0"),
        (&format!("{moved} -o a.exr --method magic"), 2, "warped-area"),
        (&format!("{moved} -o a.exr --step 0.1"), 2, "--method finite-difference"),
        (&format!("{moved} -o a.exr --method interior --aux 4"), 2, "--method warped-area"),
        (&format!("{moved} -o a.exr --method finite-difference --terms t"), 2, "--terms"),
        (&format!("{moved} -o a.exr --step -1 --method finite-difference"), 2, "positive"),
        (&format!("{moved} -o a.exr --terms none/t"), 1, "there is no folder none"),
        (&format!("{moved} -o a.exr --adjoint adj.exr --wrt camera.fov"), 2, "cannot be used with"),
        (&format!("{reverse} -o a.npy"), 2, "--wrt"),
        (&format!("{reverse} --wrt sheet -o a.npy"), 2, "such as `sheet.translation`"),
        (&format!("{reverse} --wrt sheet.texture -o a.npy"), 1, "what belongs to it has `plain.reflectance`"),
        (&format!("{reverse} --wrt sheet.translation.r -o a.npy"), 1, "has the components x, y and z"),
        (
            &format!("{reverse} --wrt plain.texture -o a.npy"),
            1,
            "objects with a parameter `texture`: `paper`",
        ),
        (&format!("{reverse} --wrt camera.fov -o a.exr"), 1, "is written as .npy"),
        (&format!("{reverse} --wrt camera.fov --wrt sheet.vertex_positions -o a.npy"), 1, "need a folder"),
        (&format!("{reverse} --wrt camera.fov --method finite-difference -o a.npy"), 2, "no reverse mode"),
        ("gradient scene.xml --adjoint narrow.exr --wrt camera.fov -o a.npy", 1, "7 × 8 pixels"),
        ("gradient scene.xml --adjoint nan.exr --wrt camera.fov -o a.npy", 1, "column 0, row 0"),
        ("gradient scene.xml --adjoint sheet.obj --wrt camera.fov -o a.npy", 1, "sheet.obj"),
        ("check scene.xml", 2, "--move"),
        (
            "check scene.xml --move lamp:radiance:1,1,1 --method finite-difference",
            2,
            "the reference of a check",
        ),
        ("info none.xml", 1, "none.xml"),
    ];
    for (line, code, message) in cases {
        place.fail(line, code, &[message]);
    }
    for name in ["a.exr", "a.npy", "a.png"] {
        assert!(!place.path(name).exists(), "{name} was written by a run that failed");
    }
    assert_eq!(place.bytes("scene.xml"), before);
}

#[test]
fn what_no_warp_sees_is_refused_by_name() {
    let beam = "<emitter type='spot' id='beam'><transform name='to_world'><lookat origin='0,0,2' target='0,0,0' up='0,1,0'/></transform>
      <float name='cutoff_angle' value='12'/><float name='beam_width' value='12'/></emitter>";
    let place = Place::with(beam);
    let moved = "gradient scene.xml --move sheet:translate:1,0,0 -o a.exr";
    place.fail(moved, 1, &["the light of `beam` ends abruptly"]);
    let text = place.succeed(&format!("{moved} --method interior"));
    assert!(text.contains("WARNING: the interior term alone is biased"), "{text}");
    place.succeed(&format!("{moved} --method finite-difference"));
    let refused = place.fail(moved, 1, &[]);
    let linted = place.fail("lint scene.xml --move sheet:translate:1,0,0", 1, &["WRONG: "]);
    let reason = linted.lines().find_map(|line| line.strip_prefix("WRONG: ")).unwrap();
    assert!(refused.contains(reason), "{refused} {linted}");
    assert!(!place.succeed("lint scene.xml --move beam:intensity:1,1,1").contains("WRONG"));
}

#[test]
fn edge_sampling_refuses_lights_without_extent() {
    let place =
        Place::with("<emitter type='point' id='bulb'><point name='position' value='0,0,2'/></emitter>");
    let moved = "gradient scene.xml --move sheet:translate:1,0,0 -o a.exr --spp 2";
    place.succeed(moved);
    assert!(!place.fail(&format!("{moved} --method edge"), 1, &["`bulb`"]).contains("kappa"));
    assert!(!place.succeed("lint scene.xml --move sheet:translate:1,0,0").contains("WRONG"));
    assert!(place.succeed("info scene.xml").contains("light `bulb` has no extent"));
    // Its light falls on a sheet before a wall: it casts a shadow.
    let shifted = "gradient scene.xml --move bulb:translate:1,0,0 -o a.exr --spp 2";
    place.succeed(shifted);
    let edges = format!("{shifted} --method edge");
    place.fail(&edges, 1, &["point light `bulb` casts shadows without a penumbra"]);
    let text = place.succeed(&format!("{edges} --allow-missing point-light"));
    assert!(text.contains("the motion of the shadows of point light `bulb`"), "{text}");
    place.write_adjoint(vec![DVec3::ONE; 64]);
    let reverse = "gradient scene.xml --adjoint adj.exr --wrt bulb.translation -o a.npy --spp 2";
    place.succeed(reverse);
    let edges = format!("{reverse} --method edge");
    place.fail(&edges, 1, &["point light `bulb` casts shadows without a penumbra"]);
    place.succeed(&format!("{edges} --allow-missing point-light"));
}

/// A slab whose front is flush with that of the table on which it slides.
#[test]
fn motions_without_a_derivative_are_warned_of() {
    let block = |id: &str, half: &str, centre: &str| {
        format!(
            "<shape type='cube' id='{id}'><transform name='to_world'><scale value='{half}'/><translate value='{centre}'/>\
             </transform><ref id='plain'/></shape>"
        )
    };
    let place =
        Place::with(&(block("table", ".5,.1,.3", "0,-.5,.3") + &block("slab", ".2,.1,.1", "0,-.3,.5")));
    let moved = |along: &str| {
        place.succeed(&format!(
            "gradient scene.xml --move slab:translate:{along} --method edge --spp 1 -o a.exr"
        ))
    };
    let edges = "edges of shapes `table` and `slab` coincide (1 pair of triangles, such as ";
    let planes = "WARNING: shapes `table` and `slab` cover the same part of a plane";
    assert!(!moved("1,0,0").contains("WARNING: "));
    assert!(moved("0,0,1").contains(edges));
    let lifted = moved("0,1,0");
    assert!(lifted.contains(planes) && !lifted.contains("edges of"), "{lifted}");

    // `lint` says of a motion what `gradient` says of it.
    let warned = |text: &str| {
        let advice = "; move one of them a little";
        let lines = text.lines().filter_map(|line| line.strip_prefix("WARNING: ")?.strip_suffix(advice));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    for along in ["1,0,0", "0,0,1", "0,1,0", "0,1,1"] {
        let line = format!("lint scene.xml --move slab:translate:{along}");
        let expected = warned(&moved(along));
        let text = if expected.is_empty() { place.succeed(&line) } else { place.fail(&line, 1, &[]) };
        let found: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("WRONG: ")).collect();
        assert_eq!(found, expected, "{along}: {text}");
    }
    let text = place.succeed("lint scene.xml");
    assert!(text.contains("hint: shapes `table` and `slab` cover the same part of a plane"), "{text}");

    place.write_adjoint(vec![DVec3::ONE; 64]);
    let reverse = |wrt: &str| {
        let line = "gradient scene.xml --adjoint adj.exr --method edge --spp 1 -o a.npy";
        place.succeed(&format!("{line} --wrt {wrt}"))
    };
    assert!(reverse("slab.vertex_positions").contains(planes));
    assert!(!reverse("back.vertex_positions").contains("WARNING: "));
}

#[test]
fn what_cannot_be_held_is_refused_and_nothing_is_sent_to_the_terminal() {
    let place = Place::new();
    place.fail("render scene.xml -o a.exr -D size=65536", 1, &["more than the available", "crop_width"]);
    std::fs::write(place.path("bad.xml"), "<scene version='3.0.0'><shape type='\u{7f}\u{85}'/></scene>")
        .unwrap();
    let text = place.fail("render bad.xml -o a.exr", 1, &[]);
    assert!(!text.chars().any(|c| c.is_control() && c != '\n'), "{text:?}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_the_old_file() {
    use super::signals::{send, wait_until_listening};
    use std::time::{Duration, Instant};

    let place = Place::new();
    let commands = [
        "render scene.xml -o old.exr -D size=256 --spp 20000",
        "gradient scene.xml --move sheet:translate:1,0,0 -o old.exr -D size=256 --spp 20000",
        "check scene.xml --move sheet:translate:1,0,0 -D size=256 --spp 200000",
        "tune scene.xml --move sheet:translate:1,0,0 -D size=256 --budget 1000 -o old.svg",
    ];
    for line in commands {
        std::fs::write(place.path("old.exr"), "old").unwrap();
        let pipe = std::process::Stdio::piped;
        let child = place.command(line).stdout(pipe()).stderr(pipe()).spawn().unwrap();
        let pid = child.id();
        wait_until_listening(pid);
        let start = Instant::now();
        send("-INT", pid);
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{line}: {text}");
        assert!(text.contains("nothing was written"), "{line}: {text}");
        assert!(start.elapsed() < Duration::from_secs(20), "{line}: {:?}", start.elapsed());
        assert_eq!(place.bytes("old.exr"), b"old", "{line}");
        assert_eq!(
            std::fs::read_dir(place.path("")).unwrap().count(),
            4,
            "{line}: something was left behind"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_said_is_an_error() {
    let place = Place::with("<shape type='cube'><bsdf type='strange'/></shape>");
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    for line in ["info scene.xml --lenient", "info --support"] {
        let output = place.command(line).stdout(full()).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains("error: cannot write to standard output: No space left"), "{line}: {text}");
        assert_eq!(output.status.code(), Some(1), "{line}");
    }
    // Notes that nobody can read are no reason to stop.
    let output = place.command("info scene.xml --lenient").stderr(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stdout));
}

/// Whoever asks for the light of something by another name is given its own.
#[test]
fn light_has_the_name_of_its_kind() {
    let place =
        Place::with("<emitter type='constant' id='sky'><rgb name='radiance' value='1,1,1'/></emitter>");
    place.write_adjoint(vec![DVec3::ONE; 64]);
    for (id, what) in [("sky", "a constant environment"), ("lamp", "a shape that emits")] {
        for kind in ["irradiance", "intensity"] {
            let (words, parameter) =
                (format!("`{id}` is {what}, whose parameters are "), format!("`{id}.radiance`"));
            let reverse = format!("gradient scene.xml --adjoint adj.exr --wrt {id}.{kind} -o a.npy");
            place.fail(&reverse, 1, &[&words, &parameter]);
            let forward = format!("gradient scene.xml --move {id}:{kind}:1,1,1 -o a.exr");
            place.fail(&forward, 1, &[&words, &parameter, &format!("`{id}:radiance:r,g,b`")]);
        }
    }
}

/// What is written goes through a link to what that leads to, keeps a file's mode, and replaces no pipe.
#[cfg(unix)]
#[test]
fn links_and_modes_stay() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    let place = Place::new();
    std::fs::create_dir(place.path("below")).unwrap();
    std::fs::write(place.path("below/old.exr"), "old").unwrap();
    let mode = std::fs::Permissions::from_mode(0o640);
    std::fs::set_permissions(place.path("below/old.exr"), mode).unwrap();
    symlink("below/old.exr", place.path("link.exr")).unwrap();
    symlink("below/new.exr", place.path("ahead.exr")).unwrap();
    symlink("none/new.exr", place.path("lost.exr")).unwrap();
    for name in ["link.exr", "ahead.exr"] {
        place.succeed(&format!("render scene.xml -o {name} --spp 1"));
        assert!(place.path(name).is_symlink(), "{name}");
    }
    assert_eq!(place.exr("below/old.exr"), place.exr("below/new.exr"));
    let found = place.path("below/old.exr").metadata().unwrap().permissions().mode();
    assert_eq!(found & 0o777, 0o640, "{found:o}");
    place.fail("render scene.xml -o lost.exr --spp 1", 1, &["there is no folder none; create it first"]);
    place.fail("render scene.xml -o link.exr --png below/old.exr", 1, &["--png writes .png"]);
    let twice = "render scene.xml -o ahead.exr --stderr below/new.exr --spp 2";
    place.fail(twice, 1, &["would be written twice"]);
    assert!(std::process::Command::new("mkfifo").arg(place.path("pipe.exr")).status().unwrap().success());
    place.fail("render scene.xml -o pipe.exr", 1, &["is a pipe or a device"]);
}
