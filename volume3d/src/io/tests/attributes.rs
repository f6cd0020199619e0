//! Mesh attributes of a PLY file as textures.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::scene::SENSOR;
use super::{check_table, here, message};
use crate::io::{Error, ReadOptions, load_scene, read_scene, read_scene_with, write_scene};
use crate::optimize::{ParameterError, Quantity};
use crate::scene::{Bsdf, Description, Reflectance, Scene, Value};

/// A square with colours and numbers at vertices and faces, and a triangle with colours as bytes.
const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property float r\nproperty float g\nproperty float b\nproperty float w_x\nproperty float tint_r\n\
    property float tint_g\nproperty float tint_b\nproperty float tint_a\nproperty float pair_x\nproperty float pair_y\n\
    element face 1\nproperty float wear\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 1 0 0 0 .1 .2 .3 9 0 0\n1 0 0 0 1 0 .5 .1 .2 .3 9 0 0\n1 1 0 0 0 1 1 .1 .2 .3 9 0 0\n\
    0 1 0 1 1 0 .5 .1 .2 .3 9 0 0\n.25 4 0 1 2 3\n";
const BYTES: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n0 0 0 255 0 51\n1 0 0 255 0 51\n0 1 0 255 0 51\n3 0 1 2\n";
/// Properties in arbitrary order, with an opacity in between, and one of them given twice.
const MIXED: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property float alpha\nproperty uchar blue\nproperty float green\nproperty float red\nproperty float t_2\n\
    property float t_1\nproperty float t_0\nproperty float q_x\nproperty float q_0\nproperty float l_a\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 9 51 .4 .6 .3 .2 .1 0 0 0\n1 0 0 9 51 .4 .6 .3 .2 .1 0 0 0\n0 1 0 9 51 .4 .6 .3 .2 .1 0 0 0\n3 0 1 2\n";

fn open(path: &Path) -> std::io::Result<Vec<u8>> {
    match path.to_str() {
        Some("dir/square.ply") => Ok(SQUARE.into()),
        Some("dir/bytes.ply") => Ok(BYTES.into()),
        Some("dir/bright.ply") => Ok(SQUARE.replace("1 0 0 0 .1", "1 0 2 0 .1").into()),
        Some("dir/mixed.ply") => Ok(MIXED.into()),
        Some("dir/short.ply") => Ok(SQUARE.replace("0 1 0 1 1 0 .5", "0 1 0 1 1 nan .5").into()),
        _ => super::scene::open(path),
    }
}

fn read(body: &str) -> Result<Description, Error> {
    let text = format!("<scene version='3.0.0'>{SENSOR}\n{body}</scene>");
    read_scene(text.as_bytes(), here("dir/s.xml"), &[], &open)
}

fn texture(parameter: &str, name: &str) -> String {
    format!(
        "<texture type='mesh_attribute' name='{parameter}'><string name='name' value='{name}'/></texture>"
    )
}

fn diffuse(name: &str) -> String {
    format!("<bsdf type='diffuse'>{}</bsdf>", texture("reflectance", name))
}

fn ply(file: &str, bsdf: &str) -> String {
    format!("<shape type='ply'><string name='filename' value='{file}.ply'/>{bsdf}</shape>")
}

/// The colour of a shape's only texture at a point of a triangle, given by barycentric weights, by bilinear
/// look-up.
fn seen(scene: &Description, triangle: usize, weights: [f64; 3]) -> DVec3 {
    let texture = &scene.textures[0];
    let uvs = scene.shapes[0].mesh.uvs().unwrap();
    let corners = uvs.triangles[triangle].map(|i| uvs.values[i as usize]);
    let uv: DVec2 = (0..3).map(|k| weights[k] * corners[k]).sum();
    let uv = texture.to_uv.transform_point2(uv);
    let place = DVec2::new(uv.x, 1.0 - uv.y) * DVec2::new(texture.width as f64, texture.height as f64) - 0.5;
    let (first, part) = (place.floor(), place - place.floor());
    let texel = |x: usize, y: usize| {
        let (x, y) =
            ((first.x as usize + x).min(texture.width - 1), (first.y as usize + y).min(texture.height - 1));
        texture.texels[y * texture.width + x]
    };
    texel(0, 0).lerp(texel(1, 0), part.x).lerp(texel(0, 1).lerp(texel(1, 1), part.x), part.y)
}

fn close(found: DVec3, expected: DVec3) {
    assert!((found - expected).length() < 1e-12, "{found} {expected}");
}

/// Colours of vertices are interpolated linearly; those of faces are constant on them.
#[test]
fn attributes_are_interpolated_as_positions_are() {
    let scene = read(&ply("square", &diffuse("vertex_color"))).unwrap();
    assert!(matches!(scene.materials[0].bsdf.reflectance(), Reflectance::Texture(0)));
    close(seen(&scene, 0, [1.0, 0.0, 0.0]), DVec3::X);
    close(seen(&scene, 0, [0.2, 0.3, 0.5]), DVec3::new(0.2, 0.3, 0.5));
    // The second triangle has the vertices 0, 2 and 3.
    close(seen(&scene, 1, [0.2, 0.3, 0.5]), DVec3::new(0.7, 0.5, 0.3));
    let number = read(&ply("square", &diffuse("vertex_w"))).unwrap();
    close(seen(&number, 0, [0.2, 0.4, 0.4]), DVec3::splat(0.6));
    let face = read(&ply("square", &diffuse("face_wear"))).unwrap();
    close(seen(&face, 1, [0.2, 0.3, 0.5]), DVec3::splat(0.25));
    let tint = read(&ply("square", &diffuse("vertex_tint_color"))).unwrap();
    close(seen(&tint, 0, [0.2, 0.3, 0.5]), DVec3::new(0.1, 0.2, 0.3));
    let bytes = read(&ply("bytes", &diffuse("vertex_color"))).unwrap();
    close(seen(&bytes, 0, [0.2, 0.3, 0.5]), DVec3::new(1.0, 0.0, 0.2));
}

/// Flipped triangles keep the colours of their vertices, and `scale` multiplies them.
#[test]
fn attributes_of_turned_triangles() {
    let turned =
        ply("square", &format!("<boolean name='flip_normals' value='true'/>{}", diffuse("vertex_color")));
    let scene = read(&turned).unwrap();
    let triangle = scene.shapes[0].mesh.triangles()[0];
    let corner = |k: usize| scene.shapes[0].mesh.positions()[triangle[k] as usize];
    for (k, weights) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
        let colour = [DVec3::X, DVec3::Y, DVec3::Z][(corner(k).x + corner(k).y) as usize];
        close(seen(&scene, 0, weights), colour);
    }
    let half = texture("reflectance", "vertex_w")
        .replace("</texture>", "<float name='scale' value='.5'/></texture>");
    let scene = read(&ply("square", &format!("<bsdf type='diffuse'>{half}</bsdf>"))).unwrap();
    close(seen(&scene, 0, [0.0, 0.0, 1.0]), DVec3::splat(0.5));
}

/// A material shared by several meshes is created for each, and several attributes share one set of texture
/// coordinates.
#[test]
fn attributes_of_several_meshes() {
    let shared = format!(
        "<texture type='mesh_attribute' id='t'><string name='name' value='vertex_color'/></texture><bsdf type='twosided' \
         id='m'><bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf></bsdf>{}{}",
        ply("square", "<ref id='m'/>"),
        ply("bytes", "<ref id='m'/>")
    );
    let scene = read(&shared).unwrap();
    assert_eq!((scene.textures.len(), scene.materials.len()), (2, 2));
    assert_eq!((scene.shapes[0].material, scene.shapes[1].material), (0, 1));
    let ids: Vec<&str> = scene.materials.iter().map(|m| m.id.as_str()).collect();
    assert!(ids[0] == "m" && ids[1] != "m", "{ids:?}");
    let many = format!(
        "<bsdf type='principled'>{}{}</bsdf>",
        texture("base_color", "vertex_color"),
        texture("roughness", "face_wear")
    );
    let scene = read(&ply("square", &many)).unwrap();
    let Bsdf::Principled(numbers) = &scene.materials[0].bsdf else { panic!() };
    assert!(matches!(numbers.roughness, Value::Texture(_)) && scene.textures.len() == 2);
    let [a, b] = &scene.textures[..] else { panic!() };
    assert_eq!((a.width, a.height), (b.width, b.height));
}

/// Suffixes determine the order of the numbers of a colour.
#[test]
fn channels_are_found_by_name() {
    for (name, expected) in
        [("vertex_color", DVec3::new(0.6, 0.4, 0.2)), ("vertex_t", DVec3::new(0.1, 0.2, 0.3))]
    {
        let scene = read(&ply("mixed", &diffuse(name))).unwrap();
        close(seen(&scene, 0, [0.2, 0.3, 0.5]), expected);
    }
    let twice = message(read(&ply("mixed", &diffuse("vertex_q"))));
    assert!(
        twice.ends_with("mixed.ply:15: expected each number of an attribute once, found \"q_0\""),
        "{twice}"
    );
    // An opacity alone is not an attribute.
    let none = message(read(&ply("mixed", &diffuse("vertex_l_color"))));
    assert!(none.ends_with("the file has vertex_color, vertex_t"), "{none}");
}

/// A material used with attributes for one mesh and without them for another has two names.
#[test]
fn materials_beside_attributes_have_names_of_their_own() {
    let blend = |second: &str| {
        let weight = texture("weight", "vertex_w");
        ply("square", &format!("<bsdf type='blendbsdf'>{weight}<ref id='a'/>{second}</bsdf>"))
    };
    let grey = |id: &str| format!("<bsdf type='diffuse' id='{id}'/>");
    let built = |text: &str, is_lenient: bool| {
        let text = format!("<scene version='3.0.0'>{SENSOR}\n{text}</scene>");
        let options = ReadOptions { is_lenient, ..ReadOptions::default() };
        let (description, _) = read_scene_with(text.as_bytes(), here("dir/s.xml"), &options, &open).unwrap();
        let ids: Vec<String> = description.materials.iter().map(|m| m.id.clone()).collect();
        (Scene::new(description).map(|_| ()), ids)
    };
    let (scene, ids) = built(&format!("{}{}{}", grey("a"), grey("b"), blend("<ref id='b'/>")), false);
    assert!(scene.is_ok() && ids[..2] == ["a", "b"], "{scene:?} {ids:?}");
    // The second material of the first mesh is nested in it, and another shape refers to that.
    let later = "<shape type='cube'><ref id='b'/></shape>";
    let (scene, ids) = built(&format!("{}{}{later}", grey("a"), blend(&grey("b"))), false);
    assert!(scene.is_ok() && ids.iter().any(|id| id == "b"), "{scene:?} {ids:?}");
    // A refused material is not created; its grey substitute has its name, once.
    let unfit = format!(
        "<bsdf type='mask' id='m'><texture name='opacity' type='checkerboard' id='t'/>{}</bsdf>",
        diffuse("vertex_color")
    );
    let text = format!("{}{}", ply("square", &unfit), ply("square", "<ref id='m'/>"));
    let (scene, ids) = built(&text, true);
    assert!(scene.is_ok() && ids.len() == 2 && ids[0] == "m", "{scene:?} {ids:?}");
}

/// Materials that refer to themselves are visited once.
#[test]
fn attributes_are_looked_for_in_finite_time() {
    let text = format!("<bsdf type='diffuse' id='a'>{}</bsdf>", "<ref id='a'/>".repeat(10));
    assert!(message(read(&text)).contains("<bsdf> is not supported inside bsdf"));
    let chain: String = (0..20_000)
        .map(|k| format!("<bsdf type='diffuse' id='a{k}'><ref id='a{}'/></bsdf>", k + 1))
        .collect();
    let end = "<bsdf type='diffuse' id='a20000'/><shape type='cube'><ref id='a0'/></shape>";
    assert!(read(&format!("{chain}{end}")).is_err());
}

/// The fourth texel of a triangle may be out of range if no triangle shows it, also after writing and
/// reading.
#[test]
fn written_attributes_are_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let before = read(&ply("square", &diffuse("vertex_color").replace("<bsdf", "<bsdf id='m'"))).unwrap();
    assert!(before.textures[0].texels.iter().any(|texel| texel.min_element() < 0.0));
    let scene = Scene::new(before.clone()).unwrap();
    let found = Quantity::find(&scene, "m.texture");
    assert!(
        matches!(&found, Err(error @ ParameterError::Attribute { .. }) if error.to_string().contains("no triangle shows"))
    );
    write_scene(&path, &scene).unwrap();
    let after = load_scene(&path).unwrap();
    assert_eq!(before.textures[0].texels, after.textures[0].texels);
    for (triangle, weights) in [(0, [0.2, 0.3, 0.5]), (1, [0.6, 0.3, 0.1])] {
        close(seen(&after, triangle, weights), seen(&before, triangle, weights));
    }
    // Another mesh would show the fourth texel.
    let text = std::fs::read_to_string(&path).unwrap();
    let other = "<shape type=\"rectangle\"><ref id=\"m\"/></shape></scene>";
    std::fs::write(&path, text.replace("</scene>", other)).unwrap();
    let refused = message(load_scene(&path));
    assert!(refused.contains("on another mesh than its own is not supported"), "{refused}");
}

#[test]
fn attributes_that_are_refused() {
    let refused = |text: &str| message(read(&text.replace('@', "<texture type='mesh_attribute'")));
    check_table(
        "
<shape type='ply'><string name='filename' value='square.ply'/><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='vertex_colour'/></texture></bsdf></shape>
    dir/s.xml:2:84: dir/square.ply: there is no attribute \"vertex_colour\" of one or three numbers; the file has vertex_color, vertex_w, vertex_tint_color, face_wear
<shape type='ply'><string name='filename' value='square.ply'/><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='vertex_pair'/></texture></bsdf></shape>
    dir/s.xml:2:84: dir/square.ply: there is no attribute \"vertex_pair\" of one or three numbers; the file has vertex_color, vertex_w, vertex_tint_color, face_wear
<shape type='ply'><string name='filename' value='tri.ply'/><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='face_color'/></texture></bsdf></shape>
    dir/s.xml:2:81: dir/tri.ply: there is no attribute \"face_color\" of one or three numbers; the file has no attribute
<shape type='ply'><string name='filename' value='bright.ply'/><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='vertex_color'/></texture></bsdf></shape>
    dir/s.xml:2:84: a colour=\"[1, 0, 2]\": expected numbers between 0 and 1
<shape type='ply'><string name='filename' value='short.ply'/><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='vertex_color'/></texture></bsdf></shape>
    dir/s.xml:2:83: dir/short.ply:24: expected a finite number, found \"[1, 1, NaN]\"
<shape type='cube'><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='vertex_color'/></texture></bsdf></shape>
    dir/s.xml:2:41: a mesh_attribute of a shape that is not a PLY file is not supported; give a PLY file
<shape type='ply'><string name='filename' value='square.ply'/><emitter type='area'>@ name='radiance'><string name='name' value='vertex_color'/></texture></emitter></shape>
    dir/s.xml:2:84: a mesh_attribute as what an emitter sends out is not supported; give an image or a colour
<shape type='ply'><string name='filename' value='square.ply'/><bsdf type='diffuse'>@ name='reflectance'/></bsdf></shape>
    dir/s.xml:2:84: texture \"mesh_attribute\" needs name
<shape type='ply'><string name='filename' value='square.ply'/><bsdf type='mask'><texture name='opacity' type='checkerboard'/><bsdf type='diffuse'>@ name='reflectance'><string name='name' value='vertex_color'/></texture></bsdf></bsdf></shape>
    dir/s.xml:2:63: a mesh_attribute beside an image, a relief or a brushed surface is not supported; give the surface attributes, or images, but not both
",
        refused,
    );
}
