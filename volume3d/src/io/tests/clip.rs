//! Clipping planes of a camera: refused if they cut something.

use glam::DVec3;

use super::message;
use super::scene::read;
use crate::io::Error;
use crate::scene::Description;

/// A film of 40 × 20 pixels and a camera at the origin that looks along z, with x to the left; half the
/// film's width is visible at x = z.
fn scene(sensor: &str, film: &str, shapes: &str) -> Result<Description, Error> {
    read(&format!(
        "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='90'/>{sensor}\n\
         <film type='hdrfilm'><integer name='width' value='40'/><integer name='height' value='20'/>{film}</film>\
         </sensor>{shapes}</scene>"
    ))
}

const BOX: &str = "<rfilter type='box'/>";

fn near(distance: f64) -> String {
    format!("\n<float name='near_clip' value='{distance}'/>")
}

fn far(distance: f64) -> String {
    format!("\n<float name='far_clip' value='{distance}'/>")
}

/// A square with a side of 2 `size` perpendicular to the optical axis.
fn wall(size: f64, [x, y, z]: [f64; 3]) -> String {
    format!(
        "<shape type='rectangle' id='wall'><transform name='to_world'><scale value='{size}'/>\
         <translate x='{x}' y='{y}' z='{z}'/></transform></shape>"
    )
}

/// A floor at height y that extends by 50 in all directions.
fn floor(y: f64) -> String {
    format!(
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='50'/>\
         <rotate x='1' angle='-90'/><translate y='{y}'/></transform></shape>"
    )
}

#[test]
fn a_floor_below_and_behind_the_camera_is_accepted() {
    // It enters the view at z = 1/0.575: a pixel is 0.05 at z = 1, and the Gaussian extends 1.5 pixels beyond
    // the border.
    scene(&near(0.01), "", &floor(-1.0)).unwrap();
    scene(&near(1.7), "", &floor(-1.0)).unwrap();
    let text = message(scene(&near(1.75), "", &floor(-1.0)));
    let expected = "dir/s.xml:2:1: near_clip=\"1.75\" cuts off shape \"floor\", which the film has in view at a distance \
        of 1.739 along the optical axis; clipping is not supported: remove from the scene what is not to be seen, or \
        leave near_clip out to see it";
    assert_eq!(text, expected);
    // A camera in the plane of the floor sees it as a line.
    scene(&near(0.01), "", &floor(0.0)).unwrap();
}

#[test]
fn a_wall_beyond_far_clip_is_refused() {
    let wall = wall(1.0, [0.0, 0.0, 20.0]);
    scene(&far(20.0), "", &wall).unwrap();
    let text = message(scene(&far(10.0), "", &wall));
    let start = "dir/s.xml:2:1: far_clip=\"10\" cuts off shape \"wall\", which the film has in view at a distance of 20 ";
    assert!(text.starts_with(start), "{text}");
}

#[test]
fn the_worst_shape_is_named() {
    let walls = [12.0, 30.0, 20.0].map(|z| wall(1.0, [0.0, 0.0, z]).replace("'wall'", &format!("'at{z}'")));
    let text = message(scene(&far(10.0), "", &walls.concat()));
    assert!(text.contains("shape \"at30\"") && text.contains("of 30 along"), "{text}");
}

#[test]
fn what_crosses_a_plane_counts_in_view_only() {
    // Rotated about the vertical: from z = 0.5 at x = 1.5 to z = 3.5 at x = −1.5.
    let across = |x: f64| {
        format!(
            "<shape type='rectangle'><transform name='to_world'><scale x='2.12132' y='0.1'/>\
             <rotate y='1' angle='45'/><translate x='{x}' z='2'/></transform></shape>"
        )
    };
    scene(&near(0.4), "", &across(0.0)).unwrap();
    assert!(message(scene(&near(1.5), "", &across(0.0))).contains("shape \"shape_0\""));
    scene(&near(1.5), "", &across(9.0)).unwrap();
    scene(&near(1.5), "", &across(-9.0)).unwrap();
    // Behind the camera.
    scene(&(near(1.0) + &far(2.0)), "", &wall(9.0, [0.0, 0.0, -3.0])).unwrap();
}

/// The walls at z = 20 begin at the border of the view: at x = ±20 with a box filter, two pixels of size 1
/// beyond with a Gaussian, and at the crop window.
#[test]
fn the_view_ends_with_the_film_and_the_reach_of_its_filter() {
    let accepted = |film: &str, x: f64, y: f64| scene(&far(10.0), film, &wall(1.0, [x, y, 20.0])).is_ok();
    for side in [-1.0, 1.0] {
        assert!(accepted(BOX, 21.0 * side, 0.0) && !accepted(BOX, 20.99 * side, 0.0));
        assert!(accepted(BOX, 0.0, 11.0 * side) && !accepted(BOX, 0.0, 10.99 * side));
        assert!(accepted("", 22.5 * side, 0.0) && !accepted("", 22.49 * side, 0.0));
        assert!(accepted("", 0.0, 12.5 * side) && !accepted("", 0.0, 12.49 * side));
    }
    // Columns 30 to 34 and rows 0 to 4: x from −10 to −15, as x points to the left, and y from 10 to 5.
    let crop = [("offset_x", 30), ("offset_y", 0), ("width", 5), ("height", 5)]
        .map(|(name, value)| format!("<integer name='crop_{name}' value='{value}'/>"))
        .concat();
    let film = BOX.to_owned() + &crop;
    assert!(!accepted(&film, -12.0, 7.0) && accepted(&film, 12.0, 7.0) && accepted(&film, -12.0, -7.0));
    assert!(accepted(&film, -9.0, 7.0) && !accepted(&film, -9.01, 7.0));
    assert!(accepted(&film, -12.0, 4.0) && !accepted(&film, -12.0, 4.01));
}

/// An orthographic sensor sees nothing behind it, and objects in front of it at the same size at any
/// distance.
#[test]
fn orthographic_sensors() {
    let scene = |sensor: &str, shapes: &str| {
        read(&format!(
            "<scene version='3.0.0'><sensor type='orthographic'><transform name='to_world'><scale x='3' y='2'/>\
             <lookat origin='1 2 3' target='1 2 4' up='0 1 0'/></transform>{sensor}\
             <film type='hdrfilm'><integer name='width' value='40'/><integer name='height' value='20'/>{BOX}</film>\
             </sensor>{shapes}</scene>"
        ))
    };
    let camera = scene("", "").unwrap().camera;
    assert_eq!(camera.pixel_aspect, 1.5);
    // Half the width and height of the film at some depths: 3, and half of 2 because it has half as many
    // rows.
    let [wide, tall] = [camera.right, camera.up].map(DVec3::normalize);
    let half = (0.5 * camera.field_of_view).tan();
    for depth in [0.0, 10.0, 30.0] {
        let point = DVec3::new(1.0, 2.0, 3.0 + depth) - 3.0 * DVec3::X + DVec3::Y;
        let way = point - camera.origin;
        let z = way.dot(camera.forward);
        let (x, y) = (way.dot(wide) / (z * half), way.dot(tall) * camera.pixel_aspect / (z * half));
        assert!((x - 1.0).abs() < 2e-3 && (y - 0.5).abs() < 1e-3, "{depth}: {x} {y}");
    }
    let behind = wall(0.5, [1.0, 2.0, 2.0]);
    let text = message(scene("", &behind));
    assert!(text.contains("near_clip=\"default\" cuts off shape \"wall\""), "{text}");
    assert!(scene("", &wall(0.5, [9.0, 2.0, 2.0])).is_ok(), "it is beside what is in view");
    assert!(scene(&far(5.0), &wall(0.5, [1.0, 2.0, 7.0])).is_ok());
    assert!(scene(&far(5.0), &wall(0.5, [1.0, 2.0, 8.1])).is_err());
    let sheared = "<scene version='3.0.0'><sensor type='orthographic'><transform name='to_world'>\
                   <matrix value='1 .5 0  0 1 0  0 0 1'/></transform></sensor></scene>";
    assert!(message(read(sheared)).contains("scales along x, y and z"));
}
