//! Files that would take all memory, or have no end, or never begin.

use std::io::Write as _;
use std::process::Command;
use std::time::{Duration, Instant};

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder, ZlibEncoder};

use super::Place;

/// Address space of the program, in KiB: less than any of these files becomes.
const ADDRESSES: usize = 1_500_000;

/// What `info` says of a scene with a shape and a texture, in little memory and short time.
fn info(place: &Place, more: &str, defines: &str) -> (Option<i32>, String) {
    let scene = String::from_utf8(place.bytes("scene.xml")).unwrap();
    let file = scene.replace("<!-- more -->", more).replace("<default", &format!("{defines}<default"));
    std::fs::write(place.path("hostile.xml"), file).unwrap();
    let line = format!(
        "ulimit -v {ADDRESSES}; RAYON_NUM_THREADS=1 exec timeout 20 {} info hostile.xml",
        env!("CARGO_BIN_EXE_volume3d")
    );
    let folder = place.path("");
    let output = Command::new("sh").args(["-c", &line]).current_dir(folder).output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

fn shape(kind: &str, file: &str) -> String {
    format!("<shape type='{kind}'><string name='filename' value='{file}'/></shape>")
}

/// Some bytes, many times.
fn repeated(head: &[u8], bytes: &[u8], times: usize) -> Vec<u8> {
    [head, &bytes.repeat(times)].concat()
}

#[cfg(unix)]
#[test]
fn small_files_stay_small() {
    let place = Place::with("<!-- more -->");
    let write = |name: &str, bytes: &[u8]| std::fs::write(place.path(name), bytes).unwrap();

    // Values made of values: 10¹² bytes.
    let mut defines = "<default name='a0' value='aaaaaaaaaa'/>".to_owned();
    for k in 0..11 {
        defines += &format!("<default name='a{}' value='{}'/>", k + 1, format!("$a{k}").repeat(10));
    }
    let (code, text) = info(&place, "<shape type='cube' id='$a11'/>", &defines);
    assert!(code == Some(1) && text.contains("more than 67108864 bytes of values of $names"), "{text}");

    // 2 GiB of empty lines, in parts that are alike.
    let mut part = GzEncoder::new(vec![], Compression::best());
    part.write_all(&vec![b'\n'; 1 << 24]).unwrap();
    let part = part.finish().unwrap();
    write("lines.obj", &repeated(&[], &part, 128));
    let (code, text) = info(&place, &shape("obj", "lines.obj"), "");
    assert!(code == Some(1) && text.contains("lines.obj: it becomes larger than "), "{text}");

    // A colour profile of 2 GiB.
    let mut part = DeflateEncoder::new(vec![], Compression::best());
    part.write_all(&vec![0; 1 << 24]).unwrap();
    part.flush().unwrap();
    let profile = repeated(b"p\0\0\x78\xda", part.get_ref(), 128);
    let mut bytes = vec![];
    let mut writer = png::Encoder::new(&mut bytes, 1, 1).write_header().unwrap();
    writer.write_chunk(png::chunk::iCCP, &profile).unwrap();
    writer.write_image_data(&[128]).unwrap();
    writer.finish().unwrap();
    write("profile.png", &bytes);
    let textured = "<bsdf type='diffuse'><texture type='bitmap' name='reflectance'>\
                    <string name='filename' value='profile.png'/></texture></bsdf>";
    let (code, text) = info(&place, &format!("<shape type='cube'>{textured}</shape>"), "");
    assert!(code == Some(0) && text.contains("of 1 × 1"), "{text}");

    // A name of 100 million bytes.
    let mut name = ZlibEncoder::new(vec![], Compression::best());
    name.write_all(&[0; 4]).unwrap();
    name.write_all(&vec![b'a'; 100_000_000]).unwrap();
    write("name.serialized", &repeated(&[0x1C, 0x04, 4, 0], &name.finish().unwrap(), 1));
    let start = Instant::now();
    let (code, text) = info(&place, &shape("serialized", "name.serialized"), "");
    assert!(code == Some(1) && text.contains("expected a name of at most 4096 bytes"), "{text}");
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());

    // 200,000 properties.
    let properties: String = (0..200_000).map(|k| format!("property float p{k}\n")).collect();
    write("many.ply", format!("ply\nformat ascii 1.0\nelement vertex 3\n{properties}").as_bytes());
    let (code, text) = info(&place, &shape("ply", "many.ply"), "");
    assert!(code == Some(1) && text.contains("many.ply:1004: expected at most 1000 properties"), "{text}");
    let elements: String = (0..2000).map(|k| format!("element e{k} 0\n")).collect();
    write("many.ply", format!("ply\nformat ascii 1.0\n{elements}").as_bytes());
    let (code, text) = info(&place, &shape("ply", "many.ply"), "");
    assert!(code == Some(1) && text.contains("many.ply:1003: expected at most 1000 elements"), "{text}");
}

/// Wherever a file is read.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused() {
    let place = Place::with("<!-- more -->");
    let made = Command::new("mkfifo").arg(place.path("pipe")).status().unwrap();
    assert!(made.success());
    let link = |name: &str, to: &str| std::os::unix::fs::symlink(to, place.path(name)).unwrap();
    for name in ["p.xml", "p.obj", "p.ply", "p.png", "p.exr", "p.npy", "p.toml", "p.serialized", "p.vol"] {
        link(name, "pipe");
    }
    link("zero.xml", "/dev/zero");
    link("zero.ply", "/dev/zero");
    let refused = |line: &str| {
        let mut command = Command::new("timeout");
        let inner = place.command(line);
        command.arg("20").arg(inner.get_program()).args(inner.get_args()).current_dir(place.path(""));
        let output = command.output().unwrap();
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        let says = text.contains("it is a pipe or a device, and only regular files are read");
        assert!(output.status.code() == Some(1) && says, "{line}: {:?} {text}", output.status);
    };
    for line in [
        "info p.xml",
        "info zero.xml",
        "lint p.xml",
        "render p.xml -o a.exr",
        "gradient scene.xml --adjoint p.exr --wrt camera.fov -o a.npy",
        "gradient scene.xml --adjoint p.npy --wrt camera.fov -o a.npy",
        "sdf p.obj -o a.vol",
        "sdf zero.ply -o a.vol",
        "fit p.toml -o run",
    ] {
        refused(line);
    }
    let scene = String::from_utf8(place.bytes("scene.xml")).unwrap();
    let bitmap = "<shape type='cube'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'>\
                  <string name='filename' value='p.png'/></texture></bsdf></shape>";
    for more in [
        shape("obj", "p.obj"),
        shape("ply", "zero.ply"),
        shape("serialized", "p.serialized"),
        bitmap.to_owned(),
        "<include filename='p.xml'/>".to_owned(),
    ] {
        std::fs::write(place.path("hostile.xml"), scene.replace("<!-- more -->", &more)).unwrap();
        refused("info hostile.xml");
    }
    let config = "scene = 'scene.xml'\nsteps = 1\n[[parameter]]\nname = 'camera.fov'\nrate = 1\n[[view]]\n";
    for key in ["target = 'p.png'", "target = 'p.exr'"] {
        std::fs::write(place.path("f.toml"), format!("{config}{key}")).unwrap();
        refused("fit f.toml -o run");
    }
}

/// What cannot be had is refused before the work.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_missed_before_the_work() {
    let place = Place::new();
    for (size, code) in [(2048, 1), (256, 0)] {
        let line = format!(
            "ulimit -v {ADDRESSES}; exec {} gradient scene.xml --move camera:fov:1 -D size={size} --spp 1 --threads 1 \
             --method interior -o a.exr",
            env!("CARGO_BIN_EXE_volume3d")
        );
        let output = Command::new("sh").args(["-c", &line]).current_dir(place.path("")).output().unwrap();
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert_eq!(output.status.code(), Some(code), "{text}");
        let is_refused = text.contains("may need 2.3 GiB of memory, more than the available 1.");
        assert_eq!(is_refused, code == 1, "{text}");
    }
}

/// A grid with what is made of it, before its file is read; the file has a size and nothing in it.
#[cfg(target_os = "linux")]
#[test]
fn grids_that_do_not_fit_are_missed_before_they_are_read() {
    let place = Place::with("<!-- more -->");
    std::fs::File::create(place.path("huge.vol")).unwrap().set_len(800_000_000).unwrap();
    let (code, text) = info(&place, &shape("sdfgrid", "huge.vol"), "");
    assert!(code == Some(1) && text.contains("it needs 2.2 GiB of memory, and 1."), "{text}");
}

/// Where coordinates have lost their digits, boxes with their rounding all meet one another.
#[test]
fn far_spheres_take_no_longer() {
    let place = Place::with(
        "<shape type='sphere' id='far'><point name='center' x='1e30' y='0' z='0'/><ref id='plain'/></shape>",
    );
    let start = Instant::now();
    place.succeed("gradient scene.xml --move sheet:translate:1,0,0 --spp 1 --threads 1 -o a.exr");
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
}
