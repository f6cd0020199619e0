//! Features of other programs that share the format, and their alternative names.

use glam::DVec3;

use super::scene::{SENSOR, material, read, with};
use super::{check_table, here, message};
use crate::io::{Note, ReadOptions, read_scene_with};
use crate::scene::{Bsdf, Environment, Placement, Reflectance};

fn notes(text: &str) -> Vec<Note> {
    let open = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    read_scene_with(text.as_bytes(), here("dir/s.xml"), &ReadOptions::default(), &open).unwrap().1
}

/// A polariser transmits half of unpolarised light, and a retarder does not change it.
#[test]
fn filters_of_polarised_light() {
    let opacity = |body: &str| material(body).opacity;
    let grey = |x: f64| Some(Reflectance::Constant(DVec3::splat(x)));
    assert_eq!(opacity("<bsdf type='null'/>"), grey(0.0));
    assert_eq!(opacity("<bsdf type='polarizer'><float name='theta' value='90'/></bsdf>"), grey(0.5));
    assert_eq!(
        opacity("<bsdf type='circular'><spectrum name='transmittance' value='.5'/></bsdf>"),
        grey(0.75)
    );
    assert_eq!(opacity("<bsdf type='retarder'><float name='delta' value='90'/></bsdf>"), grey(0.0));
    let Bsdf::Diffuse { reflectance } = material("<bsdf type='polarizer'/>").bsdf else { panic!() };
    assert_eq!(reflectance, Reflectance::Constant(DVec3::ZERO));
}

/// The index of metals is relative to that of the exterior.
#[test]
fn metals_in_a_medium() {
    for plugin in ["conductor", "roughconductor"] {
        let body = format!(
            "<bsdf type='{plugin}'><rgb name='eta' value='1 2 3'/><rgb name='k' value='3 4 5'/>\
             <float name='ext_eta' value='2'/></bsdf>"
        );
        let found = material(&body).bsdf.index_of_refraction().unwrap();
        assert_eq!(found, [DVec3::new(0.5, 1.0, 1.5), DVec3::new(1.5, 2.0, 2.5)]);
    }
}

#[test]
fn other_spellings() {
    let one = with("<shape type='Sphere' id='s'><bsdf type='disney' id='m'/></shape>").unwrap();
    let other = with("<shape type='sphere' id='s'><bsdf type='principled' id='m'/></shape>").unwrap();
    assert!(one == other);
    assert!(matches!(material("<bsdf type='disneythin'/>").bsdf, Bsdf::PrincipledThin(_)));
    // The old and the new name of a parameter, with one value.
    let both = |axis: &str| {
        read(&format!(
            "<scene version='0.5.0'><sensor type='perspective'><string name='fovAxis' value='x'/><string name='fov_axis' \
             value='{axis}'/></sensor></scene>"
        ))
    };
    assert!(both("x").is_ok());
    assert!(message(both("y")).contains("parameter \"fov_axis\" was given before"));
}

/// The whole scene is in view, as in Mitsuba 2: the cube from −1 to 1 as seen from −1 − 1/tan 22.5°.
#[test]
fn scenes_without_a_sensor() {
    let scene = read("<scene version='2.1.0'><shape type='cube'/></scene>").unwrap();
    let camera = &scene.camera;
    assert!((camera.origin - DVec3::new(0.0, 0.0, -2.0 - 2.0_f64.sqrt())).length() < 1e-12, "{camera:?}");
    assert_eq!((camera.forward, camera.right, camera.up), (DVec3::Z, DVec3::NEG_X, DVec3::Y));
    assert!((camera.field_of_view - 45_f64.to_radians()).abs() < 1e-15);
    assert_eq!((scene.film.width, scene.film.height, scene.samples), (768, 576, 4));
}

/// Samplers and films may stand beside the sensor that refers to them.
#[test]
fn parts_of_a_sensor_beside_it() {
    let scene = read(
        "<scene version='2.1.0'><sampler type='bose' id='s'><integer name='sample_count' value='25'/></sampler><film \
         type='hdrfilm' id='f'><integer name='width' value='7'/></film><sensor type='perspective'><ref id='s'/><ref \
         id='f'/></sensor></scene>",
    )
    .unwrap();
    assert_eq!((scene.samples, scene.film.width), (25, 7));
}

/// The image is the steady-state one, the first that such programs output.
#[test]
fn films_that_resolve_time() {
    let text = "<scene version='3.3.0'><integrator type='transient_path'><boolean name='camera_unwarp' value='false'/>\
                <integer name='max_depth' value='5'/><string name='temporal_filter' value='box'/></integrator><sensor \
                type='perspective'><film type='transient_hdr_film'><integer name='width' value='40'/><integer \
                name='temporal_bins' value='400'/><float name='start_opl' value='1000'/><float name='bin_width_opl' \
                value='6.5'/><rfilter type='box'/><rfilter name='tfilter' type='gaussian'/></film></sensor></scene>";
    let scene = read(text).unwrap();
    assert_eq!((scene.integrator.max_depth, scene.film.width), (Some(5), 40));
    let notes = notes(text);
    let told = notes.iter().filter(|note| note.text.contains("light at all times")).count();
    assert_eq!(told, 7, "{notes:?}");
}

/// An integrator without light transport is rendered as `path`; in lenient mode an unsupported sky becomes a
/// constant one.
#[test]
fn what_stands_for_another() {
    let text = format!(
        "<scene version='3.0.0'><integrator type='aov'><string name='aovs' value='d:depth'/></integrator>{SENSOR}</scene>"
    );
    assert_eq!(read(&text).unwrap().integrator.max_depth, None);
    assert!(notes(&text).iter().any(|note| note.text.contains("in its place path is rendered")));
    let sky = format!(
        "<scene version='3.0.0'>{SENSOR}<emitter type='sunsky'><float name='turbidity' value='3'/></emitter></scene>"
    );
    assert!(message(read(&sky)).contains("emitter \"sunsky\" is not supported"));
    let options = ReadOptions { is_lenient: true, ..ReadOptions::default() };
    let open = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let (scene, notes) = read_scene_with(sky.as_bytes(), here("dir/s.xml"), &options, &open).unwrap();
    assert!(
        matches!(scene.environment, Some(Environment::Constant { radiance, .. }) if radiance == DVec3::ONE)
    );
    assert!(
        notes.iter().any(|note| note.text.ends_with("is read as a constant sky of radiance 1")),
        "{notes:?}"
    );
}

/// Glass may be mixed with paper, other glass or a mirror, with its own two sides; filters and `twosided` may
/// not.
#[test]
fn mixtures_of_what_light_passes() {
    let (glass, paper) = ("<bsdf type='dielectric'/>", "<bsdf type='diffuse'/>");
    let mixed = |first: &str, second: &str| {
        format!("<bsdf type='blendbsdf'><float name='weight' value='0.25'/>{first}{second}</bsdf>")
    };
    for (first, second) in [(glass, paper), (paper, glass), (glass, "<bsdf type='roughdielectric'/>")] {
        assert!(with(&mixed(first, second)).unwrap().materials[1].blend.is_some());
    }
    for (text, expected) in [
        (mixed("<bsdf type='null'/>", glass), "a filter as one of two materials is not supported"),
        (mixed(glass, "<bsdf type='null'/>"), "as one of two materials is not supported"),
        (
            format!("<bsdf type='twosided'>{}</bsdf>", mixed(paper, glass)),
            "twosided around a material that light",
        ),
        (format!("<bsdf type='twosided'>{paper}{glass}</bsdf>"), "as one of two materials is not supported"),
    ] {
        let found = message(with(&text));
        assert!(found.contains(expected), "{found}");
    }
}

/// `to_world` transforms control points, and leaves radii unchanged.
#[test]
fn curves_in_a_scene() {
    let open = |_: &std::path::Path| Ok("0 0 0 .5\n1 0 0 .5\n2 0 0 .5\n3 0 0 .5\n".into());
    let curve = |plugin: &str| {
        let text = format!(
            "<scene version='3.0.0'>{SENSOR}<shape type='{plugin}'><string name='filename' value='c.txt'/><transform \
             name='to_world'><scale value='4'/><translate y='7'/></transform></shape></scene>"
        );
        let (scene, notes) =
            read_scene_with(text.as_bytes(), here("dir/s.xml"), &ReadOptions::default(), &open).unwrap();
        assert!(notes.iter().any(|note| note.is_geometric), "{notes:?}");
        let positions = scene.shapes[0].mesh.positions().to_vec();
        positions.iter().fold((positions[0], positions[0]), |(low, high), p| (low.min(*p), high.max(*p)))
    };
    let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-3, "{a} {b}");
    let (low, high) = curve("bsplinecurve");
    near(low, DVec3::new(4.0, 6.5, -0.5));
    near(high, DVec3::new(8.0, 7.5, 0.5));
    let (low, high) = curve("linearcurve");
    near(low, DVec3::new(-0.5, 6.5, -0.5));
    near(high, DVec3::new(12.5, 7.5, 0.5));
}

/// The limit on curves applies to all curves of a scene together.
#[test]
fn too_many_curves() {
    let open = |_: &std::path::Path| Ok("0 0 0 .5\n1 0 0 .5\n".repeat(100).into());
    let curve = "<shape type='linearcurve'><string name='filename' value='c.txt'/></shape>\n";
    let read = |count: usize| {
        let text = format!("<scene version='3.0.0'>{SENSOR}\n{}</scene>", curve.repeat(count));
        read_scene_with(text.as_bytes(), here("dir/s.xml"), &ReadOptions::default(), &open)
    };
    let (scene, _) = read(1).unwrap();
    let most = (1 << 21) / scene.shapes[0].mesh.sources().len();
    assert!((1..20).contains(&most), "{most}");
    let found = message(read(most + 1));
    let place = format!("dir/s.xml:{}:1: ", most + 2);
    assert!(found.starts_with(&place) && found.contains("more than 2^21 vertices"), "{found}");
}

/// An instance of an implicit surface is an implicit surface at another place.
#[test]
fn instances_of_grids() {
    let copy = |transform: &str| {
        with(&format!(
            "<shape type='shapegroup' id='g'><shape type='sdfgrid' id='ball'><float name='radius' value='.5'/><transform \
             name='to_world'><translate x='1'/></transform></shape></shape><shape type='instance' id='i'><ref \
             id='g'/><transform name='to_world'>{transform}</transform></shape>"
        ))
    };
    let scene = copy("<scale value='2'/><rotate z='1' angle='90'/><translate z='3'/>").unwrap();
    let [copied] = &scene.implicits[..] else { panic!() };
    let Placement { scale, rotation, translation } = copied.placement;
    assert_eq!(copied.id, "i_ball");
    assert!((scale - 2.0).abs() < 1e-12 && (translation - DVec3::new(0.0, 2.0, 3.0)).length() < 1e-12);
    assert!((rotation * DVec3::X - DVec3::Y).length() < 1e-12);
    assert!(message(copy("<scale x='2'/>")).contains("a rigid motion"));
}

#[test]
fn what_is_refused_of_them() {
    let refused = |text: &str| message(with(text));
    check_table(
        "
<bsdf type='polarizer'><rgb name='transmittance' value='1 .5 .2'/></bsdf>
    dir/s.xml:1:52: transmittance=\"[1, 0.5, 0.2]\": expected one number between 0 and 1
<bsdf type='twosided'><bsdf type='polarizer'/></bsdf>
    dir/s.xml:1:52: twosided around a material that light passes is not supported; leave out twosided: such a material has two sides
",
        refused,
    );
}
