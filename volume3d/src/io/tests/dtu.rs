//! DTU folders: pictures with masks and cameras.

use std::io::Write as _;
use std::path::Path;

use flate2::write::DeflateEncoder;
use flatland::calculus::Vec3;
use flatland::random::{Stream, open01, stream};
use glam::{DMat3, DMat4, DVec3, DVec4};
use image::{GrayImage, Luma, Rgb, RgbImage};
use tempfile::TempDir;

use super::message;
use crate::gradient::FilmPlane;
use crate::io::dtu::{Folder, View, read_views};
use crate::scene::{Description, Film, Scene};

/// Storage of an array.
#[derive(Clone, Copy)]
pub(super) enum Stored {
    Double,
    Single,
    Fortran,
    BigEndian,
}

pub(super) fn npy(matrix: DMat4, stored: Stored) -> Vec<u8> {
    let numbers = matrix.transpose().to_cols_array();
    let (descr, fortran, data): (_, _, Vec<u8>) = match stored {
        Stored::Double => ("<f8", "False", numbers.iter().flat_map(|x| x.to_le_bytes()).collect()),
        Stored::Single => ("<f4", "False", numbers.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect()),
        Stored::BigEndian => (">f8", "False", numbers.iter().flat_map(|x| x.to_be_bytes()).collect()),
        Stored::Fortran => {
            ("<f8", "True", matrix.to_cols_array().iter().flat_map(|x| x.to_le_bytes()).collect())
        }
    };
    array(&format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': (4, 4), }}\n"), &data)
}

fn array(header: &str, data: &[u8]) -> Vec<u8> {
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

/// An archive with these members, deflated or stored.
pub(super) fn npz(members: &[(String, Vec<u8>)], deflated: bool) -> Vec<u8> {
    let mut bytes = vec![];
    let mut archive = rawzip::ZipArchiveWriter::new(&mut bytes);
    for (name, content) in members {
        let method =
            if deflated { rawzip::CompressionMethod::DEFLATE } else { rawzip::CompressionMethod::STORE };
        let builder = archive.new_file(name.as_str()).compression_method(method);
        let (mut entry, config) = builder.start().unwrap();
        let descriptor = if deflated {
            let encoder = DeflateEncoder::new(&mut entry, flate2::Compression::default());
            let mut writer = config.wrap(encoder);
            writer.write_all(content).unwrap();
            let (encoder, descriptor) = writer.finish().unwrap();
            encoder.finish().unwrap();
            descriptor
        } else {
            let mut writer = config.wrap(&mut entry);
            writer.write_all(content).unwrap();
            writer.finish().unwrap().1
        };
        entry.finish(descriptor).unwrap();
    }
    archive.finish().unwrap();
    bytes
}

/// A camera: K, R and c, and the bounding ball of its data.
struct Known {
    intrinsics: DMat3,
    rotation: DMat3,
    center: DVec3,
    scale: DMat4,
}

const SIZE: (u32, u32) = (8, 6);

impl Known {
    fn new(rng: &mut Stream) -> Self {
        let mut number = |low: f64, high: f64| low + (high - low) * open01(rng);
        let intrinsics = DMat3::from_cols(
            DVec3::new(number(900.0, 3000.0), 0.0, 0.0),
            DVec3::new(number(-5.0, 5.0), number(900.0, 3000.0), 0.0),
            DVec3::new(number(300.0, 900.0), number(300.0, 900.0), 1.0),
        );
        let axis = DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0)).normalize();
        let rotation = DMat3::from_axis_angle(axis, number(0.0, 6.0));
        let center = rotation.transpose() * DVec3::new(number(-0.3, 0.3), number(-0.3, 0.3), -3.0);
        let shift = DVec3::new(number(-50.0, 50.0), number(-50.0, 50.0), 600.0);
        let scale = DMat4::from_translation(shift) * DMat4::from_scale(DVec3::splat(number(50.0, 300.0)));
        Self { intrinsics, rotation, center, scale }
    }

    /// A camera whose principal point is the centre of the film.
    fn plain(rng: &mut Stream) -> Self {
        let known = Self::new(rng);
        let middle = DVec3::new(0.5 * f64::from(SIZE.0 - 1), 0.5 * f64::from(SIZE.1 - 1), 1.0);
        let intrinsics = DMat3::from_cols(10.0 * DVec3::X, 10.0 * DVec3::Y, middle);
        Self { intrinsics, ..known }
    }

    fn world(&self) -> DMat4 {
        let turned = self.intrinsics * self.rotation;
        let shift = -(turned * self.center);
        let ball = DMat4::from_cols(
            turned.x_axis.extend(0.0),
            turned.y_axis.extend(0.0),
            turned.z_axis.extend(0.0),
            shift.extend(1.0),
        );
        ball * self.scale.inverse()
    }

    fn members(&self, index: usize, factor: f64, stored: Stored) -> [(String, Vec<u8>); 2] {
        let world = DMat4::from_cols_array(&self.world().to_cols_array().map(|x| factor * x));
        [("world_mat", world), ("scale_mat", self.scale)]
            .map(|(kind, matrix)| (format!("{kind}_{index}.npy"), npy(matrix, stored)))
    }
}

/// A folder whose image i has red value i, with masks of the left halves.
fn folder(cameras: &[u8], count: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["image", "mask"] {
        std::fs::create_dir(folder.path().join(kind)).unwrap();
    }
    for i in 0..count {
        let image = RgbImage::from_pixel(SIZE.0, SIZE.1, Rgb([i as u8, 0, 255]));
        image.save(folder.path().join(format!("image/{i:06}.png"))).unwrap();
        let mask = GrayImage::from_fn(SIZE.0, SIZE.1, |x, _| Luma([if x < SIZE.0 / 2 { 255 } else { 0 }]));
        mask.save(folder.path().join(format!("mask/{i:03}.png"))).unwrap();
    }
    std::fs::write(folder.path().join("cameras.npz"), cameras).unwrap();
    folder
}

/// Cameras of three views, as written by NumPy.
pub(super) fn archive() -> Vec<u8> {
    let mut rng = stream(1, &[]);
    let stored = [Stored::Double, Stored::Fortran, Stored::BigEndian];
    let members: Vec<_> =
        (0..3).flat_map(|i| Known::new(&mut rng).members(i, [1.0, -3.0, 1e-4][i], stored[i])).collect();
    npz(&members, true)
}

fn check(view: &View, known: &Known, tolerance: f64) {
    let mut rng = stream(2, &[]);
    for _ in 0..20 {
        let x = DVec3::from_array([0; 3].map(|_| 2.0 * open01(&mut rng) - 1.0));
        let p = known.intrinsics * (known.rotation * (x - known.center));
        let expected = p.truncate() / p.z;
        let error = (view.project(x) - expected).length() / (1.0 + expected.length());
        assert!(error < tolerance, "{} at {x}: {} for {expected}", view.name, view.project(x));
    }
    let identity = view.rotation * view.rotation.transpose();
    assert!(identity.abs_diff_eq(DMat3::IDENTITY, 1e-14) && view.rotation.determinant() > 0.0);
    assert!(view.center.abs_diff_eq(known.center, 1e3 * tolerance), "{} for {}", view.center, known.center);
}

/// 10⁻⁹ of the position is the rounding of matrices with numbers up to 10⁶; single precision has 2²⁹ times as
/// much.
#[test]
fn cameras_are_those_that_were_written() {
    let mut rng = stream(1, &[]);
    let known: Vec<Known> = (0..3).map(|_| Known::new(&mut rng)).collect();
    let views = read_views(folder(&archive(), 3).path()).unwrap();
    assert_eq!(views.len(), 3);
    for (i, (view, known)) in views.iter().zip(&known).enumerate() {
        check(view, known, 1e-9);
        assert_eq!(view.name, format!("{i:06}"));
        assert_eq!(view.image.size(), (8, 6));
        assert!(view.image.pixels.iter().all(|p| p.z == 1.0 && (p.x > 0.0) == (i > 0)));
        assert_eq!(view.mask, [[true, true, true, true, false, false, false, false]; 6].as_flattened());
    }
    let single: Vec<_> =
        known.iter().enumerate().flat_map(|(i, k)| k.members(i, 1.0, Stored::Single)).collect();
    for (view, known) in read_views(folder(&npz(&single, false), 3).path()).unwrap().iter().zip(&known) {
        check(view, known, 1e-3);
    }
}

#[test]
fn plain_cameras_are_those_of_scenes() {
    let mut rng = stream(3, &[]);
    let (plain, other) = (Known::plain(&mut rng), Known::new(&mut rng));
    let members = [plain.members(0, 1.0, Stored::Double), other.members(1, 1.0, Stored::Double)].concat();
    let views = read_views(folder(&npz(&members, false), 2).path()).unwrap();
    let mut straight = views[1].clone();
    straight.intrinsics.y_axis.x = 0.0;
    for view in [&views[0], &straight] {
        let camera = view.camera().unwrap();
        let film = Film {
            width: SIZE.0 as usize,
            height: SIZE.1 as usize,
            crop: None,
            sample_border: true,
            filter: crate::scene::Filter::Box,
        };
        let plane = FilmPlane::new(&Scene::new(Description::new(camera.clone(), film)).unwrap());
        for _ in 0..20 {
            let x = DVec3::from_array([0; 3].map(|_| 2.0 * open01(&mut rng) - 1.0));
            // Film coordinates of a scene: pixel centres at halves.
            let [u, v] = plane.project(&plane.still, Vec3::constant(x));
            let found = view.project(x) + 0.5;
            let scale = 1.0 + found.length();
            assert!(
                (found.x - u).abs() < 1e-9 * scale && (found.y - v).abs() < 1e-9 * scale,
                "{found} for {u}, {v}"
            );
        }
    }
    let k = other.intrinsics;
    let mismatch = views[1].camera().unwrap_err();
    assert!((mismatch.skew - 3.0 * (k.y_axis.x / k.y_axis.y).abs()).abs() < 1e-9);
}

fn refused(change: impl Fn(&Path)) -> String {
    let folder = folder(&archive(), 3);
    change(folder.path());
    let text = message(read_views(folder.path()));
    text.replace(&folder.path().display().to_string(), "DTU").replace(std::path::MAIN_SEPARATOR, "/")
}

#[test]
fn errors_of_folders() {
    let remove = |name: &'static str| refused(move |path| std::fs::remove_file(path.join(name)).unwrap());
    let begins = |text: String, beginning: &str| assert!(text.starts_with(beginning), "{text}");
    begins(remove("cameras.npz"), "cannot read DTU/cameras.npz: ");
    begins(refused(|path| std::fs::remove_dir_all(path.join("mask")).unwrap()), "cannot read DTU/mask: ");
    assert_eq!(remove("mask/001.png"), "DTU: there are 3 images, but 2 masks");
    let pair = refused(|path| std::fs::rename(path.join("mask/001.png"), path.join("mask/004.png")).unwrap());
    assert_eq!(pair, "DTU: image 1 (from 0) is \"000001.png\", but the mask in its place is \"002.png\"");
    let size = refused(|path| GrayImage::new(6, 8).save(path.join("mask/002.png")).unwrap());
    assert_eq!(
        size,
        "DTU: the mask of image 2 (from 0) has 6×8 pixels, but the image, DTU/image/000002.png, has 8×6"
    );
    begins(
        refused(|path| std::fs::write(path.join("image/000000.png"), "P6").unwrap()),
        "DTU/image/000000.png: ",
    );
    let empty = refused(|path| {
        std::fs::remove_dir_all(path.join("image")).unwrap();
        std::fs::create_dir(path.join("image")).unwrap();
    });
    assert_eq!(empty, "DTU/image: there are no PNG images");
    let kept = folder(&archive(), 3);
    let opened = Folder::open(kept.path()).unwrap();
    assert_eq!(opened.len(), 3);
    assert!(message(opened.view(3)).ends_with("there is no image 3 (from 0), but 3"));
}

#[test]
fn errors_of_cameras() {
    let written = |members: &[(String, Vec<u8>)]| {
        let bytes = npz(members, true);
        refused(move |path| std::fs::write(path.join("cameras.npz"), &bytes).unwrap())
    };
    let mut rng = stream(1, &[]);
    let known: Vec<Known> = (0..4).map(|_| Known::new(&mut rng)).collect();
    let members = |count: usize| {
        known[..count]
            .iter()
            .enumerate()
            .flat_map(|(i, k)| k.members(i, 1.0, Stored::Double))
            .collect::<Vec<_>>()
    };
    let replaced = |content: Vec<u8>| {
        let mut members = members(3);
        members[4].1 = content;
        written(&members).replace("DTU/cameras.npz: ", "")
    };
    assert_eq!(written(&members(2)), "DTU/cameras.npz: there is no array \"world_mat_2\"");
    assert_eq!(
        written(&members(4)),
        "DTU/cameras.npz: there is an array \"world_mat_3\", but there are only 3 images"
    );
    assert_eq!(
        written(&[members(3), members(1)].concat()),
        "DTU/cameras.npz: there are two arrays \"world_mat_0\""
    );
    let not_a_camera = "world_mat_2 · scale_mat_2 is none of a camera: ";
    let flat = DMat4::from_cols(DVec4::X, DVec4::X, DVec4::Z, DVec4::W);
    assert_eq!(
        replaced(npy(flat, Stored::Double)),
        format!("{not_a_camera}its first three columns are singular")
    );
    assert_eq!(
        replaced(npy(DMat4::ZERO, Stored::Double)),
        format!("{not_a_camera}its numbers are too large, too small, or all 0")
    );
    let mut infinite = DMat4::IDENTITY;
    infinite.col_mut(3)[1] = f64::NEG_INFINITY;
    assert_eq!(
        replaced(npy(infinite, Stored::Fortran)),
        "row 1, column 3 (from 0) of \"world_mat_2\" is -inf; all must be finite"
    );
    let small = array("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 1), }\n", &[0; 16]);
    assert_eq!(replaced(small), "\"world_mat_2\" has the shape [2, 1]; expected [4, 4]");
    let short = array("{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4), }\n", &[0; 16]);
    assert_eq!(replaced(short), "\"world_mat_2\": the shape asks for 128 bytes, but there are 16");
    assert_eq!(replaced(vec![0; 1 << 24]), "\"world_mat_2\" takes 65536 bytes or more; a matrix is smaller");
    let text = refused(|path| std::fs::write(path.join("cameras.npz"), "PK").unwrap());
    assert!(text.starts_with("DTU/cameras.npz: not a readable NPZ archive: "), "{text}");
    let damaged = refused(|path| {
        let mut bytes = archive();
        bytes[100] ^= 8;
        std::fs::write(path.join("cameras.npz"), bytes).unwrap();
    });
    assert!(damaged.starts_with("DTU/cameras.npz: cannot decompress \"world_mat_0\": "), "{damaged}");
}
