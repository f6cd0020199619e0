//! Mutated files: readers return for any content. The mutations are deterministic.

use flatland::random::{open01, stream};
use glam::DVec3;
use image::{DynamicImage, ImageBuffer, ImageFormat};

use super::{encoded, gzipped};
use crate::io::fuzz;

/// Runs `target` on `count` mutations of the seeds.
fn mutate(target: fn(&[u8]), name: u64, count: u64, seeds: &[Vec<u8>]) {
    seeds.iter().for_each(|seed| target(seed));
    for round in 0..count {
        let mut random = stream(name, &[round]);
        let mut below = |n: usize| (open01(&mut random) * n as f64) as usize;
        let mut bytes = seeds[below(seeds.len())].clone();
        for _ in 0..=below(4) {
            let at = below(bytes.len() + 1);
            let end = (at + 1 + below(8)).min(bytes.len());
            match below(8) {
                0 => bytes.truncate(at),
                1 => drop(bytes.drain(at..end)),
                2 => bytes.insert(at, below(256) as u8),
                3 => {
                    // A piece of any of the seeds.
                    let other = &seeds[below(seeds.len())];
                    let from = below(other.len());
                    let piece = other[from..(from + 1 + below(40)).min(other.len())].to_vec();
                    bytes.splice(at..end, piece);
                }
                4 => {
                    let hostile = HOSTILE[below(HOSTILE.len())];
                    bytes.splice(at..end, hostile.iter().copied());
                }
                5 => bytes[at.min(end)..end].fill(below(2) as u8 * 255),
                _ => {
                    if let Some(byte) = bytes.get_mut(at) {
                        *byte ^= 1 << below(8);
                    }
                }
            }
        }
        target(&bytes);
    }
}

/// Hostile tokens.
const HOSTILE: [&[u8]; 18] = [
    b"-1",
    b"0",
    b"4294967295",
    b"4294967296",
    b"18446744073709551615",
    b"1e999",
    b"nan",
    b"-inf",
    b"1e-320",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\0",
    b"/",
    b"\\\n",
    b"$",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\r",
];

#[test]
fn obj() {
    let text = "# c\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 .5 .5 .5\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\ng a\n\
                f 1/1/1 2/2/1 \\\n3/2/1 -1/-1/-1\nf 1//1 2//1 3//1\ns off\n";
    mutate(fuzz::obj, 1, 20000, &[text.into(), gzipped(text.as_bytes())]);
}

#[test]
fn ply() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty double y\n\
             property float z\nproperty uchar red\nproperty float nx\nproperty float ny\nproperty float nz\n\
             property float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\n\
             property list short float other\nelement edge 1\nproperty int a\nend_header\n"
        )
    };
    let ascii = header("ascii")
        + "0 0 0 1 0 0 1 0 0\n1 0 0 1 0 0 1 0 1\n1 1 0 1 0 0 1 1 1\n0 1 0 1 0 0 1 1 0\n3 0 1 2 0\n4 0 1 2 3 1 .5\n7\n";
    let mut binary = header("binary_little_endian").into_bytes();
    for i in 0..4_u8 {
        binary.extend([0, 0, 128, 63 + i]);
        binary.extend(f64::from(i * i).to_le_bytes());
        binary.extend([i; 25]);
    }
    binary.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0]);
    binary.extend([3, 0, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 1, 0, 9, 9, 9, 9, 5, 0, 0, 0]);
    let mut big = binary.clone();
    let at = big.windows(6).position(|w| w == b"little").unwrap();
    big.splice(at..at + 6, *b"big");
    crate::io::read_ply(&binary, super::here("m.ply")).unwrap();
    let packed = gzipped(&binary);
    mutate(fuzz::ply, 2, 40000, &[ascii.into_bytes(), binary, big, packed]);
}

#[test]
fn scene() {
    let text = "<scene version='3.0.0'><default name='a' value='2'/><integrator type='path'><integer \
        name='max_depth' value='$a'/></integrator><sensor type='perspective'><float name='fov' value='38'/><transform \
        name='to_world'><lookat origin='0, 2, 4' target='0, 1, 0' up='0, 1, 0'/></transform><film type='hdrfilm'>\
        <integer name='width' value='8'/><rfilter type='tent'/></film><sampler type='independent'><integer \
        name='sample_count' value='16'/></sampler></sensor><bsdf type='twosided' id='m'><bsdf type='diffuse'><rgb \
        name='reflectance' value='0.5, 0.5, #ffffff'/></bsdf></bsdf><shape type='obj' id='s'><string name='filename' \
        value='a.obj'/><boolean name='face_normals' value='true'/><ref id='m'/></shape><shape type='rectangle'>\
        <transform name='to_world'><matrix value='1 0 0 1 0 0 -1 5 0 1 0 1 0 0 0 1'/><rotate x='1' angle='3'/>\
        </transform><emitter type='area'><rgb name='radiance' value='12'/></emitter></shape><emitter \
        type='constant' id='e'/><emitter type='directional'><vector name='direction' value='1'/></emitter></scene>";
    let text = text.replace("0.5, 0.5, #ffffff", "#7f7f7f");
    super::scene::read(&text.replace("a.obj", "quad.obj")).unwrap();
    let old = "<scene version='0.5.0'><path value='a'/><sensor type='perspective'><transform name='toWorld'><lookAt \
        origin='0, 2, 4' target='0, 1, 0'/></transform></sensor><shape type='sphere'><boolean name='flipNormals' \
        value='true'/><bsdf type='diffuse' id='a'><texture name='diffuseReflectance' type='checkerboard'><float \
        name='uscale' value='4'/><spectrum name='color0' value='400:.1 700:.4'/></texture></bsdf></shape><alias id='a' \
        as='b'/><shape type='cylinder'><ref id='b'/><emitter type='area'><blackbody name='radiance' \
        temperature='3000K'/></emitter></shape><shape type='disk'/></scene>";
    super::scene::read(old).unwrap();
    let including = text.replace("<default", "<include filename='b.xml'/><default");
    mutate(fuzz::scene, 3, 8000, &[text.into_bytes(), including.into_bytes(), old.as_bytes().to_vec()]);
}

#[test]
fn image() {
    let float = ImageBuffer::from_fn(5, 4, |x, y| image::Rgb([x as f32, y as f32, 0.5]));
    let bytes = ImageBuffer::from_fn(5, 4, |x, y| image::Rgba([x as u8, y as u8, 200, 9]));
    let grey = ImageBuffer::from_fn(3, 3, |x, y| image::Luma([(x * y) as u16]));
    let seeds = [
        encoded(ImageFormat::OpenExr, DynamicImage::ImageRgb32F(float.clone())),
        encoded(ImageFormat::Hdr, DynamicImage::ImageRgb32F(float)),
        encoded(ImageFormat::Png, DynamicImage::ImageRgba8(bytes)),
        encoded(ImageFormat::Png, DynamicImage::ImageLuma16(grey)),
    ];
    mutate(fuzz::image, 4, 20000, &seeds);
}

#[test]
fn npy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let image = crate::Image { width: 2, height: 1, pixels: vec![DVec3::X; 2] };
    let seeds = [crate::io::Precision::Single, crate::io::Precision::Double].map(|precision| {
        crate::io::write_npy(&path, &crate::io::Array::from(&image), precision).unwrap();
        std::fs::read(&path).unwrap()
    });
    mutate(fuzz::npy, 5, 40000, &seeds);
}

#[test]
fn sdf() {
    mutate(fuzz::sdf, 6, 40000, &[super::sdf::file()]);
}

#[test]
fn network() {
    mutate(fuzz::network, 7, 40000, &[super::network::file(), super::network::single()]);
}

#[test]
fn cameras() {
    mutate(fuzz::cameras, 8, 20000, &[super::dtu::archive()]);
}

#[test]
fn serialized() {
    mutate(fuzz::serialized, 9, 20000, &[super::serialized::two(4), super::serialized::two(3)]);
}

#[test]
fn transforms() {
    let overrides = r#"{"w": 8, "h": 6.0, "cx": 3.5, "camera_model": "OPENCV", "k1": 0, "frames": [{"file_path": "a.png",
        "mask_path": "m.png", "fl_x": 9.5, "transform_matrix": [[1, 0, 0, 2], [0, 0, -1, 0.5], [0, 1, 0, 3]]}]}"#;
    let file = super::views::transforms(&super::views::known());
    crate::io::views::parse_transforms(overrides.as_bytes(), super::here("a.json")).unwrap();
    mutate(fuzz::transforms, 10, 20000, &[file.into_bytes(), overrides.as_bytes().to_vec()]);
}

#[test]
fn colmap() {
    let known = super::views::known();
    let seed = |[cameras, images]: [Vec<u8>; 2]| [vec![cameras.len() as u8], cameras, images].concat();
    let seeds = [super::views::colmap_text(&known), super::views::colmap_binary(&known)].map(seed);
    assert!(seeds.iter().all(|seed| seed.len() > 1 + usize::from(seed[0])));
    mutate(fuzz::colmap, 11, 40000, &seeds);
}

#[test]
fn sensors() {
    mutate(fuzz::sensors, 12, 8000, &[super::views::sensors(&super::views::known()).into_bytes()]);
}

/// `roxmltree` must not recurse on nested elements.
#[test]
fn deep_nesting() {
    fuzz::scene("<a>".repeat(100_000).as_bytes());
    fuzz::scene(format!("{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000)).as_bytes());
}
