//! `volume3d fit` from photographs with cameras, which the test writes: in the layout of the DTU data, as
//! `transforms.json`, and as a COLMAP model.

use std::io::Write as _;

use flatland::sdf::shapes::Ball;
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};
use volume3d::Image;
use volume3d::gradient::{Progress, render};
use volume3d::io::{load_scene, write_png};
use volume3d::scene::{Camera, Description, Environment, Film, Filter, Material, Scene};

use super::Place;

const SIZE: (usize, usize) = (24, 20);

/// A ball in clay under the sky, begun as a smaller one.
const START: &str = r#"<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective"><film type="hdrfilm">
    <integer name="width" value="24"/><integer name="height" value="20"/><rfilter type="tent"/>
  </film><transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform></sensor>
  <bsdf type="diffuse" id="clay"><rgb name="reflectance" value="0.3"/></bsdf>
  <shape type="sdfgrid" id="thing">
    <integer name="cells" value="10"/><float name="radius" value="0.5"/><ref id="clay"/>
  </shape>
  <emitter type="constant" id="sky"><rgb name="radiance" value="0.9"/></emitter>
</scene>"#;

const FIT: &str = r#"
scene = "start.xml"
steps = 8
gradient = { spp = 4 }
[dtu]
folder = "scan"
[[parameter]]
name = "thing.sdf"
rate = 0.03
large_steps = 1
redistance = true
"#;

const MASKS: &str = "[masks]\nshape = \"thing\"\n";

/// Cameras as of lenses: the axis is elsewhere, and pixels are not quite square.
fn cameras() -> [Camera; 2] {
    [DVec3::new(0.3, 0.4, 3.0), DVec3::new(2.8, -0.5, 0.6)].map(|eye| Camera {
        principal_point: DVec2::new(0.03, -0.05),
        pixel_aspect: 0.95,
        ..Camera::look_at(eye, DVec3::ZERO, DVec3::Y, 0.9)
    })
}

/// The picture's projection K R (x − c), with pixel centres at whole coordinates.
fn projection(camera: &Camera) -> DMat4 {
    let (width, height) = (SIZE.0 as f64, SIZE.1 as f64);
    let focal = 0.5 * width / (0.5 * camera.field_of_view).tan();
    let middle = (camera.principal_point + 0.5) * DVec2::new(width, height) - 0.5;
    let intrinsics =
        DMat3::from_cols(DVec3::X * focal, DVec3::Y * (focal * camera.pixel_aspect), middle.extend(1.0));
    let rotation = DMat3::from_cols(camera.right, -camera.up, camera.forward).transpose();
    let turned = intrinsics * rotation;
    let shift = -(turned * camera.origin);
    let [x, y, z] = [turned.x_axis, turned.y_axis, turned.z_axis].map(|axis| axis.extend(0.0));
    DMat4::from_cols(x, y, z, shift.extend(1.0))
}

fn npy(matrix: DMat4) -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4), }\n";
    let numbers = matrix.transpose().to_cols_array();
    let length = (header.len() as u16).to_le_bytes();
    let data: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), &data].concat()
}

fn archive(cameras: &[Camera]) -> Vec<u8> {
    let mut bytes = vec![];
    let mut archive = rawzip::ZipArchiveWriter::new(&mut bytes);
    for (i, camera) in cameras.iter().enumerate() {
        for (kind, matrix) in [("world_mat", projection(camera)), ("scale_mat", DMat4::IDENTITY)] {
            let content = npy(matrix);
            let (mut entry, config) = archive.new_file(format!("{kind}_{i}.npy")).start().unwrap();
            let mut writer = config.wrap(&mut entry);
            writer.write_all(&content).unwrap();
            let descriptor = writer.finish().unwrap().1;
            entry.finish(descriptor).unwrap();
        }
    }
    archive.finish().unwrap();
    bytes
}

/// Pictures of a ball of radius 0.7, white where it is.
fn pictures(reflectance: f64) -> Vec<Image> {
    let film = Film {
        width: SIZE.0,
        height: SIZE.1,
        crop: None,
        sample_border: true,
        filter: Filter::Tent { radius: 1.0 },
    };
    let picture = |camera: Camera| {
        let mut description = Description::new(camera, film);
        let radiance = DVec3::splat(0.9);
        description.environment = Some(Environment::Constant { id: "sky".into(), radiance });
        let clay = description.add_material(Material::diffuse("clay", DVec3::splat(reflectance)));
        description.add_implicit("ball", Ball::new(DVec3::ZERO, 0.7).unwrap(), clay);
        render(&Scene::new(description).unwrap(), 64, 1, &Progress::none()).unwrap().image
    };
    cameras().into_iter().map(picture).collect()
}

fn place(config: &str) -> Place {
    let place = Place::new();
    std::fs::write(place.path("start.xml"), START).unwrap();
    std::fs::write(place.path("fit.toml"), config).unwrap();
    for folder in ["scan", "scan/image", "scan/mask"] {
        std::fs::create_dir(place.path(folder)).unwrap();
    }
    std::fs::write(place.path("scan/cameras.npz"), archive(&cameras())).unwrap();
    for (i, (picture, black)) in pictures(0.3).iter().zip(pictures(0.0)).enumerate() {
        let white = |p: &DVec3| DVec3::splat(f64::from(p.x < 0.45));
        write_png(&place.path(&format!("scan/image/{i:03}.png")), picture).unwrap();
        let mask = black.with_pixels(black.pixels.iter().map(white).collect());
        write_png(&place.path(&format!("scan/mask/{i:03}.png")), &mask).unwrap();
    }
    place
}

/// The least and the greatest distance from the origin at which a fitted grid's axes have its surface.
fn radii(place: &Place) -> (f64, f64) {
    let scene = load_scene(&place.path("run/fit.xml")).unwrap();
    let surface = &scene.implicits[0].surface;
    let radius = |axis: DVec3| {
        let (mut low, mut high) = (0.0, 0.99);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if surface.value(middle * axis) < 0.0 { low = middle } else { high = middle }
        }
        low
    };
    let all = [DVec3::X, DVec3::Y, DVec3::Z].map(radius);
    (all.into_iter().fold(1.0, f64::min), all.into_iter().fold(0.0, f64::max))
}

#[test]
fn photographs_and_masks_move_a_surface() {
    let alone = place(FIT);
    let text = alone.succeed("fit fit.toml -o run");
    let (low, high) = radii(&alone);
    assert!(low > 0.55 && high < 0.78, "{low} {high}: {text}");
    let masked = place(&format!("{}{MASKS}", FIT.replace("spp = 4", "spp = 4, method = \"interior\"")));
    let text = masked.succeed("fit fit.toml -o run");
    assert!(!text.contains("interior term alone"), "{text}");
    let (low, high) = radii(&masked);
    assert!(low > 0.55 && high < 0.8, "{low} {high}");
    // Without either nothing grows.
    let neither = place(&FIT.replace("spp = 4", "spp = 4, method = \"interior\""));
    let text = neither.succeed("fit fit.toml -o run");
    assert!(text.contains("WARNING: the interior term alone is biased"), "{text}");
    let (_, high) = radii(&neither);
    assert!(high < 0.55, "{high}");
}

/// Focal lengths and principal point in pixels, with the middle of the first pixel at (½, ½).
fn lens(camera: &Camera) -> [f64; 4] {
    let size = DVec2::new(SIZE.0 as f64, SIZE.1 as f64);
    let focal = 0.5 * size.x / (0.5 * camera.field_of_view).tan();
    let middle = (camera.principal_point + 0.5) * size;
    [focal, focal * camera.pixel_aspect, middle.x, middle.y]
}

/// Columns right, up, against the view, and the position.
fn transforms() -> String {
    let frame = |(i, camera): (usize, &Camera)| {
        let Camera { right, up, forward, origin, .. } = *camera;
        let row = |j: usize| format!("[{}, {}, {}, {}]", right[j], up[j], -forward[j], origin[j]);
        let rows = [0, 1, 2].map(row).join(", ");
        format!("{{\"file_path\": \"image/{i:03}\", \"transform_matrix\": [{rows}, [0, 0, 0, 1]]}}")
    };
    let [fx, fy, cx, cy] = lens(&cameras()[0]);
    let frames = cameras().iter().enumerate().map(frame).collect::<Vec<_>>().join(", ");
    format!("{{\"fl_x\": {fx}, \"fl_y\": {fy}, \"cx\": {cx}, \"cy\": {cy}, \"frames\": [{frames}]}}")
}

/// `cameras.txt` and `images.txt`.
fn colmap() -> [String; 2] {
    let lens = lens(&cameras()[0]).map(|x| x.to_string()).join(" ");
    let image = |(i, camera): (usize, &Camera)| {
        let rotation = DMat3::from_cols(camera.right, -camera.up, camera.forward).transpose();
        let (q, t) = (DQuat::from_mat3(&rotation), -(rotation * camera.origin));
        let numbers = [q.w, q.x, q.y, q.z, t.x, t.y, t.z].map(|x| x.to_string()).join(" ");
        format!("{} {numbers} 1 {i:03}.png\n\n", i + 1)
    };
    [format!("1 PINHOLE {} {} {lens}\n", SIZE.0, SIZE.1), cameras().iter().enumerate().map(image).collect()]
}

#[test]
fn cameras_of_other_programs_move_a_surface() {
    let fit = |photographs: &str| {
        let place = place(&FIT.replace("[dtu]\nfolder = \"scan\"", &format!("[photographs]\n{photographs}")));
        std::fs::write(place.path("scan/transforms.json"), transforms()).unwrap();
        std::fs::create_dir(place.path("scan/sparse")).unwrap();
        for (name, content) in ["cameras", "images"].iter().zip(colmap()) {
            std::fs::write(place.path(&format!("scan/sparse/{name}.txt")), content).unwrap();
        }
        place
    };
    let colmap = "cameras = \"scan/sparse\"\nimages = \"scan/image\"";
    for photographs in ["cameras = \"scan/transforms.json\"", colmap] {
        let place = fit(photographs);
        let text = place.succeed("fit fit.toml -o run");
        let (low, high) = radii(&place);
        assert!(low > 0.55 && high < 0.78, "{photographs}: {low} {high}: {text}");
    }
    let refused = |photographs: &str, words: &[&str]| {
        fit(photographs).fail("fit fit.toml -o run", 1, words);
    };
    let nerf = "cameras = \"scan/transforms.json\"";
    refused("cameras = \"none.json\"", &["none.json"]);
    refused("cameras = \"scan/image\"", &["scan/image", "cameras.txt"]);
    refused(&format!("{nerf}\nimages = \"scan/image\""), &["images is for the folder of a COLMAP model"]);
    refused(&format!("{nerf}\nviews = [2]"), &["there is no view 2; there are 2, from 0"]);
    refused(&format!("{nerf}\nviews = [1, 1]"), &["twice"]);
    refused(&format!("{nerf}\nviews = []"), &["leaves no view"]);
    refused(&format!("{nerf}\nsize = [48, 40]"), &["24×20 pixels, and cannot be read with 48×40"]);
    refused(
        &format!("{nerf}\n[[view]]\ntarget = \"a.png\""),
        &["[photographs] excludes [[view]]", "cameras"],
    );
    refused(&format!("{nerf}\n[dtu]\nfolder = \"scan\""), &["[dtu] excludes [photographs]"]);
    refused(&format!("{nerf}\n{MASKS}"), &["[masks] needs views with a mask"]);
}

#[test]
fn what_is_no_folder_of_photographs_is_refused() {
    let asked = |dtu: &str| place(&FIT.replace("folder = \"scan\"", dtu));
    asked("folder = \"none\"").fail("fit fit.toml -o run", 1, &["none"]);
    asked("folder = \"scan\"\nviews = [5]").fail("fit fit.toml -o run", 1, &["5", "2"]);
    asked("folder = \"scan\"\nviews = []").fail("fit fit.toml -o run", 1, &["leaves no view"]);
    asked("folder = \"scan\"\nviews = [1, 1]").fail("fit fit.toml -o run", 1, &["twice"]);
    asked("folder = \"scan\"\n[[view]]\ntarget = \"a.png\"").fail("fit fit.toml -o run", 1, &["[dtu]"]);
    let no_shape = place(&format!("{FIT}[masks]\nshape = \"nothing\"\n"));
    no_shape.fail("fit fit.toml -o run", 1, &["nothing"]);
    let no_mask = place(
        "scene = \"start.xml\"\nsteps = 1\n[reference]\nscene = \"start.xml\"\n[[parameter]]\nname = \"thing.sdf\"\nrate = 1\n[masks]\nshape = \"thing\"\n",
    );
    no_mask.fail("fit fit.toml -o run", 1, &["[masks] needs views with a mask"]);
}
