//! `volume3d new`: from a mesh to a scene and a fit that run.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::DVec3;
use volume3d::io::load_scene;
use volume3d::scene::Scene;

use super::Place;

/// A box of three different sides with one corner cut off, so that no turn leaves it as it was, at a place
/// and of a size.
fn mesh(centre: DVec3, size: f64) -> String {
    let corners = [
        [-0.5, -0.3, -0.4],
        [0.5, -0.3, -0.4],
        [0.1, 0.3, -0.4],
        [-0.5, 0.3, -0.4],
        [-0.5, -0.3, 0.4],
        [0.5, -0.3, 0.4],
        [0.5, 0.1, 0.4],
        [-0.5, 0.3, 0.4],
    ];
    let mut text = String::new();
    for corner in corners {
        let p = centre + size * DVec3::from_array(corner);
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for [a, b, c, d] in [[1, 4, 3, 2], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]] {
        text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    text
}

/// Whether every vertex of a shape is within the picture of the scene's camera, and the lamp is not.
fn is_framed(scene: &Scene, id: &str) -> bool {
    let d = scene.description();
    let camera = &d.camera;
    let slope = (0.5 * camera.field_of_view).tan();
    let seen = |p: DVec3| {
        let v = p - camera.origin;
        let depth = v.dot(camera.forward);
        depth > 0.0 && v.dot(camera.right).abs() < slope * depth && v.dot(camera.up).abs() < slope * depth
    };
    let all = |id: &str| d.shapes.iter().find(|s| s.id == id).unwrap().mesh.positions().to_vec();
    all(id).into_iter().all(seen) && !all("lamp").into_iter().any(seen)
}

#[test]
fn a_mesh_becomes_a_scene_and_a_fit_that_succeeds() {
    let place = Place::new();
    std::fs::write(place.path("part.obj"), mesh(DVec3::new(3.0, -2.0, 1.0), 2.0)).unwrap();
    let text = place.succeed("new part.obj");
    assert!(text.contains("part.obj: 12 triangles, 2.0000 × 1.2000 × 1.6000 units, named `part`"), "{text}");
    let commands: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("  volume3d ")).collect();
    assert_eq!(commands.len(), 3, "{text}");
    assert!(is_framed(&Scene::new(load_scene(&place.path("part/scene.xml")).unwrap()).unwrap(), "part"));
    // What it says to run runs as it is, but for smaller pictures in the fit.
    let fit = String::from_utf8(place.bytes("part/fit.toml")).unwrap();
    assert_eq!(fit.matches("size = \"64\"").count(), 2, "{fit}");
    std::fs::write(place.path("part/fit.toml"), fit.replace("size = \"64\"", "size = \"32\"")).unwrap();
    for command in commands {
        let text = place.succeed(command);
        assert!(!text.contains("WARNING"), "{command}: {text}");
    }
    // The pose is found: the start was 0.16 units and 19° away.
    let result = String::from_utf8(place.bytes("part/run/result.toml")).unwrap();
    let number = |key: &str| -> f64 {
        let line = result.lines().find_map(|line| line.strip_prefix(&format!("{key} = "))).unwrap();
        line.parse().unwrap()
    };
    assert!(number("moved") < 0.03 && number("degrees") < 2.0, "{result}");
    assert!(result.contains("reached = true"), "{result}");
}

#[test]
fn nothing_is_overwritten_without_being_asked() {
    let place = Place::new();
    std::fs::write(place.path("part.obj"), mesh(DVec3::ZERO, 1.0)).unwrap();
    let scene = place.bytes("scene.xml");
    place.fail("new part.obj -o .", 1, &["scene.xml exists: --force replaces it"]);
    assert_eq!(place.bytes("scene.xml"), scene);
    assert!(!place.path("fit.toml").exists());
    place.succeed("new part.obj -o a/b");
    std::fs::write(place.path("a/b/fit.toml"), "mine").unwrap();
    std::fs::remove_file(place.path("a/b/scene.xml")).unwrap();
    place.fail("new part.obj -o a/b", 1, &["a/b/fit.toml exists"]);
    assert_eq!(place.bytes("a/b/fit.toml"), b"mine");
    place.succeed("new part.obj -o a/b --force");
    assert_ne!(place.bytes("a/b/fit.toml"), b"mine");
}

#[test]
fn meshes_as_people_have_them() {
    let place = Place::new();
    let gzip = |text: &str| {
        let mut gz = GzEncoder::new(vec![], Compression::default());
        gz.write_all(text.as_bytes()).unwrap();
        gz.finish().unwrap()
    };
    let small = mesh(DVec3::new(4.5e5, -2e5, 4.5e5), 1e-3);
    for (name, bytes, up, id, note) in [
        ("far.obj", small.clone().into_bytes(), "y", "far", "moves `far` to the origin"),
        ("zipped.obj.gz", gzip(&small), "z", "zipped", "moves `zipped` to the origin"),
        ("huge.obj", mesh(DVec3::ZERO, 1e9).into_bytes(), "z", "huge", "scales it by"),
        ("my part (2).obj", mesh(DVec3::ONE, 0.01).into_bytes(), "y", "my_part__2_", ""),
        ("camera.obj", mesh(DVec3::ONE, 50.0).into_bytes(), "z", "mesh_camera", ""),
    ] {
        std::fs::write(place.path(name), bytes).unwrap();
        let mut command = place.command("new");
        let output = command.args([name, "-o", id, "--up", up]).output().unwrap();
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert!(output.status.success() && text.contains(note), "{name}: {text}");
        let scene = Scene::new(load_scene(&place.path(&format!("{id}/scene.xml"))).unwrap()).unwrap();
        assert!(is_framed(&scene, id), "{name}");
        // Neither a face nor a shadow is lost to rounding.
        let text = place.succeed(&format!("render {id}/scene.xml -o {id}/image.exr --spp 4 -D size=16"));
        assert!(!text.contains("WARNING") && !text.contains("not finite"), "{name}: {text}");
        let image = place.exr(&format!("{id}/image.exr"));
        let middle = image.pixels[8 * 16 + 8];
        assert!(middle.x > 1.3 * middle.z && middle.min_element() > 0.02, "{name}: {middle}");
        place.succeed(&format!("lint {id}/scene.xml --move {id}:translate:1,0,0"));
    }
    for (name, text, words) in [
        ("none.obj", None, "cannot read none.obj"),
        ("empty.obj", Some(""), "empty.obj"),
        ("point.obj", Some("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"), "point.obj"),
        ("a.stl", Some("solid"), "a.stl is a mesh in an unsupported format: save it as OBJ or PLY"),
        ("a.txt", Some("v"), "a.txt"),
    ] {
        if let Some(text) = text {
            std::fs::write(place.path(name), text).unwrap();
        }
        place.fail(&format!("new {name} -o out"), 1, &[words]);
        assert!(!place.path("out").exists(), "{name}");
    }
    place.fail("new scene.xml", 1, &["scene.xml is already a scene: `volume3d render scene.xml"]);
}
