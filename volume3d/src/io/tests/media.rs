//! Media in scenes.

use glam::DVec3;

use super::scene::{read, with};
use super::{check_table, here, message};
use crate::geometry::Mesh;
use crate::io::{ReadOptions, load_scene, read_scene_with, write_scene};
use crate::scene::{Boundary, Bsdf, Camera, Description, Film, Filter, Material, Medium, Reflectance, Scene};

/// A transparent cube with this content.
fn cube(inside: &str) -> Result<Description, crate::io::Error> {
    with(&format!("<integrator type='volpath'/><shape type='cube'><bsdf type='null'/>{inside}</shape>"))
}

fn interior(parameters: &str) -> Medium {
    let text = format!("<medium name='interior' type='homogeneous'>{parameters}</medium>");
    let scene = cube(&text).unwrap();
    assert_eq!(scene.shapes[0].boundary, Some(Boundary { interior: Some(0), exterior: None }));
    scene.media[0].clone()
}

/// A medium within an opaque surface is invisible; others are visible if the integrator supports media.
#[test]
fn media_are_read_where_they_are_seen() {
    let medium = "<medium name='interior' type='homogeneous'><rgb name='sigma_t' value='1'/></medium>";
    let media = |integrator: &str, bsdf: &str, medium: &str| {
        let text = format!("<integrator type='{integrator}'/><shape type='cube'>{bsdf}{medium}</shape>");
        with(&text).unwrap().media.len()
    };
    let glass = "<bsdf type='dielectric'/>";
    let outside = medium.replace("interior", "exterior");
    let mask = "<bsdf type='mask'><bsdf type='diffuse'/></bsdf>";
    for bsdf in [glass, mask, "<bsdf type='null'/>"] {
        for integrator in ["volpath", "volpathmis", "prbvolpath"] {
            assert_eq!(media(integrator, bsdf, medium), 1, "{integrator} {bsdf}");
        }
        assert_eq!(media("path", bsdf, medium), 0, "{bsdf}");
    }
    assert_eq!(media("volpath", "<bsdf type='diffuse'/>", medium), 0);
    assert_eq!(media("volpath", "<bsdf type='diffuse'/>", &outside), 1);
    assert_eq!(media("path", glass, &outside), 0);
    let around = |inner: &str| {
        with(&format!(
            "<integrator type='moment'><integrator type='{inner}'/></integrator><medium id='m' type='a'/><shape \
             type='cube'>{glass}<ref name='interior' id='m'/></shape>"
        ))
    };
    assert!(around("direct").is_ok());
    let found = message(around("volpathmis"));
    assert!(found.ends_with("medium \"a\" is not supported; supported: homogeneous"), "{found}");
}

#[test]
fn coefficients_in_all_their_forms() {
    let near = |a: DVec3, b: [f64; 3]| assert!((a - DVec3::from_array(b)).length() < 1e-12, "{a} {b:?}");
    let usual = interior("");
    assert_eq!((usual.extinction, usual.albedo, usual.asymmetry), (DVec3::ONE, DVec3::splat(0.75), 0.0));
    let scaled = interior(
        "<rgb name='sigma_t' value='0.5 1 2'/><float name='albedo' value='0.25'/><float name='scale' value='3'/><phase \
         type='isotropic'/>",
    );
    near(scaled.extinction, [1.5, 3.0, 6.0]);
    near(scaled.albedo, [0.25; 3]);
    let parts =
        "<rgb name='sigmaS' value='1 0 3'/><rgb name='sigmaA' value='1 0 1'/><float name='scale' value='2'/>";
    let old = interior(&parts.replace("sigmaS", "sigma_s").replace("sigmaA", "sigma_a"));
    near(old.extinction, [4.0, 0.0, 8.0]);
    near(old.albedo, [0.5, 0.0, 0.75]);
    let volumes = interior(
        "<volume type='constvolume' name='albedo'><rgb name='value' value='0.1 0.2 0.3'/></volume><phase type='hg'>\
         <float name='g' value='-0.5'/></phase><boolean name='sample_emitters' value='true'/>",
    );
    near(volumes.albedo, [0.1, 0.2, 0.3]);
    assert_eq!((volumes.asymmetry, interior("<phase type='hg'/>").asymmetry), (-0.5, 0.8));
    let before_2 = format!(
        "<scene version='0.5.0'><integrator type='volpath'/><sensor type='perspective'/><shape type='cube'><bsdf \
         type='null'/><medium name='interior' type='homogeneous'>{parts}</medium></shape></scene>"
    );
    let before_2 = read(&before_2).unwrap();
    near(before_2.media[0].extinction, [4.0, 0.0, 8.0]);
}

/// A medium with several references is one medium, and the sensor may be inside it.
#[test]
fn one_medium_for_many() {
    let scene = read(
        "<scene version='3.0.0'><integrator type='volpath'/><phase type='hg' id='p'/><medium id='fog' type='homogeneous'>\
         <ref id='p'/></medium><sensor type='perspective'><ref name='medium' id='fog'/></sensor><emitter type='point'>\
         <point name='position' x='0' y='0' z='0'/><ref id='fog'/></emitter>\
         <shape type='cube'><ref name='exterior' id='fog'/></shape><shape type='sphere'><bsdf type='dielectric'/>\
         <ref name='exterior' id='fog'/><medium name='interior' type='homogeneous'/></shape><shape type='cube'/></scene>",
    )
    .unwrap();
    let ids: Vec<&str> = scene.media.iter().map(|m| m.id.as_str()).collect();
    assert_eq!((ids, scene.camera_medium), (vec!["fog", "medium_1"], Some(0)));
    let boundaries: Vec<_> = scene.shapes.iter().map(|shape| shape.boundary).collect();
    let outside = Boundary { interior: None, exterior: Some(0) };
    assert_eq!(boundaries, [Some(outside), Some(Boundary { interior: Some(1), ..outside }), None]);
    assert_eq!(scene.media[0].asymmetry, 0.8);
}

#[test]
fn what_makes_no_medium_is_refused_with_its_place() {
    let table = r#"
<rgb name='sigma_t' value='1 -1 1'/>
    dir/s.xml:2:1: sigma_t="[1, -1, 1]": expected numbers of at least 0
<rgb name='albedo' value='0.5 1.5 1'/>
    dir/s.xml:2:1: albedo="[0.5, 1.5, 1]": expected numbers between 0 and 1
<float name='scale' value='-2'/>
    dir/s.xml:2:1: scale="-2": expected a number of at least 0
<phase type='hg'><float name='g' value='1'/></phase>
    dir/s.xml:2:18: g="1": expected a number between −1 and 1, without these
<phase type='sggx'/>
    dir/s.xml:2:1: phase "sggx" is not supported; supported: isotropic, hg
<phase type='hg'/><phase type='hg'/>
    dir/s.xml:2:19: 2 <phase> in medium "homogeneous"; expected at most one
<rgb name='sigma_s' value='1'/>
    medium "homogeneous" needs sigma_a beside sigma_s
<rgb name='sigma_a' value='1'/>
    medium "homogeneous" needs sigma_s beside sigma_a
<rgb name='sigma_a' value='1'/><rgb name='albedo' value='1'/>
    medium "homogeneous" takes either sigma_t and albedo or sigma_s and sigma_a, not both
<volume name='albedo' type='gridvolume'/>
    dir/s.xml:2:1: volume "gridvolume" is not supported; supported: constvolume
<string name='material' value='skin1'/>
    dir/s.xml:2:1: medium "homogeneous" has no parameter "material" here; supported: scale, sigma_t, albedo, sigma_s, sigma_a
"#;
    // The error's position is that of the medium.
    let refused = |text: &str| {
        let found = message(cube(&format!("<medium name='interior' type='homogeneous'>\n{text}</medium>")));
        let own = found.strip_prefix("dir/s.xml:1:").and_then(|rest| rest.split_once(": "));
        own.map_or(found.clone(), |(_, rest)| rest.to_owned())
    };
    check_table(table, refused);
    let found = message(cube("<medium name='interior' type='heterogeneous'/>"));
    assert!(found.ends_with("medium \"heterogeneous\" is not supported; supported: homogeneous"), "{found}");
    // A medium that is neither interior nor exterior.
    let found = message(cube("<medium type='homogeneous'/>"));
    assert!(found.contains("<medium> is not supported inside shape \"cube\""), "{found}");
    let orthographic = "<scene version='3.0.0'><integrator type='volpath'/><sensor type='orthographic'><medium \
                        type='homogeneous'/></sensor></scene>";
    let found = message(read(orthographic));
    assert!(found.contains("an orthographic sensor within a medium is not supported"), "{found}");
}

/// In lenient mode an unsupported medium is ignored, with a note.
#[test]
fn leniently_the_rest_is_read() {
    let text = "<scene version='3.0.0'><integrator type='volpath'/><sensor type='perspective'/><shape type='cube'><bsdf \
                type='null'/><medium name='interior' type='heterogeneous'/></shape></scene>";
    let options = ReadOptions { is_lenient: true, ..ReadOptions::default() };
    let none = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let (scene, notes) = read_scene_with(text.as_bytes(), here("dir/s.xml"), &options, &none).unwrap();
    assert_eq!((scene.media.len(), scene.shapes.len()), (0, 1));
    assert!(notes.iter().any(|note| note.text.starts_with("the medium is left out, because")), "{notes:?}");
}

/// A written scene is read again to the last digit.
#[test]
fn media_come_back() {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, 0.7);
    let mut d = Description::new(
        camera,
        Film { width: 2, height: 2, crop: None, sample_border: true, filter: Filter::Box },
    );
    let black = Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::ZERO) };
    let opacity = Some(Reflectance::Constant(DVec3::ZERO));
    let clear = d.add_material(Material { opacity, ..Material::new("clear", black, false) });
    let medium = |id: &str, extinction, asymmetry| {
        let (id, albedo) = (id.to_owned(), DVec3::new(0.1, 1.0 / 3.0, 0.9));
        Medium { id, extinction, albedo, asymmetry }
    };
    d.media.push(medium("fog", DVec3::new(0.1, 1.0 / 3.0, 0.0), -0.3));
    d.media.push(medium("clear", DVec3::new(70.1, 1.0 / 3.0, 5.0), 0.0));
    d.camera_medium = Some(0);
    d.add_shape("cube", Mesh::cube(), clear);
    d.add_shape("core", Mesh::cube(), clear);
    d.shapes[0].boundary = Some(Boundary { interior: Some(1), exterior: Some(0) });
    d.shapes[1].boundary = Some(Boundary { interior: None, exterior: Some(1) });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    write_scene(&path, &Scene::new(d.clone()).unwrap()).unwrap();
    let again = load_scene(&path).unwrap();
    assert_eq!(again.camera_medium, d.camera_medium);
    for (a, b) in d.media.iter().zip(&again.media) {
        assert_eq!((a.extinction, a.albedo, a.asymmetry), (b.extinction, b.albedo, b.asymmetry));
    }
    let boundaries = |d: &Description| d.shapes.iter().map(|shape| shape.boundary).collect::<Vec<_>>();
    assert_eq!(boundaries(&again), boundaries(&d));
}
