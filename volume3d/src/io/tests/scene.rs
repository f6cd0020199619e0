//! Supported scenes: every plugin once.

use std::f64::consts::FRAC_1_SQRT_2;
use std::io::{Error as IoError, ErrorKind};
use std::path::Path;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use image::{DynamicImage, ImageBuffer, ImageFormat};

use super::{encoded, here};
use crate::geometry::{Mesh, Normals};
use crate::io::{Error, load_scene, read_scene};
use crate::scene::{
    Bsdf, Crop, Description, Environment, Filter, Integrator, Lens, Light, Material, Reflectance, Wrap,
};

/// The files that test scenes refer to.
pub(super) fn open(path: &Path) -> std::io::Result<Vec<u8>> {
    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 .25\nf 1/1 2/1 3/2\nf 1/1 3/2 4/1\n";
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n";
    let png = |bytes: Vec<u8>| {
        encoded(ImageFormat::Png, DynamicImage::ImageRgb8(ImageBuffer::from_raw(1, 2, bytes).unwrap()))
    };
    let hdr = || {
        let pixels = vec![1.0_f32, 2.0, 4.0, 0.0, 0.0, 0.0];
        encoded(ImageFormat::OpenExr, DynamicImage::ImageRgb32F(ImageBuffer::from_raw(2, 1, pixels).unwrap()))
    };
    match path.to_str() {
        Some("dir/quad.obj") => Ok(QUAD.into()),
        Some("dir/tri.ply") => Ok(PLY.into()),
        Some("dir/bad.ply") => Ok("ply\nformat ascii 1.0\nend_header\n".into()),
        Some("dir/red.png") => Ok(png(vec![255, 0, 0, 0, 0, 0])),
        Some("dir/sky.exr") => Ok(hdr()),
        Some("dir/part.xml") => {
            Ok("<scene version='3.0.0'><default name='w' value='9'/><default name='ior' value='1.5'/>\
             <include filename='sub/one.xml'/></scene>"
                .into())
        }
        Some("dir/sub/one.xml") => {
            Ok("<bsdf version='3.0.0' type='conductor' id='inc'><float name='eta' value='$ior'/></bsdf>"
                .into())
        }
        Some("dir/loop.xml") => Ok("<scene version='3.0.0'><include filename='loop.xml'/></scene>".into()),
        Some("dir/there.xml") => Ok("<scene version='3.0.0'><include filename='back.xml'/></scene>".into()),
        Some("dir/back.xml") => Ok("<scene version='3.0.0'><include filename='there.xml'/></scene>".into()),
        Some("dir/box.xml") => Ok("<scene version='3.0.0'><shape type='cube'/></scene>".into()),
        Some("dir/new.xml") => Ok("<scene version='4.0.0'/>".into()),
        Some("dir/part/leaf.xml") => {
            Ok("<scene version='3.0.0'><include filename='twig.xml'/></scene>".into())
        }
        Some("dir/part/twig.xml") => Ok("<bsdf version='3.0.0' type='diffuse' id='twig'/>".into()),
        Some("dir/far/away.obj") => Ok(QUAD.into()),
        Some("dir/far/red.spd") => Ok("# nm\n600 0.5\n\n700 1\n".into()),
        Some("dir/two.serialized") => Ok(super::serialized::two(4)),
        _ => Err(IoError::from(ErrorKind::NotFound)),
    }
}

pub(super) fn read(text: &str) -> Result<Description, Error> {
    read_scene(text.as_bytes(), here("dir/s.xml"), &[], &open)
}

pub(super) const SENSOR: &str = "<sensor type='perspective'/>";

/// A scene with the simplest camera.
pub(super) fn with(body: &str) -> Result<Description, Error> {
    read(&format!("<scene version='3.0.0'>{SENSOR}{body}</scene>"))
}

fn camera(body: &str) -> Description {
    read(&format!("<scene version='3.5.2'><sensor type='perspective'>{body}</sensor></scene>")).unwrap()
}

fn shape(body: &str) -> Mesh {
    with(&format!("<shape {body}</shape>")).unwrap().shapes.remove(0).mesh
}

pub(super) fn material(body: &str) -> Material {
    let mut scene = with(body).unwrap();
    assert_eq!(scene.materials.len(), 1);
    scene.materials.remove(0)
}

fn close(a: DVec3, b: DVec3) -> bool {
    (a - b).length() < 1e-12
}

#[test]
fn defaults_are_those_of_mitsuba() {
    let scene = with("").unwrap();
    assert_eq!(scene.integrator, Integrator { max_depth: None, rr_depth: 5 });
    assert_eq!((scene.film.width, scene.film.height, scene.samples), (768, 576, 4));
    assert_eq!(scene.film.filter, Filter::Gaussian { deviation: 0.5 });
    // 50 mm: half the diagonal of 36 mm × 24 mm divided by 50 mm, times 4/5 horizontally at 4:3.
    let tangent = 0.5 * 36.0_f64.hypot(24.0) / 50.0 * 0.8;
    assert!((scene.camera.field_of_view - 2.0 * tangent.atan()).abs() < 1e-14);
    assert_eq!(scene.camera.right, DVec3::NEG_X);
    assert!(scene.shapes.is_empty() && scene.lights.is_empty() && scene.environment.is_none());
}

#[test]
fn lenses() {
    let sensor =
        |body: &str| read(&format!("<scene version='3.5.2'><sensor type='thinlens'>{body}</sensor></scene>"));
    let radius = "<float name='aperture_radius' value='0.25'/>";
    let lens = |body: &str| sensor(body).unwrap().camera.lens;
    let of = |focus_distance| Some(Lens { radius: 0.25, focus_distance });
    assert_eq!(lens(&format!("{radius}<float name='focus_distance' value='3'/>")), of(3.0));
    // By default at the far clipping plane.
    assert_eq!(lens(radius), of(1e4));
    assert_eq!(lens(&format!("{radius}<float name='far_clip' value='50'/>")), of(50.0));
    assert_eq!(lens("<float name='aperture_radius' value='0'/>"), None);
    assert!(sensor("").unwrap_err().to_string().contains("aperture_radius"));
    assert!(sensor("<float name='aperture_radius' value='-1'/>").is_err());
    assert!(sensor(&format!("{radius}<float name='focus_distance' value='0'/>")).is_err());
}

#[test]
fn integrators() {
    let case = |body: &str| with(&format!("<integrator {body}</integrator>")).unwrap().integrator;
    let depths = "<integer name='max_depth' value='7'/><integer name='rr_depth' value='3'/>";
    let of = |max_depth, rr_depth| Integrator { max_depth, rr_depth };
    assert_eq!(case(&format!("type='path'>{depths}")), of(Some(7), 3));
    assert_eq!(case("type='path'><integer name='max_depth' value='-1'/>"), of(None, 5));
    for hides in [true, false] {
        let hide =
            format!("<integrator type='path'><boolean name='hide_emitters' value='{hides}'/></integrator>");
        assert_eq!(with(&hide).unwrap().hide_emitters, hides);
    }
    for plugin in ["prb", "prb_basic", "prb_reparam", "prb_projective"] {
        assert_eq!(case(&format!("type='{plugin}'>")), of(Some(6), 5), "{plugin}");
        assert_eq!(case(&format!("type='{plugin}'>{depths}")), of(Some(7), 3), "{plugin}");
    }
    for plugin in ["direct", "direct_reparam", "direct_projective"] {
        assert_eq!(case(&format!("type='{plugin}'>")), of(Some(2), 5), "{plugin}");
    }
}

#[test]
fn cameras_look_where_they_do_in_mitsuba() {
    let look = "<transform name='to_world'><lookat origin='1,2,3' target='1 2 -7' up='0, 5, 1'/></transform>";
    let camera =
        camera(&format!("{look}<float name='near_clip' value='.1'/><float name='far_clip' value='9'/>"))
            .camera;
    assert_eq!(camera.origin, DVec3::new(1.0, 2.0, 3.0));
    assert!(
        close(camera.forward, DVec3::NEG_Z) && close(camera.up, DVec3::Y) && close(camera.right, DVec3::X)
    );
}

#[test]
fn a_camera_may_be_scaled_and_slightly_rounded() {
    let matrix = "<matrix value='-1.41421 0 1.41421 4  0 2 0 5  -1.41421 0 -1.41421 6  0 0 0 1'/>";
    let camera = camera(&format!("<transform name='to_world'>{matrix}</transform>")).camera;
    let half = FRAC_1_SQRT_2;
    assert!(close(camera.forward, DVec3::new(half, 0.0, -half)), "{camera:?}");
    assert!(close(camera.right, DVec3::new(half, 0.0, half)), "{camera:?}");
}

#[test]
fn fields_of_view() {
    let film =
        "<film type='hdrfilm'><integer name='width' value='400'/><integer name='height' value='200'/></film>";
    let tangent = |axis: &str| {
        let fov = format!("<float name='fov' value='90'/><string name='fov_axis' value='{axis}'/>");
        (0.5 * camera(&format!("{film}{fov}")).camera.field_of_view).tan()
    };
    let expected = [("x", 1.0), ("y", 2.0), ("larger", 1.0), ("smaller", 2.0), ("diagonal", 0.8_f64.sqrt())];
    for (axis, expected) in expected {
        assert!((tangent(axis) - expected).abs() < 1e-12, "{axis}: {}", tangent(axis));
    }
    let flat = "<float name='pixel_aspect' value='0.5'/><float name='fov' value='90'/>";
    for (axis, expected) in [("x", 1.0), ("y", 1.0)] {
        let camera = camera(&format!("{film}{flat}<string name='fov_axis' value='{axis}'/>")).camera;
        assert!(((0.5 * camera.field_of_view).tan() - expected).abs() < 1e-12, "{axis}");
    }
    // Mitsuba shows at (u, v) what a centred camera shows at (u, v) + offset: the principal point is the
    // centre minus the offset.
    let offset = "<float name='principal_point_offset_x' value='0.1'/><float name='principal_point_offset_y' value='-0.2'/>";
    assert_eq!(camera(offset).camera.principal_point, DVec2::new(-0.1, 0.2));
    let long = camera(&format!("{film}<string name='focal_length' value='100 mm'/>")).camera.field_of_view;
    assert!(((0.5 * long).tan() - 0.5 * 36.0_f64.hypot(24.0) / 100.0 * 0.8_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn films() {
    let case = |body: &str| camera(&format!("<film type='hdrfilm'>{body}</film>")).film;
    let size = "<integer name='width' value='40'/><integer name='height' value='30'/>";
    let crop = "<integer name='crop_offset_x' value='3'/><integer name='crop_offset_y' value='4'/>\
                <integer name='crop_width' value='5'/>";
    let formats = "<string name='pixel_format' value='rgb'/><string name='file_format' value='openexr'/>\
                   <string name='component_format' value='float32'/><boolean name='sample_border' value='true'/>";
    let film = case(&format!("{size}{crop}{formats}"));
    assert_eq!((film.width, film.height), (40, 30));
    assert_eq!(film.crop, Some(Crop { x: 3, y: 4, width: 5, height: 26 }));
    assert_eq!(case("<rfilter type='box'/>").filter, Filter::Box);
    assert_eq!(case("<rfilter type='tent'/>").filter, Filter::Tent { radius: 1.0 });
    let tent = "<rfilter type='tent'><float name='radius' value='2'/></rfilter>";
    assert_eq!(case(tent).filter, Filter::Tent { radius: 2.0 });
    let gaussian = "<rfilter type='gaussian'><float name='stddev' value='0.7'/></rfilter>";
    assert_eq!(case(gaussian).filter, Filter::Gaussian { deviation: 0.7 });
}

#[test]
fn samplers() {
    for plugin in ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"] {
        let count = "<integer name='sample_count' value='64'/><integer name='seed' value='1'/>";
        let scene = camera(&format!("<sampler type='{plugin}'>{count}</sampler>"));
        assert_eq!(scene.samples, 64, "{plugin}");
    }
}

#[test]
fn transforms_are_applied_from_the_first_to_the_last() {
    let steps = "<scale x='2'/><translate x='1' y='0'/><rotate z='1' angle='90'/><scale value='3'/>\
                 <translate value='0, 0, 1'/><matrix value='0 1 0  1 0 0  0 0 1'/>";
    let mesh = shape(&format!("type='rectangle'><transform name='to_world'>{steps}</transform>"));
    // (1, 1, 0) → (2, 1, 0) → (3, 1, 0) → (−1, 3, 0) → (−3, 9, 0) → (−3, 9, 1) → (9, −3, 1)
    let found = mesh.positions()[2];
    assert!(close(found, DVec3::new(9.0, -3.0, 1.0)), "{found}");
}

#[test]
fn flat_shapes() {
    assert_eq!(shape("type='rectangle'>"), Mesh::rectangle());
    assert_eq!(shape("type='cube'><boolean name='face_normals' value='true'/>"), Mesh::cube());
    let flipped = shape("type='rectangle'><boolean name='flip_normals' value='true'/>");
    assert_eq!(flipped.triangles(), [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(flipped.uvs().unwrap().triangles, [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(*flipped.normals(), Normals::Face);
}

#[test]
fn obj_flips_texture_coordinates_unless_told_not_to() {
    let file = "type='obj'><string name='filename' value='quad.obj'/>";
    let mesh = shape(file);
    assert_eq!(mesh.uvs().unwrap().values, [DVec2::Y, DVec2::new(1.0, 0.75)]);
    assert!(matches!(mesh.normals(), Normals::AngleWeighted { count: 4, .. }));
    let mesh = shape(&format!("{file}<boolean name='flip_tex_coords' value='false'/>"));
    assert_eq!(mesh.uvs().unwrap().values[1], DVec2::new(1.0, 0.25));
}

#[test]
fn normals_of_mesh_files() {
    let file = "type='ply'><string name='filename' value='tri.ply'/>";
    let Normals::Given(given) = shape(file).normals().clone() else { panic!() };
    assert_eq!(given.values, [DVec3::Z; 3]);
    let mesh = shape(&format!("{file}<boolean name='face_normals' value='true'/>"));
    assert_eq!(*mesh.normals(), Normals::Face);
    let mesh = shape(&format!("{file}<boolean name='flip_normals' value='true'/>"));
    let Normals::Given(flipped) = mesh.normals() else { panic!() };
    assert_eq!((flipped.values[0], mesh.triangles()), (DVec3::NEG_Z, &[[0, 2, 1]][..]));
}

#[test]
fn materials_and_textures_are_shared_by_reference() {
    let scene = with(
        "<texture type='bitmap' id='t'><string name='filename' value='red.png'/></texture>\
         <bsdf type='diffuse' id='a'><ref name='reflectance' id='t'/></bsdf>\
         <bsdf type='twosided' id='b'><ref id='a'/></bsdf>\
         <shape type='cube' id='first'><ref id='b'/></shape><shape type='cube'><ref id='b'/></shape>\
         <shape type='cube'/><shape type='cube'/>\
         <shape type='cube'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'>\
           <string name='filename' value='red.png'/></texture></bsdf></shape>",
    )
    .unwrap();
    let materials: Vec<usize> = scene.shapes.iter().map(|s| s.material).collect();
    assert_eq!(materials, [1, 1, 2, 2, 3]);
    let ids: Vec<&str> = scene.shapes.iter().map(|s| s.id.as_str()).collect();
    assert_eq!(ids, ["first", "shape_1", "shape_2", "shape_3", "shape_4"]);
    let ids: Vec<&str> = scene.materials.iter().map(|m| m.id.as_str()).collect();
    assert_eq!(ids, ["a", "b", "default", "bsdf_3"]);
    assert_eq!(scene.textures.len(), 2);
    let texture = |i: usize| Bsdf::Diffuse { reflectance: Reflectance::Texture(i) };
    assert_eq!((&scene.materials[0].bsdf, &scene.materials[1].bsdf), (&texture(0), &texture(0)));
    assert_eq!(scene.materials[3].bsdf, texture(1));
}

/// The first row of a bitmap is at v = 0 in Mitsuba and at v = 1 in a texture.
#[test]
fn textures() {
    let case = |body: &str| {
        let file = "<string name='filename' value='red.png'/>";
        with(&format!("<texture type='bitmap'>{file}{body}</texture>")).unwrap().textures.remove(0)
    };
    let texture = case("");
    assert_eq!((texture.width, texture.height, texture.wrap), (1, 2, Wrap::Repeat));
    assert_eq!(texture.texels, [DVec3::X, DVec3::ZERO]);
    assert_eq!(texture.to_uv.transform_point2(DVec2::new(0.25, 0.0)), DVec2::new(0.25, 1.0));
    assert_eq!(case("<string name='wrap_mode' value='mirror'/>").wrap, Wrap::Mirror);
    let text = "<string name='wrap_mode' value='clamp'/><string name='filter_type' value='bilinear'/>\
                <boolean name='raw' value='true'/><string name='format' value='fp16'/>";
    assert_eq!(case(text).wrap, Wrap::Clamp);
    let scaled = case("<transform name='to_uv'><scale x='2' y='4'/></transform>").to_uv;
    assert_eq!(scaled.transform_point2(DVec2::new(0.25, 0.125)), DVec2::new(0.5, 0.5));
    let matrix = "<transform name='to_uv'><matrix value='0 1 .5  1 0 .25  0 0 1'/></transform>";
    assert_eq!(case(matrix).to_uv.transform_point2(DVec2::new(0.0, 1.0)), DVec2::new(1.5, 0.75));
}

#[test]
fn groups_and_their_copies() {
    let scene = with(
        "<shape type='shapegroup' id='g'><shape type='rectangle' id='a'/><shape type='cube'/></shape>\
        <shape type='instance' id='one'><ref id='g'/></shape>\
        <shape type='instance'><ref id='g'/><transform name='to_world'><translate x='5'/></transform></shape>",
    );
    let shapes = scene.unwrap().shapes;
    let names: Vec<&str> = shapes.iter().map(|shape| shape.id.as_str()).collect();
    assert_eq!(names, ["one_a", "one_shape_1", "shape_2_a", "shape_2_shape_3"]);
    assert_eq!(shapes[0].mesh, Mesh::rectangle());
    let moved = Mesh::cube().transformed(&DAffine3::from_translation(5.0 * DVec3::X));
    assert_eq!(shapes[3].mesh, moved);
}

#[test]
fn shapes_that_emit() {
    let area = "<emitter type='area'><rgb name='radiance' value='1 2 3'/></emitter>";
    let scene = with(&format!(
        "<shape type='cube'>{area}</shape><shape type='cube'><bsdf type='diffuse'/>{area}</shape>"
    ))
    .unwrap();
    assert_eq!(scene.shapes[0].radiance, Some(DVec3::new(1.0, 2.0, 3.0)));
    let black = Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::ZERO) };
    assert_eq!(scene.materials[scene.shapes[0].material].bsdf, black);
    assert_ne!(scene.materials[scene.shapes[1].material].bsdf, black);
}

#[test]
fn shapes_that_emit_a_texture() {
    let shape = |texture: &str| {
        with(&format!(
            "<shape type='rectangle'><emitter type='area'><texture name='radiance' {texture}</texture></emitter></shape>"
        ))
    };
    let scene = shape("type='bitmap'><string name='filename' value='red.png'/>").unwrap();
    let lamp = &scene.shapes[0];
    assert_eq!((lamp.radiance, lamp.radiance_texture), (Some(DVec3::ONE), Some(0)));
    assert_eq!(scene.textures[0].texels, [DVec3::X, DVec3::ZERO]);
    let negative = shape("type='checkerboard'><rgb name='color0' value='-1 0 0'/>");
    assert!(negative.is_err(), "light is not negative");
}

#[test]
fn lights() {
    let lights = |body: &str| with(&format!("<emitter {body}</emitter>")).unwrap().lights.remove(0);
    let point =
        "type='point' id='p'><point name='position' x='1' y='2' z='3'/><float name='intensity' value='5'/>";
    let expected = Light::Point {
        id: "p".to_owned(),
        position: DVec3::new(1.0, 2.0, 3.0),
        intensity: DVec3::splat(5.0),
    };
    assert_eq!(lights(point), expected);
    let moved = "type='point'><transform name='to_world'><translate y='4'/></transform>";
    let expected =
        Light::Point { id: "emitter_0".to_owned(), position: 4.0 * DVec3::Y, intensity: DVec3::ONE };
    assert_eq!(lights(moved), expected);

    let directional = |direction, irradiance, kappa| Light::Directional {
        id: "d".to_owned(),
        direction,
        irradiance,
        kappa,
    };
    let sun = "type='directional' id='d'><vector name='direction' value='0, -2, 0'/><rgb name='irradiance' value='#ff0000'/>";
    assert_eq!(lights(sun), directional(DVec3::NEG_Y, DVec3::X, f64::INFINITY));
    let soft = "type='directional' id='d'><transform name='to_world'><rotate x='1' angle='90'/></transform>\
                <float name='kappa' value='200'/>";
    let Light::Directional { direction, kappa, .. } = lights(soft) else { panic!() };
    assert!(close(direction, DVec3::NEG_Y) && kappa == 200.0);
}

#[test]
fn environments() {
    let case = |body: &str| with(&format!("<emitter {body}</emitter>")).unwrap();
    let scene = case("type='constant' id='c'><float name='radiance' value='.5'/>");
    assert_eq!(
        scene.environment,
        Some(Environment::Constant { id: "c".to_owned(), radiance: DVec3::splat(0.5) })
    );
    let scene = case(
        "type='envmap' id='e'><string name='filename' value='sky.exr'/><float name='scale' value='2'/>\
         <transform name='to_world'><rotate y='1' angle='90'/></transform>",
    );
    let Some(Environment::Map { texture, scale, to_world, .. }) = scene.environment else { panic!() };
    assert_eq!((texture, scale), (0, 2.0));
    assert!(to_world.abs_diff_eq(DMat3::from_rotation_y(90_f64.to_radians()), 1e-12));
    assert_eq!(scene.textures[0].texels, [DVec3::new(1.0, 2.0, 4.0), DVec3::ZERO]);
}

#[test]
fn names_with_values() {
    let text = "<scene version='3.0.0'><default name='w' value='12'/><default name='width' value='34'/>\
        <sensor type='perspective'><film type='hdrfilm'><integer name='width' value='$width'/>\
        <integer name='height' value='$w'/></film></sensor><bsdf type='diffuse' id='\\$$w'/></scene>";
    let scene = read(text).unwrap();
    assert_eq!((scene.film.width, scene.film.height), (34, 12));
    assert_eq!(scene.materials[0].id, "$12");
    let given = [("w".to_owned(), "56".to_owned())];
    let scene = read_scene(text.as_bytes(), here("dir/s.xml"), &given, &open).unwrap();
    assert_eq!((scene.film.width, scene.film.height), (34, 56));
}

#[test]
fn scenes_include_scenes_and_objects() {
    let scene = with("<include filename='part.xml'/><shape type='cube'><ref id='inc'/></shape>").unwrap();
    let Bsdf::Conductor { eta, .. } = scene.materials[0].bsdf else { panic!() };
    assert_eq!(eta, DVec3::splat(1.5));
}

#[test]
fn files_are_found_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "<?xml version='1.0' encoding='utf-8'?>\n<!-- é -->\n<scene version='3.0.0'>{SENSOR}\
         <shape type='ply'><string name='filename' value='meshes/a.ply'/></shape></scene>"
    );
    std::fs::create_dir(folder.path().join("meshes")).unwrap();
    crate::io::write_ply(&folder.path().join("meshes/a.ply"), &Mesh::cube()).unwrap();
    std::fs::write(folder.path().join("s.xml"), text).unwrap();
    let scene = load_scene(&folder.path().join("s.xml")).unwrap();
    assert_eq!(scene.shapes[0].mesh.triangles().len(), 12);
}
