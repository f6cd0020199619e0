//! Animated transforms.

use glam::DVec3;

use super::scene::read;
use super::{check_messages, here, message};
use crate::io::{Note, ReadOptions, read_scene_with};
use crate::scene::Description;

fn scene(shutter: &str, keys: &str) -> String {
    format!(
        "<scene version='3.0.0'><sensor type='perspective'>{shutter}</sensor><shape type='cube'><animation \
         name='to_world'>{keys}</animation></shape></scene>"
    )
}

fn open_from(open: f64, close: f64) -> String {
    format!("<float name='shutter_open' value='{open}'/><float name='shutter_close' value='{close}'/>")
}

const KEYS: &str = "<transform time='0'><translate x='1'/></transform><transform time='1'><scale value='3'/><translate \
                    x='5'/></transform>";

fn lenient(text: &str, is_lenient: bool) -> (Description, Vec<Note>) {
    let options = ReadOptions { is_lenient, ..ReadOptions::default() };
    let none = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    read_scene_with(text.as_bytes(), here("dir/s.xml"), &options, &none).unwrap()
}

/// The centre of the first shape, and half its width.
fn box_of(d: &Description) -> (DVec3, f64) {
    let positions = d.shapes[0].mesh.positions();
    let low = positions.iter().copied().reduce(DVec3::min).unwrap();
    let high = positions.iter().copied().reduce(DVec3::max).unwrap();
    (0.5 * (low + high), 0.5 * (high - low).x)
}

#[test]
fn an_animation_is_still_at_the_time_of_the_shutter() {
    for (shutter, x, half) in [
        (String::new(), 1.0, 1.0),
        (open_from(-3.0, -3.0), 1.0, 1.0),
        (open_from(0.25, 0.25), 2.0, 1.5),
        (open_from(1.0, 1.0), 5.0, 3.0),
        (open_from(9.0, 9.0), 5.0, 3.0),
    ] {
        let (description, notes) = lenient(&scene(&shutter, KEYS), false);
        let (middle, width) = box_of(&description);
        assert!((middle - x * DVec3::X).length() < 1e-12 && (width - half).abs() < 1e-12, "{middle} {width}");
        assert!(notes.iter().any(|note| note.text.starts_with("the animation is still, as it is at ")));
    }
    // A single transform is static.
    let one = scene(&open_from(0.0, 1.0), "<transform time='0.5'><translate x='2'/></transform>");
    assert!((box_of(&read(&one).unwrap()).0 - 2.0 * DVec3::X).length() < 1e-12);
}

/// An object that moves while the shutter is open would be blurred: it is refused, and in lenient mode
/// evaluated at the middle of that time.
#[test]
fn blur_is_refused() {
    let text = scene(&open_from(0.0, 1.0), KEYS);
    let (description, notes) = lenient(&text, true);
    assert!((box_of(&description).0 - 3.0 * DVec3::X).length() < 1e-12);
    assert!(notes.iter().any(|note| note.text.contains("the middle of the time")), "{notes:?}");
    let refused = |keys: &str| message(read(&scene("", keys)));
    let place = "dir/s.xml:1:79: ";
    check_messages(&[
        (
            message(read(&text)).split_once(": ").unwrap().1.to_owned(),
            "an <animation> while the shutter is open from 0 to 1 is not supported; give shutter_open and \
             shutter_close one value, or read leniently, at the middle of the two",
        ),
        (
            refused(""),
            &format!(
                "{place}an <animation> without a <transform time=\"…\"> is not supported; give two or more"
            ),
        ),
        (
            refused("<transform time='1'/><transform time='0'/>").split_once(": ").unwrap().1.to_owned(),
            "time=\"0\": expected a time after that of the transform before",
        ),
        (
            refused("<transform/>").split_once(": ").unwrap().1.to_owned(),
            "<transform> needs an attribute \"time\"",
        ),
        (
            refused("<translate x='1'/>").split_once(": ").unwrap().1.to_owned(),
            "<translate> within <animation> is not supported; give <transform time=\"…\">",
        ),
    ]);
}
