//! Features of public scenes: versions before 2, search folders, aliases, curved shapes, spectra, and
//! options.

use glam::{DAffine2, DVec2, DVec3};

use super::scene::{SENSOR, open, read, with};
use super::{here, message};
use crate::geometry::{Normals, TOLERANCE};
use crate::io::{Note, ReadOptions, read_scene_with};
use crate::scene::{Bsdf, Description, Reflectance};

/// A scene with the simplest camera, and its notes.
fn noted(body: &str, options: &ReadOptions) -> (Description, Vec<Note>) {
    let text = format!("<scene version='3.0.0'>{SENSOR}{body}</scene>");
    read_scene_with(text.as_bytes(), here("dir/s.xml"), options, &open).unwrap()
}

fn lenient() -> ReadOptions {
    ReadOptions { is_lenient: true, ..ReadOptions::default() }
}

fn reflectance(scene: &Description) -> DVec3 {
    match scene.materials[0].bsdf.reflectance() {
        Reflectance::Constant(colour) => *colour,
        Reflectance::Texture(_) => panic!("a colour"),
    }
}

/// A scene in versions 0.5 and 3.
#[test]
fn old_names() {
    let old = read(
        "<scene version='0.5.0'><integrator type='path'><integer name='maxDepth' value='3'/></integrator><sensor \
         type='perspective'><float name='nearClip' value='1'/><string name='fovAxis' value='smaller'/><transform \
         name='toWorld'><lookAt origin='0 0 5' target='0 0 0' up='0 1 0'/></transform><sampler type='independent'><integer \
         name='sampleCount' value='7'/></sampler></sensor><texture type='checkerboard' id='t'><float name='uscale' \
         value='4'/><float name='voffset' value='.5'/></texture><bsdf type='diffuse' id='m'><spectrum \
         name='diffuseReflectance' value='.1, .2, .3'/></bsdf><shape type='cube' id='c'><transform name='toWorld'><scale \
         value='2'/></transform><ref id='m'/></shape></scene>",
    )
    .unwrap();
    let new = read(
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='3'/></integrator><sensor \
         type='perspective'><float name='near_clip' value='1'/><string name='fov_axis' value='smaller'/><transform \
         name='to_world'><lookat origin='0 0 5' target='0 0 0' up='0 1 0'/></transform><sampler type='independent'><integer \
         name='sample_count' value='7'/></sampler></sensor><texture type='checkerboard' id='t'><transform \
         name='to_uv'><translate y='.5'/><scale x='4'/></transform></texture><bsdf type='diffuse' id='m'><rgb \
         name='reflectance' value='.1, .2, .3'/></bsdf><shape type='cube' id='c'><transform name='to_world'><scale \
         value='2'/></transform><ref id='m'/></shape></scene>",
    )
    .unwrap();
    assert!(old == new);
}

#[test]
fn search_folders_and_aliases() {
    let scene = with(
        "<path value='far'/><include filename='part/leaf.xml'/><alias id='twig' as='leaf'/><shape type='obj'><string \
         name='filename' value='away.obj'/><ref id='leaf'/></shape>",
    )
    .unwrap();
    assert_eq!(scene.materials[0].id, "twig");
    assert_eq!(scene.shapes[0].mesh.triangles().len(), 2);
    let missing = message(with(
        "<path value='far'/><shape type='obj'><string name='filename' value='no.obj'/></shape>",
    ));
    assert!(missing.ends_with("cannot find \"no.obj\"; looked for: dir/far/no.obj, dir/no.obj"), "{missing}");
    let serialized = "<shape type='serialized'><string name='filename' value='two.serialized'/><integer \
        name='shape_index' value='1'/></shape>";
    assert_eq!(with(serialized).unwrap().shapes[0].mesh.positions()[0], 0.5 * DVec3::X);
}

/// Curved shapes have the positions of the format, with a note.
#[test]
fn curved_shapes() {
    let (scene, notes) = noted(
        "<shape type='sphere' id='s'><point name='center' x='1' y='2' z='3'/><float name='radius' value='2'/></shape><shape \
         type='cylinder'><point name='p0' x='1' y='0' z='0'/><point name='p1' x='4' y='0' z='0'/><float name='radius' \
         value='.5'/></shape><shape type='disk'><boolean name='flip_normals' value='true'/></shape>",
        &ReadOptions::default(),
    );
    assert_eq!(notes.iter().filter(|note| note.is_geometric).count(), 3);
    assert!(
        notes[0].to_string().contains("sphere `s` is a mesh of 10608 triangles, within 0.1 %"),
        "{}",
        notes[0]
    );
    let [sphere, cylinder, disk] = [0, 1, 2].map(|k| &scene.shapes[k].mesh);
    let center = DVec3::new(1.0, 2.0, 3.0);
    assert!(sphere.positions().iter().all(|p| ((*p - center).length() - 2.0).abs() < 1e-14));
    let facing = |mesh: &crate::geometry::Mesh, axis: &dyn Fn(DVec3) -> DVec3, sign: f64| {
        let Normals::Given(normals) = mesh.normals() else { panic!("given") };
        for (t, n) in mesh.triangles().iter().zip(&normals.triangles) {
            let [a, b, c] = t.map(|k| mesh.positions()[k as usize]);
            let middle = (a + b + c) / 3.0;
            assert!(sign * (b - a).cross(c - a).dot(middle - axis(middle)) > 0.0);
            assert!(sign * normals.values[n[0] as usize].dot(a - axis(a)) > 0.0);
        }
    };
    facing(sphere, &|_| center, 1.0);
    facing(cylinder, &|p| DVec3::new(p.x, 0.0, 0.0), 1.0);
    facing(disk, &|p| p - DVec3::Z, -1.0);
    for p in cylinder.positions() {
        assert!((p.y.hypot(p.z) - 0.5).abs() < 1e-14 && (p.x == 1.0 || (p.x - 4.0).abs() < 1e-14), "{p}");
    }
    const { assert!(TOLERANCE <= 1e-3) };
}

/// The halves of a checkerboard and their mean, and the direction of a translation.
#[test]
fn checkerboards() {
    let scene = with(
        "<texture type='checkerboard'><rgb name='color0' value='1 0 0'/><float name='color1' value='.5'/><transform \
         name='to_uv'><scale x='2' y='3'/><translate x='.25' y='.5'/></transform></texture>",
    )
    .unwrap();
    let texture = &scene.textures[0];
    let n = texture.width;
    assert_eq!(texture.texels[0], DVec3::X);
    assert_eq!(texture.texels[n - 1], DVec3::splat(0.5));
    assert_eq!(texture.texels[n * n - 1], DVec3::X);
    let mean = texture.texels.iter().sum::<DVec3>() / (n * n) as f64;
    assert!((mean - DVec3::new(0.75, 0.25, 0.25)).length() < 1e-12);
    let flip = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
    let at = (flip * texture.to_uv).transform_point2(DVec2::new(0.5, 0.5));
    assert!((at - DVec2::new(1.25, 2.0)).length() < 1e-12, "{at}");
}

/// A step becomes a ramp centred at it.
#[test]
fn nearest_texels() {
    let scene = with(
        "<texture type='bitmap'><string name='filename' value='red.png'/><string name='filter_type' \
         value='nearest'/></texture>",
    )
    .unwrap();
    let texture = &scene.textures[0];
    assert_eq!((texture.width, texture.height), (16, 32));
    assert_eq!([texture.texels[0], texture.texels[16 * 16 - 1]], [DVec3::X; 2]);
    assert_eq!(texture.texels[16 * 16], DVec3::ZERO);
}

/// The colours that Mitsuba 3.9 reads in its RGB variants.
#[test]
fn spectra() {
    let close = |found: DVec3, expected: [f64; 3]| {
        let expected = DVec3::from_array(expected);
        assert!((found - expected).abs().max_element() < 3e-3 * expected.max_element(), "{found} {expected}");
    };
    let diffuse = |spectrum: &str| {
        let scene = with(&format!("<bsdf type='diffuse'><spectrum name='reflectance' {spectrum}/></bsdf>"));
        reflectance(&scene.unwrap())
    };
    close(diffuse("value='400:0.78, 500:0.78, 600:0.78, 700:0.78'"), [0.776_367, 0.779_81, 0.776_029]);
    assert_eq!(diffuse("value='.25'"), DVec3::splat(0.25));
    assert!(diffuse("filename='far/red.spd'").x > 0.1);
    let intensity = |spectrum: &str| {
        let text = format!(
            "<emitter type='point'><point name='position' value='0'/><spectrum name='intensity' {spectrum}</emitter>"
        );
        match &with(&text).unwrap().lights[0] {
            crate::scene::Light::Point { intensity, .. } => *intensity,
            light => panic!("{light:?}"),
        }
    };
    close(intensity("value='400:0, 500:8, 600:15.6, 700:18.4'/>"), [20.7108, 10.8546, 2.771_15]);
    close(intensity("value='3'/>"), [3.614_38, 2.844_87, 2.726_75]);
    assert_eq!(intensity("type='d65'/>"), DVec3::ONE);
    let regular = "type='regular'><float name='wavelength_min' value='400'/><float name='wavelength_max' \
        value='700'/><string name='values' value='0, 6.133333, 12.266667, 18.4'/></spectrum>";
    assert_eq!(intensity(regular), intensity("value='400:0 500:6.133333 600:12.266667 700:18.4'/>"));
}

#[test]
fn named_metals() {
    let scene = with("<bsdf type='conductor'><string name='material' value='Au'/></bsdf>").unwrap();
    let Bsdf::Conductor { eta, k, .. } = scene.materials[0].bsdf else { panic!("a conductor") };
    assert!((eta - DVec3::new(0.143, 0.375, 1.442)).length() < 1e-3, "{eta}");
    assert!((k - DVec3::new(3.983, 2.386, 1.603)).length() < 1e-3, "{k}");
}

/// Another film size shows the same view: half the width at distance 1 is that of `fov` along its axis.
#[test]
fn sizes() {
    let view = |axis: &str, size| {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/><string name='fov_axis' \
             value='{axis}'/><film type='hdrfilm'><integer name='width' value='300'/><integer name='height' \
             value='200'/></film></sensor></scene>"
        );
        let options = ReadOptions { size, ..ReadOptions::default() };
        let scene = read_scene_with(text.as_bytes(), here("dir/s.xml"), &options, &open).unwrap().0;
        assert_eq!((scene.film.width, scene.film.height), size.unwrap_or((300, 200)));
        (0.5 * scene.camera.field_of_view).tan()
    };
    let half = 20_f64.to_radians().tan();
    assert!((view("x", Some((60, 60))) - half).abs() < 1e-12);
    assert!((view("y", Some((60, 30))) - 2.0 * half).abs() < 1e-12);
    assert!((view("smaller", Some((60, 40))) - view("smaller", None)).abs() < 1e-12);
}

const TWO_WRONG: &str = "\n<bsdf type='velvet' id='m'><rgb name='reflectance' value='.1 .2 .3'/></bsdf>\n<shape \
    type='cube'><ref id='m'/></shape>\n<integrator type='depth'/>";

/// All errors are reported, each once.
#[test]
fn several_problems() {
    let text = message(with(TWO_WRONG));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert_eq!(lines[0], "2 problems:");
    assert!(lines[1].starts_with("  dir/s.xml:4:1: integrator \"depth\" is not supported"), "{text}");
    assert!(lines[2].starts_with("  dir/s.xml:2:1: bsdf \"velvet\" is not supported"), "{text}");
}

/// In lenient mode the diffuse part remains, and every replacement is noted.
#[test]
fn lenient_reading() {
    let (scene, notes) = noted(TWO_WRONG, &lenient());
    assert_eq!(reflectance(&scene), DVec3::new(0.1, 0.2, 0.3));
    assert!(scene.materials[scene.shapes[0].material].two_sided);
    assert!(notes.len() >= 2 && notes.iter().any(|note| note.text.contains("velvet")), "{notes:?}");
    let wrong = "<shape type='cube'><float name='wobble' value='1'/></shape><emitter type='sky'/>";
    let (scene, notes) = noted(wrong, &lenient());
    assert_eq!((scene.shapes.len(), scene.lights.len(), notes.len()), (1, 0, 2), "{notes:?}");
}

/// The image of a nested integrator is rendered.
#[test]
fn integrators_around_others() {
    let scene = with(
        "<integrator type='moment'><integrator type='direct'/></integrator><emitter type='area' id='a'/><shape \
         type='cube'><ref id='a'/></shape>",
    )
    .unwrap();
    assert_eq!(scene.integrator.max_depth, Some(2));
    assert_eq!(scene.shapes[0].radiance, Some(DVec3::ONE));
}
