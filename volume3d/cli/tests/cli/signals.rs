//! Ctrl-C, SIGTERM and SIGHUP, at any moment; and two processes at one run.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::Place;

/// Waits until the process has a handler for SIGINT, as Linux tells; two seconds elsewhere.
pub(crate) fn wait_until_listening(pid: u32) {
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

pub(crate) fn send(signal: &str, pid: u32) {
    assert!(Command::new("kill").args([signal, &pid.to_string()]).status().unwrap().success());
}

fn start(command: &mut Command) -> Child {
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// What it says and its status, after a signal.
fn ended(child: Child, signal: &str) -> (Option<i32>, String, Duration) {
    let now = Instant::now();
    send(signal, child.id());
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap(), now.elapsed())
}

/// A sheet with waves, of a number of squares along each side.
fn waves(side: u32) -> Vec<u8> {
    let vertices = (side + 1) * (side + 1);
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        2 * side * side
    )
    .into_bytes();
    let at = |k: u32| k as f32 / side as f32 - 0.5;
    for (i, j) in (0..=side).flat_map(|j| (0..=side).map(move |i| (i, j))) {
        let z = 0.02 * (40.0 * at(i)).sin() * (50.0 * at(j)).cos();
        [at(i), at(j), z].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
        let corner = |i: u32, j: u32| j * (side + 1) + i;
        for triangle in [
            [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)],
            [corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)],
        ] {
            bytes.push(3);
            triangle.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
        }
    }
    bytes
}

/// A scene of which the preparation takes several seconds ends a moment after a signal.
#[test]
fn what_is_prepared_is_stopped() {
    let place = Place::with(
        "<shape type='ply' id='waves'><string name='filename' value='waves.ply'/><ref id='plain'/></shape>",
    );
    std::fs::write(place.path("waves.ply"), waves(1000)).unwrap();
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let line = "gradient scene.xml --move waves:translate:1,0,0 -o a.exr --spp 1";
        let child = start(&mut place.command(line));
        wait_until_listening(child.id());
        let (status, text, time) = ended(child, signal);
        assert!(status == Some(code) && text.contains("stopped; nothing was written"), "{status:?} {text}");
        // Half a second, and more on a machine that does other things.
        assert!(time < Duration::from_secs(10), "{signal}: {time:?}");
        assert!(!place.path("a.exr").exists());
    }
}

/// `nohup` has SIGHUP ignored.
#[cfg(target_os = "linux")]
#[test]
fn a_hangup_that_is_ignored_stays_ignored() {
    let place = Place::new();
    let line = format!(
        "trap '' HUP; exec {} render scene.xml -o a.exr --spp 20000 -D size=64",
        env!("CARGO_BIN_EXE_volume3d")
    );
    let child = start(Command::new("sh").args(["-c", &line]).current_dir(place.path("")));
    wait_until_listening(child.id());
    send("-HUP", child.id());
    std::thread::sleep(Duration::from_millis(100));
    let (status, text, _) = ended(child, "-TERM");
    assert_eq!(status, Some(143), "{text}");
}

const CONFIG: &str = "scene = 'scene.xml'\nsteps = 100000\ngradient = { spp = 1, method = 'warped-area' }\n\
    [reference]\nscene = 'scene.xml'\nspp = 4\n[[parameter]]\nname = 'block.translation'\nrate = 0.001\nstart = [0.1, 0, 0]\n";

/// The folder of a run has one process; one that was killed is in nobody's way.
#[test]
fn a_run_has_one_process() {
    let place = Place::new();
    std::fs::write(place.path("a.toml"), CONFIG).unwrap();
    std::fs::write(place.path("b.toml"), CONFIG.replace("0.001", "0.002")).unwrap();
    let has_begun = || place.path("run/frames/00000000.png").exists();
    let begin = || {
        let mut child = start(&mut place.command("fit a.toml -o run"));
        while !has_begun() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        wait_until_listening(child.id());
        child
    };
    let mut first = begin();
    for other in ["a", "b"] {
        let words = ["another process uses the run folder run; wait for it, or choose another folder"];
        place.fail(&format!("fit {other}.toml -o run"), 1, &words);
    }
    first.kill().unwrap();
    first.wait().unwrap();
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let child = begin();
        // Long enough for some steps.
        std::thread::sleep(Duration::from_millis(300));
        let (status, text, _) = ended(child, signal);
        assert!(status == Some(code) && text.contains("the same command continues"), "{status:?} {text}");
        assert!(place.path("run/state.bin").exists());
    }
}
