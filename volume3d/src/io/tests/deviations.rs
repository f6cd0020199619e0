//! A scene for every row of the guide's page of deviations, to verify the page.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec3;

use super::here;
use crate::geometry::Normals;
use crate::gradient::{Progress, render};
use crate::io::{Error, Note, ReadOptions, read_scene_with};
use crate::scene::{Bsdf, Description, Environment, Filter, Light, Scene};
use crate::sdf::Interpolation;

const PAGE: &str = include_str!("../../../guide/deviations.md");

const SENSOR: &str = "<sensor type='perspective'><float name='fov' value='30'/><transform name='to_world'>\
    <lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='4'/>\
    <integer name='height' value='4'/><rfilter type='box'/></film></sensor>";

/// Files: a folded sheet whose two faces meet in a seam of texture coordinates, two faces with normals
/// towards the back, smooth normals, a dented face, a curve.
fn open(path: &Path) -> std::io::Result<Vec<u8>> {
    let text = match path.file_name().and_then(|name| name.to_str()) {
        Some("seam.obj") => {
            "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\nvt 0 0\nvt 1 1\nvt .5 .5\nf 1/1 2/1 3/1 4/1\nf 4/2 3/2 5/3 6/3\n"
        }
        Some("turned.obj") => "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 -1\nf 1//1 2//1 3//1\n",
        Some("smooth.obj") => "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nvn .6 0 .8\nf 1//1 2//2 3//2\n",
        Some("dent.obj") => "v 0 0 0\nv 2 0 0\nv .2 .2 0\nv 0 2 0\nf 2 3 4 1\n",
        Some("mixed.obj") => "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/2 3/2\nf 1 3 4\n",
        Some("coordinates.ply") => {
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n"
        }
        Some("curve.txt") => "0 0 0 .5\n1 0 0 .5\n2 0 0 .5\n3 0 0 .5\n",
        Some("faces.ply") => {
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nproperty uchar r\nproperty uchar g\nproperty uchar b\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 51 0\n"
        }
        Some("small.exr") => {
            let image = image::ImageBuffer::from_raw(1, 1, vec![1.0_f32, 2.0, 4.0]).unwrap();
            return Ok(super::encoded(image::ImageFormat::OpenExr, image::DynamicImage::ImageRgb32F(image)));
        }
        _ => return Err(std::io::ErrorKind::NotFound.into()),
    };
    Ok(text.as_bytes().to_vec())
}

fn read_as(text: &str, is_lenient: bool) -> Result<(Description, Vec<Note>), Error> {
    let options = ReadOptions { is_lenient, ..ReadOptions::default() };
    read_scene_with(text.as_bytes(), here("dir/s.xml"), &options, &open)
}

fn whole(text: &str) -> (Description, Vec<Note>) {
    read_as(&format!("<scene version='3.0.0'>{text}</scene>"), false).unwrap_or_else(|e| panic!("{e}"))
}

/// Reads a scene with a sensor and this content.
fn scene(body: &str) -> Description {
    whole(&format!("{SENSOR}{body}")).0
}

fn is_noted(body: &str, words: &str) {
    let notes = whole(&format!("{SENSOR}{body}")).1;
    assert!(notes.iter().any(|note| note.text.contains(words)), "{words}: {notes:?}");
}

fn is_refused(body: &str, words: &str) {
    let text = format!("<scene version='3.0.0'>{SENSOR}{body}</scene>");
    let message = read_as(&text, false).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains(words), "{words}: {message}");
}

/// The mean of an image.
fn shown(body: &str) -> f64 {
    let scene = Scene::new(scene(body)).unwrap();
    let pixels = render(&scene, 256, 1, &Progress::none()).unwrap().image.pixels;
    pixels.iter().map(|p| p.element_sum() / 3.0).sum::<f64>() / pixels.len() as f64
}

fn file(plugin: &str, name: &str, more: &str) -> String {
    format!("<shape type='{plugin}'><string name='filename' value='{name}'/>{more}</shape>")
}

const EMITS: &str = "<emitter type='area'><rgb name='radiance' value='1'/></emitter>";
const SKY: &str = "<emitter type='constant'><rgb name='radiance' value='1'/></emitter>";
/// A square that fills the film.
const WALL: &str = "<transform name='to_world'><scale value='3'/></transform>";

type Case = (&'static str, fn());

/// Deviations that change the image.
const IMAGES: &[Case] = &[
    ("emission by normals", || {
        let turned = scene(&file("obj", "turned.obj", EMITS)).shapes.remove(0).mesh;
        let [a, b, c] = turned.triangles()[0].map(|i| turned.positions()[i as usize]);
        assert_eq!((b - a).cross(c - a).normalize(), DVec3::NEG_Z);
        is_noted(&file("obj", "turned.obj", EMITS), "1 of the 1 triangles");
        assert!(scene(&file("obj", "turned.obj", "")).shapes[0].mesh.turned_normals() == 1);
    }),
    ("emission by normals is noted", || {
        let words = "emits as far as its faces are seen from the front";
        is_noted(&file("obj", "smooth.obj", EMITS), words);
        let notes = whole(&format!("{SENSOR}{}", file("obj", "smooth.obj", EMITS))).1;
        assert!(notes.iter().any(|note| note.changes_image && note.text.contains(words)), "{notes:?}");
        let flat = format!("<boolean name='face_normals' value='true'/>{EMITS}");
        let notes = whole(&format!("{SENSOR}{}", file("obj", "smooth.obj", &flat))).1;
        assert!(notes.iter().all(|note| !note.changes_image), "{notes:?}");
    }),
    ("curved shapes", || {
        is_noted("<shape type='sphere'/>", "is a mesh of");
        let mesh = scene("<shape type='sphere'/>").shapes.remove(0).mesh;
        assert!(mesh.positions().iter().all(|p| (p.length() - 1.0).abs() < 1e-3));
        assert!(matches!(mesh.normals(), Normals::Given(_)));
    }),
    ("curves", || {
        let more = "<transform name='to_world'><scale value='4'/></transform>";
        let mesh = scene(&file("linearcurve", "curve.txt", more)).shapes.remove(0).mesh;
        let high = mesh.positions().iter().copied().fold(DVec3::ZERO, DVec3::max);
        assert!((high - DVec3::new(12.5, 0.5, 0.5)).length() < 1e-3, "{high}");
    }),
    ("steps in textures", || {
        let board = scene(
            "<texture type='checkerboard' id='t'/><bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf>",
        );
        assert_eq!((board.textures[0].width, board.textures[0].height), (128, 128));
    }),
    ("masks seen against nothing", || {
        let quad = |bsdf: &str| {
            let lamp = "<shape type='rectangle'><transform name='to_world'><lookat origin='2,0,1' target='0,0,0' up='0,1,0'/>\
                </transform><emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>";
            shown(&format!("<integrator type='path'/><shape type='rectangle'>{bsdf}</shape>{lamp}"))
        };
        let paper = "<bsdf type='diffuse'><rgb name='reflectance' value='.7'/></bsdf>";
        let mask = format!("<bsdf type='mask'><float name='opacity' value='.6'/>{paper}</bsdf>");
        let ratio = quad(&mask) / quad(paper);
        assert!((ratio - 0.6).abs() < 0.02, "{ratio}");
    }),
    ("mixtures with mirrors", || {
        let black = "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>";
        let mirror = "<bsdf type='conductor'><string name='material' value='none'/></bsdf>";
        let mixed = format!("<bsdf type='blendbsdf'><float name='weight' value='.3'/>{black}{mirror}</bsdf>");
        let found = shown(&format!("<shape type='rectangle'>{WALL}{mixed}</shape>{SKY}"));
        assert!((found - 0.3).abs() < 0.01, "{found}");
    }),
    ("direct light by several samples", || {
        let of = |samples: u32| {
            shown(&format!(
                "<integrator type='direct'><integer name='emitter_samples' value='{samples}'/></integrator><shape \
                 type='rectangle'>{WALL}</shape><emitter type='point'><point name='position' value='0,0,3'/><rgb \
                 name='intensity' value='1'/></emitter>"
            ))
        };
        let one = of(1);
        assert!(one > 0.0 && of(0) == one && of(2) == one, "{one}");
    }),
    ("orthographic sensors", || {
        let camera = whole("<sensor type='orthographic'/>").0.camera;
        assert!((camera.orthographic.unwrap() - 1e4).abs() < 1e-6, "{camera:?}");
    }),
    ("metals of index 1", || {
        let wall = |eta: f64| {
            let metal = format!(
                "<bsdf type='principled'><rgb name='base_color' value='.7'/><float name='metallic' value='1'/>\
                 <float name='roughness' value='.5'/><float name='eta' value='{eta}'/></bsdf>"
            );
            shown(&format!("<shape type='rectangle'>{WALL}{metal}</shape>{SKY}"))
        };
        let [alone, close] = [wall(1.0), wall(1.0001)];
        assert!(alone > 0.4 && (alone - close).abs() < 1e-3, "{alone} {close}");
    }),
    ("ideal facets", || {
        is_noted(
            "<bsdf type='roughconductor'><float name='alpha' value='0'/></bsdf>",
            "of alpha 0 is the smooth",
        );
    }),
    ("corners without coordinates", || {
        is_noted(&file("obj", "mixed.obj", ""), "corners of triangles have no texture coordinates");
    }),
    ("third columns of to_uv", || {
        let texture = "<texture type='checkerboard' name='reflectance'><transform name='to_uv'><matrix value='1 0 .25 0 0 1 .5 0 0 0 1 0 0 0 0 1'/></transform></texture>";
        is_noted(&format!("<bsdf type='diffuse'>{texture}</bsdf>"), "as before version 3.9");
    }),
    ("seams of OBJ files", || {
        let mesh = scene(&file("obj", "seam.obj", "")).shapes.remove(0).mesh;
        // Six corners; the two of the seam count once.
        let Normals::AngleWeighted { count, .. } = mesh.normals() else { panic!("{mesh:?}") };
        assert_eq!((*count, mesh.positions().len()), (6, 6));
    }),
    ("concave faces", || {
        let mesh = scene(&file("obj", "dent.obj", "")).shapes.remove(0).mesh;
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.positions()[i as usize]);
            0.5 * (b - a).cross(c - a).z
        };
        let areas: Vec<f64> = mesh.triangles().iter().map(area).collect();
        assert!((areas.iter().map(|a| a.abs()).sum::<f64>() - 0.4).abs() < 1e-6, "{areas:?}");
        let sign = areas[0].signum();
        assert!(areas.iter().all(|a| a.signum() == sign), "{areas:?}");
    }),
    ("interpolation of grids", || {
        let grid = |more: &str| {
            let d = scene(&format!("<shape type='sdfgrid'><float name='radius' value='.5'/>{more}</shape>"));
            d.implicits[0].surface.downcast::<crate::sdf::Grid>().unwrap().interpolation()
        };
        assert_eq!(grid(""), Interpolation::Cubic);
        assert_eq!(grid("<string name='interpolation' value='trilinear'/>"), Interpolation::Trilinear);
    }),
    ("attributes of faces", || {
        let bsdf = "<bsdf type='diffuse'><texture type='mesh_attribute' name='reflectance'><string name='name' value='face_color'/></texture></bsdf>";
        let texture = scene(&file("ply", "faces.ply", bsdf)).textures.remove(0);
        assert!(
            texture.texels.iter().any(|t| (*t - DVec3::new(1.0, 0.2, 0.0)).length() < 1e-6),
            "{texture:?}"
        );
    }),
    ("images of few samples", || {
        // With one sample of a constant scene quotients are exact; means are tested against renderings
        // elsewhere.
        let film = SENSOR.replace("<rfilter type='box'/>", "");
        let d = whole(&format!("{film}{SKY}")).0;
        assert!(!d.film.sample_border && d.film.filter == Filter::Gaussian { deviation: 0.5 });
        let image = render(&Scene::new(d).unwrap(), 2, 1, &Progress::none()).unwrap().image;
        assert!(image.pixels.iter().all(|p| (*p - DVec3::ONE).length() < 1e-12), "{image:?}");
    }),
];

/// Parts that are refused, or ignored with a note.
const REFUSALS: &[Case] = &[
    ("clip planes", || {
        let near = SENSOR.replace("<film", "<float name='near_clip' value='5'/><film");
        let text = format!("<scene version='3.0.0'>{near}<shape type='rectangle'/></scene>");
        let message = read_as(&text, false).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("near_clip"), "{message}");
    }),
    ("stretched sensors and lights", || {
        let about = "<transform name='to_world'><rotate y='2' angle='90'/></transform>";
        let words = "a rigid motion";
        let sensor = SENSOR.replace("<lookat", "<rotate y='2' angle='90'/><lookat");
        let message = read_as(&format!("<scene version='3.0.0'>{sensor}</scene>"), false).map(|_| ());
        assert!(message.unwrap_err().to_string().contains(words));
        is_refused(&format!("<emitter type='spot'>{about}</emitter>"), words);
        is_refused(&format!("<emitter type='projector'>{about}</emitter>"), words);
        let map = "<string name='filename' value='small.exr'/>";
        is_refused(&format!("<emitter type='envmap'>{map}{about}</emitter>"), words);
        is_refused(&format!("<shape type='sdfgrid'><float name='radius' value='.5'/>{about}</shape>"), words);
    }),
    ("colours of glass", || {
        let glass = "<bsdf type='dielectric'><texture type='checkerboard' name='NAME'/></bsdf>";
        assert_eq!(scene(&glass.replace("NAME", "specular_transmittance")).textures.len(), 1);
        is_refused(&glass.replace("NAME", "specular_reflectance"), "specular_reflectance");
    }),
    ("textures in textures", || {
        let board = |name: &str, colours: &str| {
            format!("<texture type='checkerboard' name='{name}'>{colours}</texture>")
        };
        let inner =
            "<texture type='bitmap' name='color1'><string name='filename' value='small.exr'/></texture>";
        let nested = format!("<bsdf type='diffuse'>{}</bsdf>", board("reflectance", inner));
        is_refused(&nested, "s.xml:1:");
        is_refused(&nested, "a texture within a checkerboard");
        let image = format!("<bsdf type='diffuse'>{}</bsdf>", board("reflectance", ""));
        let weight = board("weight", "<float name='color0' value='0'/><float name='color1' value='1'/>");
        let blend = format!("<bsdf type='blendbsdf'>{weight}<bsdf type='diffuse'/>{image}</bsdf>");
        assert_eq!(scene(&blend).textures.len(), 2);
    }),
    ("relief on glass", || {
        let relief = "<bsdf type='bumpmap'><texture type='checkerboard'/><bsdf type='dielectric'/></bsdf>";
        is_refused(relief, "on a material that light passes");
    }),
    ("mixtures in mixtures", || {
        let two = "<bsdf type='diffuse'/><bsdf type='plastic'/>";
        let mixture = format!("<bsdf type='blendbsdf'><float name='weight' value='.5'/>{two}</bsdf>");
        let twice = format!(
            "<bsdf type='blendbsdf'><float name='weight' value='.5'/>{mixture}<bsdf type='diffuse'/></bsdf>"
        );
        is_refused(&twice, "not supported");
    }),
    ("filters with other numbers", || {
        for filter in [
            "<rfilter type='box'><float name='radius' value='1'/></rfilter>",
            "<rfilter type='mitchell'><float name='B' value='2'/></rfilter>",
            "<rfilter type='lanczos'><integer name='lobes' value='17'/></rfilter>",
        ] {
            let sensor = SENSOR.replace("<rfilter type='box'/>", filter);
            assert!(read_as(&format!("<scene version='3.0.0'>{sensor}</scene>"), false).is_err(), "{filter}");
        }
    }),
    ("media that no integrator sees", || {
        let fog = "<medium type='homogeneous' name='interior'/><bsdf type='null'/>";
        let of = |integrator: &str| {
            scene(&format!("<integrator type='{integrator}'/><shape type='cube'>{fog}</shape>")).media.len()
        };
        assert_eq!((of("path"), of("volpath")), (0, 1));
    }),
    ("moving shutters", || {
        let body = |shutter: &str| {
            let keys = "<transform time='0'/><transform time='1'><translate x='5'/></transform>";
            let sensor = SENSOR.replace("<film", &format!("{shutter}<film"));
            format!(
                "<scene version='3.0.0'>{sensor}<shape type='cube'><animation name='to_world'>{keys}</animation></shape></scene>"
            )
        };
        let (_, notes) = read_as(&body(""), false).unwrap();
        assert!(notes.iter().any(|note| note.text.contains("the animation is still")), "{notes:?}");
        assert!(read_as(&body("<float name='shutter_close' value='1'/>"), false).is_err());
    }),
    ("light in time", || is_noted("<integrator type='transient_path'/>", "light at all times")),
    ("integrators without light", || {
        is_noted(
            "<integrator type='aov'><string name='aovs' value='d:depth'/></integrator>",
            "in its place path is rendered",
        );
    }),
    ("derivatives by integrators", || {
        assert_eq!(scene("<integrator type='prb_projective'/>").integrator.max_depth, Some(6));
        assert_eq!(scene("<integrator type='path'/>").integrator.max_depth, None);
    }),
    ("parameters that change noise", || {
        let with = "<integrator type='path'><integer name='block_size' value='7'/></integrator>";
        assert_eq!(scene(with), scene("<integrator type='path'/>"));
    }),
    ("leniently", || {
        let text = format!("<scene version='3.0.0'>{SENSOR}<emitter type='sunsky'/></scene>");
        assert!(read_as(&text, false).is_err());
        assert!(!read_as(&text, true).unwrap().1.is_empty());
    }),
];

/// Extensions that Mitsuba does not read.
const ADDITIONS: &[Case] = &[
    ("no sensor", || {
        let (d, notes) = whole("<shape type='cube'/>");
        assert!(d.camera.forward == DVec3::Z && !notes.is_empty(), "{notes:?}");
    }),
    ("old and other names", || {
        let material = |plugin: &str| scene(&format!("<bsdf type='{plugin}' id='m'/>")).materials.remove(0);
        assert_eq!(material("Disney".to_lowercase().as_str()), material("principled"));
        assert_eq!(material("Diffuse"), material("diffuse"));
    }),
    ("colours of HTML", || {
        let d = scene("<bsdf type='diffuse'><rgb name='reflectance' value='#ff0000'/></bsdf>");
        let Bsdf::Diffuse { reflectance } = &d.materials[0].bsdf else { panic!() };
        assert_eq!(*reflectance, crate::scene::Reflectance::Constant(DVec3::X));
    }),
    ("lobes of suns", || {
        let sun = "<emitter type='directional'><vector name='direction' value='0,0,-1'/><rgb name='irradiance' value='1'/><float name='kappa' value='50'/></emitter>";
        assert!(matches!(scene(sun).lights[0], Light::Directional { kappa: 50.0, .. }));
    }),
    ("pixels that are not square", || {
        let sensor = SENSOR.replace("<film", "<float name='pixel_aspect' value='.5'/><film");
        assert_eq!(whole(&sensor).0.camera.pixel_aspect, 0.5);
    }),
    ("small environment maps", || {
        let map = "<emitter type='envmap'><string name='filename' value='small.exr'/></emitter>";
        assert!(matches!(scene(map).environment, Some(Environment::Map { .. })));
    }),
    ("two-sided masks", || {
        let mask = "<bsdf type='twosided'><bsdf type='mask'><bsdf type='diffuse'/></bsdf></bsdf>";
        assert!(scene(mask).materials.iter().any(|m| m.opacity.is_some()));
    }),
    ("glass without a boundary", || {
        let same = "<float name='int_ior' value='1.3'/><float name='ext_ior' value='1.3'/>";
        is_noted(&format!("<bsdf type='roughdielectric'>{same}</bsdf>"), "there is no boundary");
    }),
    ("coordinates of faces", || {
        assert!(scene(&file("ply", "coordinates.ply", "")).shapes[0].mesh.uvs().is_some());
    }),
    ("networks", || {
        let network = "<shape type='sdfnetwork'><integer name='width' value='16'/><integer name='cells' value='16'/></shape>";
        assert_eq!(scene(network).implicits.len(), 1);
        assert_eq!(
            scene("<shape type='sdfgrid'><float name='radius' value='.5'/></shape>").implicits.len(),
            1
        );
    }),
];

/// Every row has a case, every case has a row, and the statements of the page hold.
#[test]
fn the_page_of_deviations_says_what_is_so() {
    let rows: BTreeSet<&str> =
        (PAGE.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| what |")))
            .map(|line| line[2..].split(" | ").next().unwrap())
            .collect();
    let cases = [IMAGES, REFUSALS, ADDITIONS].concat();
    let known: BTreeSet<&str> = cases.iter().map(|(name, _)| *name).collect();
    assert_eq!(rows, known);
    let mut wrong = vec![];
    for (name, case) in cases {
        if std::panic::catch_unwind(case).is_err() {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
