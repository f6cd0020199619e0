//! Messages of files that are refused.

use super::super::check_messages;
use super::*;

/// The message about a changed file, without the name of the folder.
fn changed(name: &str, change: &dyn Fn(&str) -> String) -> String {
    let fixture = Fixture::new();
    let text = std::fs::read_to_string(fixture.path(name)).unwrap();
    let new = change(&text);
    assert!(new != text, "{name} is as before");
    fixture.write(name, new);
    of(&fixture, name)
}

fn of(fixture: &Fixture, name: &str) -> String {
    let photos = [0, 1].map(|i| fixture.path(&format!("photos/{i}.png")));
    let views = match name {
        "transforms.json" => Views::from_transforms(&fixture.path(name)),
        "scene.xml" => Views::from_sensors(&fixture.path(name), &[], &photos),
        name => fixture.colmap(name.split('/').next().unwrap()),
    };
    without(fixture.0.path(), &message(views))
}

#[test]
fn transforms_name_the_frame() {
    let with = |old: &'static str, new: &'static str| {
        changed("transforms.json", &move |text| text.replacen(old, new, 1))
    };
    let here = "HERE/transforms.json";
    let cases = [
        (
            with("\"k1\": 0.0", "\"k1\": 0.03"),
            format!(
                "{here}, frame 0: a lens with k1 = 0.03, and only pictures of pinhole cameras are read; undistort them first, with `colmap image_undistorter`"
            ),
        ),
        (
            with("\"k1\": 0.0", "\"camera_model\": \"OPENCV_FISHEYE\""),
            format!(
                "{here}, frame 0: the camera is \"OPENCV_FISHEYE\", which is no pinhole camera; undistort the pictures first, with `colmap image_undistorter`"
            ),
        ),
        (
            with("\"k1\": 0.0", "\"is_fisheye\": true"),
            format!(
                "{here}, frame 0: the camera is a fisheye, which is no pinhole camera; undistort the pictures first, with `colmap image_undistorter`"
            ),
        ),
        (
            with("\"frames\"", "\"views\""),
            format!("{here}: there is no \"frames\"; expected a list of objects"),
        ),
        (
            with("\"h\": 60", "\"h\": 60.5"),
            format!("{here}, frame 0: \"h\" is 60.5, but must be a whole number of pixels from 1 to 2^31"),
        ),
        (
            with("\"h\": 60, ", ""),
            format!("{here}, frame 0: there is no \"h\", but a \"w\"; expected both or neither"),
        ),
        (
            with("\"h\": 60", "\"h\": 61"),
            format!(
                "{here}, frame 0: its picture HERE/./photos/0.png has 80×60 pixels, but its camera 80×61, which is another shape; expected the same size or a copy in fewer pixels"
            ),
        ),
        (
            with("\"fl_x\": 95.0", "\"fl_x\": \"95\""),
            format!("{here}, frame 0: \"fl_x\" is \"95\", but must be a number greater than 0"),
        ),
        (
            with("\"fl_x\": 104.50000000000001", "\"fl_x\": -1"),
            format!("{here}, frame 1: \"fl_x\" is -1, but must be a number greater than 0"),
        ),
        (
            with("\"fl_x\": 95.0, ", ""),
            format!(
                "{here}, frame 0: there is no \"fl_x\"; expected a focal length in pixels, or \"camera_angle_x\" in radians, of the frame or the file"
            ),
        ),
        (
            with("\"fl_x\": 95.0", "\"fl_x\": 1e-320"),
            format!(
                "{here}, frame 0: the focal lengths [1e-320, 101.5] and the principal point [36.25, 32.75] are none of a camera"
            ),
        ),
        (
            with("./photos/1", "./photos/2"),
            format!("{here}, frame 1: cannot read HERE/./photos/2: No such file or directory (os error 2)"),
        ),
        (with("./photos/1", "./photos/0"), format!("{here}: there are two views called `photos/0`")),
        (with("[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0]"), String::new()),
        (changed("transforms.json", &|_| "{\"frames\": []}".into()), format!("{here}: there are no images")),
        (
            changed("transforms.json", &|_| "[1]".into()),
            format!("{here}: the file is [1], but must be an object with \"frames\""),
        ),
        (
            changed("transforms.json", &|_| "{\"frames\": [".into()),
            format!("{here}: not valid JSON: EOF while parsing a list at line 1 column 12"),
        ),
        (
            changed("transforms.json", &|_| "{\"frames\": [{\"transform_matrix\": 1}]}".into()),
            format!("{here}, frame 0: there is no \"file_path\"; expected the path of a picture"),
        ),
    ];
    let (shown, others): (Vec<_>, Vec<_>) = cases.into_iter().partition(|(_, expected)| !expected.is_empty());
    check_messages(
        &shown.iter().map(|(found, expected)| (found.clone(), expected.as_str())).collect::<Vec<_>>(),
    );
    for (found, _) in others {
        assert!(found.ends_with("but must be 4 rows of 4 finite numbers, the last 0, 0, 0, 1"), "{found}");
    }
    let mirrored = "{\"fl_x\": 9, \"frames\": [{\"file_path\": \"a\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,-1,0]]}]}";
    let found = changed("transforms.json", &|_| mirrored.into());
    assert_eq!(
        found,
        format!(
            "{here}, frame 0: \"transform_matrix\" is [[1,0,0,0],[0,1,0,0],[0,0,-1,0]], but must be a rotation and a position: columns that are orthogonal, right-handed and of one length"
        )
    );
}

#[test]
fn colmap_names_the_line() {
    let cameras = |old: &'static str, new: &'static str| {
        changed("text/cameras.txt", &move |text| text.replacen(old, new, 1))
    };
    let images = |old: &'static str, new: &'static str| {
        changed("text/images.txt", &move |text| text.replacen(old, new, 1))
    };
    let cases = [
        (
            cameras(" 0 0 0.0 0", " 0.03 0 0 0"),
            "HERE/text/cameras.txt:2: camera 4 is OPENCV with k1 = 0.03, and only pictures of pinhole cameras are read; undistort them first, with `colmap image_undistorter`",
        ),
        (
            cameras("OPENCV", "OPENCV_FISHEYE"),
            "HERE/text/cameras.txt:2: camera 4 is OPENCV_FISHEYE, which is no pinhole camera; undistort the pictures first, with `colmap image_undistorter`",
        ),
        (
            cameras("OPENCV", "PINHOLE"),
            "HERE/text/cameras.txt:2: what follows the 4 of the model is 0 0 0.0 0, but must be nothing",
        ),
        (
            cameras("OPENCV", "PANORAMA"),
            "HERE/text/cameras.txt:2: the camera's model is PANORAMA, but must be a model of COLMAP, such as PINHOLE",
        ),
        (
            cameras(" 0 0 0.0 0", ""),
            "HERE/text/cameras.txt:2: there is no k1; expected cameras as `ID MODEL WIDTH HEIGHT PARAMETERS`, images as `ID QW QX QY QZ TX TY TZ CAMERA NAME`",
        ),
        (
            cameras("4 OPENCV 80", "4 OPENCV 0"),
            "HERE/text/cameras.txt:2: the width is 0, but must be a whole number of pixels, at least 1",
        ),
        (cameras("4 OPENCV", "3 OPENCV"), "HERE/text/cameras.txt:3: there are two cameras 3"),
        (
            cameras("4 OPENCV", "5 OPENCV"),
            "HERE/text/images.txt:3: its camera 4 is not in HERE/text/cameras.txt",
        ),
        (
            cameras("36.25", "inf"),
            "HERE/text/cameras.txt:3: cx of camera 3 is inf, but must be a finite number",
        ),
        (
            images(" photos/1.png", ""),
            "HERE/text/images.txt:3: there is no the picture's name; expected cameras as `ID MODEL WIDTH HEIGHT PARAMETERS`, images as `ID QW QX QY QZ TX TY TZ CAMERA NAME`",
        ),
        (
            images("9 ", "nine "),
            "HERE/text/images.txt:3: the image's number is nine, but must be a whole number from 0 to 2^32 − 1",
        ),
        (changed("text/images.txt", &|_| "# none\n".into()), "HERE/text/images.txt: there are no images"),
        (
            changed("text/images.txt", &|_| "1 0 0 0 0 0 0 0 3 photos/0.png\n\n".into()),
            "HERE/text/images.txt:1: the quaternion is [0.0, 0.0, 0.0, 0.0], but must be finite numbers, not all 0",
        ),
    ];
    check_messages(&cases);
    let far = changed("text/images.txt", &|_| "1 1 0.4 0 0 0 1.7e308 1.7e308 3 photos/0.png\n\n".into());
    assert!(far.starts_with("HERE/text/images.txt:1: the translation is [0.0, 1.7e308, 1.7e308]"), "{far}");
    let fixture = Fixture::new();
    std::fs::remove_file(fixture.path("text/cameras.txt")).unwrap();
    let none = of(&fixture, "text");
    assert_eq!(
        none,
        "HERE/text: there is no camera file; expected cameras.bin and images.bin, or cameras.txt and images.txt, which COLMAP writes to a folder such as sparse/0"
    );
}

#[test]
fn binary_files_name_the_item() {
    let with = |name: &'static str, change: &dyn Fn(&mut Vec<u8>)| {
        let fixture = Fixture::new();
        let mut bytes = std::fs::read(fixture.path(name)).unwrap();
        change(&mut bytes);
        fixture.write(name, bytes);
        of(&fixture, name)
    };
    let cases = [
        (
            with("binary/cameras.bin", &|b| b.truncate(100)),
            "HERE/binary/cameras.bin: the file ends within camera 1 (from 0) of 2",
        ),
        (
            with("binary/cameras.bin", &|b| b.push(0)),
            "HERE/binary/cameras.bin: 1 bytes follow the last camera",
        ),
        (
            with("binary/cameras.bin", &|b| b[12] = 99),
            "HERE/binary/cameras.bin, camera 0: the model is 99, but must be the number of one, 0 to 11",
        ),
        (
            with("binary/cameras.bin", &|b| b[..8].fill(255)),
            "HERE/binary/cameras.bin: the file ends within camera 2 (from 0) of 18446744073709551615",
        ),
        (
            with("binary/images.bin", &|b| b[12..44].fill(255)),
            "HERE/binary/images.bin, image 0: the quaternion is [NaN, NaN, NaN, NaN], but must be finite numbers, not all 0",
        ),
        (
            with("binary/images.bin", &|b| b.truncate(90)),
            "HERE/binary/images.bin: the file ends within image 0 (from 0) of 2",
        ),
    ];
    check_messages(&cases);
}

#[test]
fn sensors_and_special_files() {
    let fixture = Fixture::new();
    let one = message(Views::from_sensors(&fixture.path("scene.xml"), &[], &[fixture.path("photos/0.png")]));
    assert!(one.ends_with("there are 2 sensors, but 1 pictures; expected one for each, in order"), "{one}");
    let found = changed("scene.xml", &|text| text.replace("'perspective'", "'fisheye'"));
    assert!(found.starts_with("2 problems:\n  HERE/scene.xml:1:"), "{found}");
    #[cfg(unix)]
    {
        let refused = "it is a pipe or a device, and only regular files are read";
        let pipe = |name: &str| {
            std::fs::remove_file(fixture.path(name)).unwrap();
            std::os::unix::net::UnixListener::bind(fixture.path(name)).unwrap()
        };
        for name in ["transforms.json", "scene.xml", "text/images.txt", "binary/images.bin"] {
            let _socket = pipe(name);
            let found = of(&fixture, name);
            assert!(found.ends_with(refused), "{name}: {found}");
        }
        let fixture = Fixture::new();
        std::fs::remove_file(fixture.path("photos/0.png")).unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(fixture.path("photos/0.png")).unwrap();
        let found = of(&fixture, "text");
        assert!(found.ends_with(refused), "{found}");
    }
}
