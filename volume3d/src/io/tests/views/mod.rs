//! Pictures with cameras: every format, by its own definition, of the same cameras.

mod refused;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flatland::calculus::Vec3;
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};
use image::{Luma, Rgb, RgbImage};
use tempfile::TempDir;

use super::dtu::{Stored, npy, npz};
use super::message;
use crate::geometry::Mesh;
use crate::gradient::{FilmPlane, Progress, render};
use crate::io::views::{LookAt, PosedPicture, Views};
use crate::scene::{Camera, Description, Environment, Film, Filter, Material, Scene};

const SIZE: (u32, u32) = (80, 60);

/// A camera by the definitions of COLMAP: x_cam = R x + t, u = f_x x/z + c_x, v = f_y y/z + c_y.
#[derive(Clone, Copy)]
pub(super) struct Known {
    turn: DQuat,
    center: DVec3,
    focal: DVec2,
    principal: DVec2,
}

/// Two cameras whose principal points are off the middle, and whose pixels are not square.
pub(super) fn known() -> [Known; 2] {
    [(DVec3::new(0.8, 0.9, -5.0), 0.1, 1.0), (DVec3::new(-4.0, 1.5, 2.0), -0.4, 1.1)].map(
        |(center, roll, scale)| {
            let z = -center.normalize();
            let right = DVec3::Y.cross(z).normalize();
            let frame = DMat3::from_cols(-right, -z.cross(right), z).transpose();
            Known {
                turn: DQuat::from_rotation_z(roll) * DQuat::from_mat3(&frame),
                center,
                focal: DVec2::new(95.0, 101.5) * scale,
                principal: DVec2::new(36.25, 32.75) * scale,
            }
        },
    )
}

impl Known {
    fn rotation(&self) -> DMat3 {
        DMat3::from_quat(self.turn)
    }

    fn translation(&self) -> DVec3 {
        -(self.rotation() * self.center)
    }

    /// Pixels from the top left corner.
    fn project(&self, x: DVec3) -> DVec2 {
        let p = self.rotation() * x + self.translation();
        self.focal * p.truncate() / p.z + self.principal
    }
}

fn row(numbers: impl IntoIterator<Item = f64>, between: &str) -> String {
    numbers.into_iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(between)
}

/// `transforms.json` with intrinsics of the first camera for the file, and of the others for their frames.
pub(super) fn transforms(known: &[Known]) -> String {
    let intrinsics = |k: &Known| {
        let numbers = [k.focal.x, k.focal.y, k.principal.x, k.principal.y];
        let keys = ["fl_x", "fl_y", "cx", "cy"].iter().zip(numbers);
        keys.map(|(key, x)| format!("\"{key}\": {x:?}, ")).collect::<String>()
    };
    let mut frames = vec![];
    for (i, k) in known.iter().enumerate() {
        // The camera's right, up and back are the columns, and rows of R right, down and forward.
        let r = k.rotation();
        let columns = [r.row(0), -r.row(1), -r.row(2), k.center];
        let rows = [0, 1, 2].map(|j| format!("[{}]", row(columns.map(|c| c[j]), ", ")));
        let own = if i == 0 { String::new() } else { intrinsics(k) };
        frames.push(format!(
            "{{\"file_path\": \"./photos/{i}\", {own}\"transform_matrix\": [{}, [0.0, 0.0, 0.0, 1.0]]}}",
            rows.join(", ")
        ));
    }
    let (w, h) = SIZE;
    format!(
        "{{\"w\": {w}, \"h\": {h}, {}\"k1\": 0.0, \"aabb_scale\": 16, \"frames\": [\n{}\n]}}",
        intrinsics(&known[0]),
        frames.join(",\n")
    )
}

/// `cameras.txt` and `images.txt`, the images from the last to the first.
pub(super) fn colmap_text(known: &[Known]) -> [Vec<u8>; 2] {
    let (mut cameras, mut images) = ("# Camera list\n".to_owned(), "# Image list\n\n".to_owned());
    for (i, k) in known.iter().enumerate().rev() {
        let intrinsics = [k.focal.x, k.focal.y, k.principal.x, k.principal.y];
        let (model, zeros) = if i == 0 { ("PINHOLE", "") } else { ("OPENCV", " 0 0 0.0 0") };
        writeln!(cameras, "{} {model} {} {} {}{zeros}", i + 3, SIZE.0, SIZE.1, row(intrinsics, " ")).unwrap();
        let q = [k.turn.w, k.turn.x, k.turn.y, k.turn.z];
        let pose = row(q.into_iter().chain(k.translation().to_array()), " ");
        let points = if i == 0 { "" } else { "1.5 2.5 -1 7.25 8.5 12" };
        writeln!(images, "{} {pose} {} photos/{i}.png\n{points}", 10 - i, i + 3).unwrap();
    }
    [cameras.into_bytes(), images.into_bytes()]
}

/// `cameras.bin` and `images.bin`.
pub(super) fn colmap_binary(known: &[Known]) -> [Vec<u8>; 2] {
    let count = (known.len() as u64).to_le_bytes().to_vec();
    let (mut cameras, mut images) = (count.clone(), count);
    for (i, k) in known.iter().enumerate() {
        let id = (i as u32 + 3).to_le_bytes();
        cameras.extend(id);
        cameras.extend(1_i32.to_le_bytes());
        cameras.extend([SIZE.0, SIZE.1].iter().flat_map(|n| u64::from(*n).to_le_bytes()));
        let intrinsics = [k.focal.x, k.focal.y, k.principal.x, k.principal.y];
        cameras.extend(intrinsics.iter().flat_map(|x| x.to_le_bytes()));
        images.extend((10 - i as u32).to_le_bytes());
        let q = [k.turn.w, k.turn.x, k.turn.y, k.turn.z];
        images.extend(q.iter().chain(&k.translation().to_array()).flat_map(|x| x.to_le_bytes()));
        images.extend(id);
        images.extend(format!("photos/{i}.png\0").bytes());
        images.extend(2_u64.to_le_bytes());
        images.extend([7; 48]);
    }
    [cameras, images]
}

/// A scene with two sensors and a shape whose file there is not.
pub(super) fn sensors(known: &[Known]) -> String {
    let mut text =
        "<scene version='3.0.0'><shape type='obj'><string name='filename' value='none.obj'/></shape>"
            .to_owned();
    for (i, k) in known.iter().enumerate() {
        let fov = 2.0 * (0.5 * f64::from(SIZE.0) / k.focal.x).atan().to_degrees();
        let offset = 0.5 - k.principal / DVec2::new(SIZE.0.into(), SIZE.1.into());
        // Mitsuba's sensors have x to the left, y up, and look along z.
        let r = k.rotation();
        let columns = [-r.row(0), -r.row(1), r.row(2), k.center];
        let rows = [0, 1, 2].map(|j| row(columns.map(|c| c[j]), " "));
        write!(
            text,
            "<sensor type='perspective' id='{i}'><float name='fov' value='{fov:?}'/>\
             <float name='principal_point_offset_x' value='{:?}'/><float name='principal_point_offset_y' value='{:?}'/>\
             <float name='pixel_aspect' value='{:?}'/><transform name='to_world'><matrix value='{} 0 0 0 1'/></transform>\
             <film type='hdrfilm'><integer name='width' value='{}'/><integer name='height' value='{}'/></film></sensor>",
            offset.x, offset.y, k.focal.y / k.focal.x, rows.join(" "), SIZE.0, SIZE.1
        )
        .unwrap();
    }
    text + "</scene>"
}

fn projection(k: &Known) -> DMat4 {
    // Pixel centres have whole coordinates there.
    let principal = k.principal - 0.5;
    let intrinsics = DMat3::from_cols(DVec3::X * k.focal.x, DVec3::Y * k.focal.y, principal.extend(1.0));
    let [turned, shift] =
        [intrinsics * k.rotation(), DMat3::from_cols(intrinsics * k.translation(), DVec3::ZERO, DVec3::ZERO)];
    let [x, y, z] = [turned.x_axis, turned.y_axis, turned.z_axis].map(|axis| axis.extend(0.0));
    DMat4::from_cols(x, y, z, shift.x_axis.extend(1.0))
}

/// A folder with pictures and every format, and the views of each.
struct Fixture(TempDir);

impl Fixture {
    fn new() -> Self {
        let fixture = Self(tempfile::tempdir().unwrap());
        let known = known();
        for folder in ["photos", "text", "binary", "dtu", "dtu/image", "dtu/mask"] {
            std::fs::create_dir(fixture.path(folder)).unwrap();
        }
        for i in 0..known.len() {
            let picture =
                RgbImage::from_fn(SIZE.0, SIZE.1, |x, _| Rgb([if x % 2 == 0 { 255 } else { 0 }; 3]));
            picture.save(fixture.path(&format!("photos/{i}.png"))).unwrap();
            picture.save(fixture.path(&format!("dtu/image/{i}.png"))).unwrap();
            picture.save(fixture.path(&format!("dtu/mask/{i}.png"))).unwrap();
        }
        fixture.write("transforms.json", transforms(&known));
        fixture.write("scene.xml", sensors(&known));
        for (folder, extension, files) in
            [("text", "txt", colmap_text(&known)), ("binary", "bin", colmap_binary(&known))]
        {
            for (name, content) in ["cameras", "images"].iter().zip(files) {
                fixture.write(&format!("{folder}/{name}.{extension}"), content);
            }
        }
        let members = known.iter().enumerate().flat_map(|(i, k)| {
            [("world_mat", projection(k)), ("scale_mat", DMat4::IDENTITY)]
                .map(|(kind, matrix)| (format!("{kind}_{i}.npy"), npy(matrix, Stored::Double)))
        });
        fixture.write("dtu/cameras.npz", npz(&members.collect::<Vec<_>>(), false));
        fixture
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    fn colmap(&self, model: &str) -> Result<Views, crate::io::Error> {
        Views::from_colmap(&self.path(model), Some(self.0.path()))
    }

    fn all(&self) -> [(&'static str, Views); 5] {
        let photos = [0, 1].map(|i| self.path(&format!("photos/{i}.png")));
        [
            ("transforms", Views::from_transforms(&self.path("transforms.json")).unwrap()),
            ("text", self.colmap("text").unwrap()),
            ("binary", self.colmap("binary").unwrap()),
            ("dtu", Views::from_dtu(&self.path("dtu")).unwrap()),
            ("sensors", Views::from_sensors(&self.path("scene.xml"), &[], &photos).unwrap()),
        ]
    }
}

fn film((width, height): (usize, usize)) -> Film {
    Film { width, height, crop: None, sample_border: true, filter: Filter::Box }
}

/// Where the library's camera sees a point.
fn seen(camera: &Camera, size: (usize, usize), x: DVec3) -> DVec2 {
    let scene = Scene::new(Description::new(camera.clone(), film(size))).unwrap();
    let plane = FilmPlane::new(&scene);
    DVec2::from_array(plane.project(&plane.still, Vec3::constant(x)))
}

/// Corners of a cube.
fn corners() -> impl Iterator<Item = DVec3> {
    (0..8).map(|i| DVec3::from_array([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -0.7 } else { 0.7 })))
}

#[test]
fn every_format_sees_a_cube_where_its_definition_does() {
    let fixture = Fixture::new();
    let mut worst = 0.0_f64;
    for (format, views) in fixture.all() {
        assert_eq!(views.list.len(), 2, "{format}");
        for (i, (view, known)) in views.list.iter().zip(known()).enumerate() {
            assert!(view.name.ends_with(&i.to_string()), "{format}: {}", view.name);
            assert!(view.picture.ends_with(format!("{i}.png")) && (view.width, view.height) == (80, 60));
            for x in corners() {
                let error = (seen(&view.camera, (80, 60), x) - known.project(x)).length();
                worst = worst.max(error);
                assert!(error < 1e-9, "{format}, view {i}: {error} at {x}");
            }
            let found = view.camera.calibration(DVec2::new(80.0, 60.0)).unwrap();
            assert!(found.rotation.abs_diff_eq(known.rotation(), 1e-12), "{format}, view {i}: {found:?}");
            assert!(found.focal.abs_diff_eq(known.focal, 1e-9), "{format}, view {i}: {found:?}");
            assert!(found.principal.abs_diff_eq(known.principal, 1e-9), "{format}, view {i}: {found:?}");
            assert!(corners().all(|x| (0.0..80.0).contains(&known.project(x).x)), "the cube is out of sight");
        }
        assert!(views.files.iter().all(|file| file.exists()), "{format}");
        // DTU has the same masks as pictures.
        let mask = views.list[0].load_mask().unwrap();
        assert_eq!(mask.is_some(), format == "dtu");
    }
    println!("largest error {worst:e} pixels");
}

#[test]
fn every_format_renders_the_same_picture() {
    let fixture = Fixture::new();
    let picture = |view: &PosedPicture| {
        let mut description = Description::new(view.camera.clone(), film((view.width, view.height)));
        let white = description.add_material(Material::diffuse("white", DVec3::splat(0.7)));
        description.add_shape("cube", Mesh::cube(), white);
        let radiance = DVec3::new(0.5, 0.7, 0.9);
        description.environment = Some(Environment::Constant { id: "sky".into(), radiance });
        render(&Scene::new(description).unwrap(), 2, 1, &Progress::none()).unwrap().image
    };
    let [(_, first), others @ ..] = fixture.all();
    for (i, view) in first.list.iter().enumerate() {
        let expected = picture(view);
        let (low, high) =
            expected.pixels.iter().fold((1.0_f64, 0.0_f64), |m, p| (m.0.min(p.x), m.1.max(p.x)));
        assert!(high - low > 0.1, "nothing is seen: {low} {high}");
        for (format, views) in &others {
            let found = picture(&views.list[i]);
            // Rays differ by rounding, and no sample is that close to an edge.
            let differs = found.pixels.iter().zip(&expected.pixels).any(|(a, b)| !a.abs_diff_eq(*b, 1e-9));
            assert!(!differs, "{format}, view {i}");
        }
    }
}

/// Computed by hand: axes along those of the world, half a turn about y, and a quarter turn about the view.
#[test]
fn axes_of_colmap_are_right_down_and_forward() {
    let fixture = Fixture::new();
    fixture.write("text/cameras.txt", "1 SIMPLE_PINHOLE 80 60 100 40 30");
    // R x + t with t = (0, 0, 4), of the rotations 1, diag(−1, 1, −1) and (x, y, z) ↦ (−y, x, z).
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let cases = [
        ("1 0 0 0".to_owned(), DVec2::new(40.0 + 100.0 * 0.5 / 5.0, 30.0 + 100.0 * 0.25 / 5.0)),
        ("0 0 1 0".to_owned(), DVec2::new(40.0 - 100.0 * 0.5 / 3.0, 30.0 + 100.0 * 0.25 / 3.0)),
        (format!("{half:?} 0 0 {half:?}"), DVec2::new(40.0 - 100.0 * 0.25 / 5.0, 30.0 + 100.0 * 0.5 / 5.0)),
    ];
    for (turn, expected) in cases {
        fixture.write("text/images.txt", format!("1 {turn} 0 0 4 1 photos/0.png\n\n"));
        let views = fixture.colmap("text").unwrap();
        let found = seen(&views.list[0].camera, (80, 60), DVec3::new(0.5, 0.25, 1.0));
        assert!((found - expected).length() < 1e-12, "{turn}: {found}, not {expected}");
    }
}

/// A copy in a quarter of the pixels, a picture that is read in fewer, and values of a file and of its
/// frames.
#[test]
fn copies_and_reductions_keep_the_camera() {
    let fixture = Fixture::new();
    let small = |name: &str, size: (u32, u32)| {
        image::GrayImage::from_pixel(size.0, size.1, Luma([255])).save(fixture.path(name)).unwrap();
    };
    small("photos/0.png", (20, 15));
    let view = &fixture.colmap("text").unwrap().list[0];
    assert_eq!((view.width, view.height), (20, 15));
    let reduced = Views::from_dtu(&fixture.path("dtu")).unwrap().resized(40, 30).unwrap();
    assert_eq!(reduced.list[1].load(DVec3::ZERO).unwrap(), crate::Image::constant(40, 30, DVec3::splat(0.5)));
    for x in corners() {
        let at = known()[0].project(x);
        assert!((seen(&view.camera, (20, 15), x) - at / 4.0).length() < 1e-9);
        assert!((seen(&reduced.list[0].camera, (40, 30), x) - at / 2.0).length() < 1e-9);
    }
    let larger = message(Views::from_dtu(&fixture.path("dtu")).unwrap().resized(160, 120));
    assert!(
        larger.ends_with(
            "view `0` has 80×60 pixels, and cannot be read with 160×120; expected fewer, of the same shape"
        ),
        "{larger}"
    );
}

/// NeRF's own files have an angle only; the size is the picture's, and the mean of the mask's pixels counts.
#[test]
fn angles_are_horizontal_and_of_the_whole_picture() {
    let fixture = Fixture::new();
    let file = |of_file: &str, of_frame: &str| {
        fixture.write("a.json", format!(
            "{{{of_file}, \"frames\": [{{\"file_path\": \"photos/1\", {of_frame} \"mask_path\": \"photos/0.png\", \
             \"transform_matrix\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4]]}}]}}"
        ));
        Views::from_transforms(&fixture.path("a.json")).unwrap().list.remove(0)
    };
    let angle = 2.0 * 0.4_f64.atan();
    let of_angle = file(&format!("\"camera_angle_x\": {angle:?}"), "");
    let expected = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, angle);
    for x in corners() {
        // f = 40/0.4, and the middle at (40, 30).
        let at = DVec2::new(40.0, 30.0) + 100.0 * DVec2::new(x.x, -x.y) / (4.0 - x.z);
        assert!((seen(&of_angle.camera, (80, 60), x) - at).length() < 1e-9);
        assert!((seen(&expected, (80, 60), x) - at).length() < 1e-9);
    }
    assert_eq!(of_angle.load_weights().unwrap().unwrap().pixels[..2], [DVec3::ONE, DVec3::ZERO]);
    // A focal length goes before an angle, and a frame before its file.
    let overridden = file("\"camera_angle_x\": 1.0, \"fl_x\": 50", "\"camera_angle_x\": 0.5, \"fl_x\": 100,");
    assert!((overridden.camera.field_of_view - angle).abs() < 1e-15);
    let overridden =
        file("\"fl_x\": 50", &format!("\"camera_angle_x\": {angle:?}, \"camera_angle_y\": 0.5,"));
    assert!((overridden.camera.field_of_view - angle).abs() < 1e-15);
    assert!((overridden.camera.pixel_aspect - 30.0 / 0.25_f64.tan() / 100.0).abs() < 1e-12);
}

/// A crop is the part of the picture of the whole film.
#[test]
fn a_crop_is_part_of_the_camera() {
    let fixture = Fixture::new();
    let crop = [("width", 40), ("height", 20), ("offset_x", 10), ("offset_y", 30)];
    let crop: String =
        crop.iter().map(|(name, n)| format!("<integer name='crop_{name}' value='{n}'/>")).collect();
    fixture.write("crop.xml", sensors(&known()).replace("</film>", &format!("{crop}</film>")));
    let photos = [0, 1].map(|i| fixture.path(&format!("{i}.png")));
    photos.iter().for_each(|path| image::GrayImage::new(40, 20).save(path).unwrap());
    let views = Views::from_sensors(&fixture.path("crop.xml"), &[], &photos).unwrap();
    for (view, known) in views.list.iter().zip(known()) {
        for x in corners() {
            let at = known.project(x) - DVec2::new(10.0, 30.0);
            assert!((seen(&view.camera, (40, 20), x) - at).length() < 1e-9);
        }
    }
}

#[test]
fn cameras_look_at_their_targets() {
    let fixture = Fixture::new();
    let camera = |name: &str, up| LookAt {
        picture: fixture.path(name),
        origin: DVec3::new(0.0, 3.0, 4.0),
        target: DVec3::ZERO,
        up,
        field_of_view: 2.0 * 0.5_f64.atan(),
    };
    let views = Views::from_look_at(&[camera("photos/0.png", DVec3::Y)]).unwrap();
    let view = &views.list[0];
    assert_eq!((view.name.as_str(), view.width, view.height), ("0", 80, 60));
    // f = 40/0.5, at depth 5.
    let at = |x| seen(&view.camera, (80, 60), x);
    assert!((at(DVec3::ZERO) - DVec2::new(40.0, 30.0)).length() < 1e-12);
    assert!((at(DVec3::X) - DVec2::new(56.0, 30.0)).length() < 1e-12);
    let blind = message(Views::from_look_at(&[camera("photos/0.png", DVec3::new(0.0, 3.0, 4.0))]));
    assert!(blind.starts_with("the list of views, view 0: up is "), "{blind}");
    let twice = message(Views::from_look_at(&[0, 1].map(|_| camera("photos/0.png", DVec3::Y))));
    assert_eq!(twice, "the list of views: there are two views called `0`");
}

fn without(folder: &Path, text: &str) -> String {
    text.replace(&folder.display().to_string(), "HERE")
}
