//! Refused scenes, each with a message that names the place and a remedy.

use super::scene::{open, read, with};
use super::{check_messages, check_table, here, message};
use crate::io::read_scene;

/// The message for a scene with the simplest camera, without the place if that is the expected line.
fn case(body: &str) -> String {
    let text = message(with(&format!("\n{body}")));
    text.strip_prefix("dir/s.xml:2:1: ").map(str::to_owned).unwrap_or(text)
}

/// The message for the content of a camera.
fn sensor(body: &str) -> String {
    let text = format!("<scene version='3.0.0'><sensor type='perspective'>\n{body}</sensor></scene>");
    message(read(&text)).replace("dir/s.xml:2:1: ", "")
}

#[test]
fn documents() {
    let unclosed = message(read("<scene version='3.0.0'>"));
    assert!(unclosed.starts_with("dir/s.xml: not well-formed XML: "), "{unclosed}");
    let entity = message(read("<!DOCTYPE a [<!ENTITY b 'c'>]><scene version='3.0.0'>&b;</scene>"));
    assert!(entity.contains("not well-formed XML: "), "{entity}");
    let latin = read_scene(b"<scene \xe9/>", here("dir/s.xml"), &[], &open);
    let unused = [("w".to_owned(), "5".to_owned())];
    let unused = read_scene(b"<scene version='3.0.0'/>", here("dir/s.xml"), &unused, &open);
    check_messages(&[
        (message(latin), "cannot read dir/s.xml: invalid utf-8 sequence of 1 bytes from index 7"),
        (message(unused), "dir/s.xml:1:1: the value given for $w is not used in the scene"),
    ]);
    let old = "is not supported; expected 0.x to 3.x";
    let whole = |text: &str| message(read(text)).replace(old, "is STRANGE");
    check_table(
        r#"
<shape version='3.0.0'/>
    dir/s.xml:1:1: <shape> is not supported inside the file; supported: <scene>
<scene version='4.0.0'/>
    dir/s.xml:1:1: scene version "4.0.0" is STRANGE
<scene version='2.1.0'/>
    dir/s.xml:1:1: the scene needs a <sensor>
<!-- -->
<scene/>
    dir/s.xml:2:1: scene version "" is STRANGE
<scene version='3' a='1'/>
    dir/s.xml:1:1: <scene> has no attribute "a"; supported: version, id, name
<scene version='3.0.0'>
</scene>
    dir/s.xml:1:1: the scene needs a <sensor>
<scene version='3.0.0'><include filename='new.xml'/></scene>
    dir/s.xml:1:24: dir/new.xml:1:1: scene version "4.0.0" is STRANGE
<scene version='3.0.0'><sensor type='irradiancemeter'/></scene>
    dir/s.xml:1:24: sensor "irradiancemeter" is not supported; supported: perspective, thinlens, orthographic
"#,
        whole,
    );
    check_table(
        r#"
text
    dir/s.xml:1:1: unexpected text "text" between elements; remove it
<volume type='gridvolume'/>
    <volume> is not supported inside the scene; supported: <integrator>, <sensor>, <sampler>, <film>, <medium>, <phase>, <spectrum>, <texture>, <bsdf>, <shape>, <emitter>
<float name='a' value='1'/>
    the scene has no parameter "a" here; supported: none
<float value='1'/>
    <float> needs an attribute "name"
<bsdf type='$a_b'/>
    $a_b has no value: add <default name="a_b" value="…"/> before its first use
<default name='' value='1'/>
    name="": expected a name
<default name='a'/>
    <default> needs an attribute "value"
<include filename='none.xml'/>
    cannot read dir/none.xml: entity not found
<include name='a'/>
    <include> needs an attribute "filename"
"#,
        case,
    );
    let deep = format!("{}{}", "<a>".repeat(70), "</a>".repeat(70));
    assert!(case(&deep).ends_with("more than 64 levels of elements"));
}

/// A file that includes itself is named at that place, after the files that lead there; a file that is
/// included twice in a row is not a cycle.
#[test]
fn cyclic_includes() {
    check_table(
        r#"
<include filename='loop.xml'/>
    dir/loop.xml:1:24: dir/loop.xml includes itself, at once or by way of the files between
<include filename='there.xml'/>
    dir/there.xml:1:24: dir/back.xml:1:24: dir/there.xml includes itself, at once or by way of the files between
<include filename='s.xml'/>
    dir/s.xml includes itself, at once or by way of the files between
"#,
        case,
    );
    let twice = with("<include filename='box.xml'/><include filename='box.xml'/>").unwrap();
    assert_eq!(twice.shapes.len(), 2);
}

#[test]
fn references() {
    check_table(
        r#"
<bsdf type='diffuse' id='a'/>
<bsdf type='diffuse' id='a'/>
    dir/s.xml:3:1: id "a" was given before, at dir/s.xml:2:1
<bsdf type='diffuse' id='a'/>
<shape type='cube'><ref id='b'/></shape>
    dir/s.xml:3:20: nothing has the id "b"; there are: a
<ref id='b'/>
    nothing has the id "b"; there are: none
<shape type='cube'><ref/></shape>
    dir/s.xml:2:20: <ref> needs an attribute "id"
<shape type='cube'><ref id='c' type='d'/></shape>
    dir/s.xml:2:20: <ref> has no attribute "type"; supported: id, name
<integrator type='moment' id='a'><ref id='a'/></integrator>
    an integrator within itself, or within more than 16 others is not supported; give the one whose image is to be rendered
<bsdf type='blendbsdf' id='a'><float name='weight' value='.5'/><ref id='a'/><ref id='a'/></bsdf>
    a material within itself, or within more than 16 others is not supported; leave out one of them
<bsdf type='twosided' id='a'><ref id='a'/></bsdf>
    twosided within twosided is not supported; leave out one of them
<bsdf type='diffuse'><float name='a' value='1'/><rgb name='a' value='1'/></bsdf>
    dir/s.xml:2:49: parameter "a" was given before, at dir/s.xml:2:22
"#,
        case,
    );
}

#[test]
fn films() {
    check_table(
        r#"
<integer name='width' value='1.5'/>
    width="1.5": expected a whole number from 1 to 65536
<integer name='width' value='0'/>
    width="0": expected a whole number from 1 to 65536
<float name='width' value='4'/>
    parameter "width" is given as <float>; expected <integer>
<integer name='width'/>
    <integer> needs an attribute "value"
<integer name='width' value='4' unit='px'/>
    <integer> has no attribute "unit"; supported: name, value
<integer name='width' value='4'><a/></integer>
    dir/s.xml:3:33: <a> is not supported inside <integer>; supported: nothing
<integer name='crop_width' value='769'/>
    crop_width="769": expected a whole number that ends within the film
<integer name='crop_offset_y' value='576'/>
    crop_offset_y="576": expected a whole number within the film
"#,
        |body| sensor(&format!("<film type='hdrfilm'>\n{body}</film>")).replace("dir/s.xml:3:1: ", ""),
    );
}

#[test]
fn colours() {
    check_table(
        r##"
<rgb name='reflectance' value='1 2'/>
    value="1 2": expected one or three numbers
<rgb name='reflectance' value='0 0 1.5'/>
    reflectance="[0, 0, 1.5]": expected numbers between 0 and 1
<rgb name='reflectance' value='#12345'/>
    value="#12345": expected #rrggbb with hexadecimal digits
<rgb name='reflectance' value='nan'/>
    value="nan": expected a finite number
<float name='reflectance' value='0 0 0'/>
    value="0 0 0": expected one number
<spectrum name='reflectance' value='400:0'/>
    wavelengths="": expected two or more, each greater than the one before
<spectrum name='reflectance' value='700:0, 400:1'/>
    wavelengths="": expected two or more, each greater than the one before
<spectrum name='reflectance' value='400:0, 1'/>
    value="1": expected wavelength:value
<spectrum name='reflectance' type='sun'/>
    spectrum "sun" is not supported; supported: uniform, d65, srgb, rawconstant, blackbody, regular, irregular
<spectrum name='reflectance' filename='a.spd'/>
    cannot read dir/a.spd: entity not found
<blackbody name='reflectance' temperature='-5'/>
    temperature="-5": expected a number greater than 0
<string name='reflectance' value='red'/>
    parameter "reflectance" is given as <string>; expected <rgb>, <float> or <spectrum>
"##,
        |body| case(&format!("<bsdf type='diffuse'>\n{body}</bsdf>")).replace("dir/s.xml:3:1: ", ""),
    );
}

#[test]
fn transforms() {
    let step = |step: &str| {
        let text = format!("<shape type='cube'><transform name='to_world'>\n{step}</transform></shape>");
        case(&text).replace("dir/s.xml:3:1: ", "")
    };
    check_table(
        r#"
<skew x='1'/>
    <skew> is not supported inside <transform>; supported: translate, rotate, scale, lookat, matrix
<translate a='1'/>
    <translate> has no attribute "a"; supported: x, y, z, value
<translate value='1 2'/>
    value="1 2": expected one or three numbers
<scale x='1' value='1'/>
    x="1": expected either value or x, y and z
<rotate x='1'/>
    <rotate> needs an attribute "angle"
<rotate angle='1'/>
    axis="[0, 0, 0]": expected a vector other than 0
<matrix value='1 2 3'/>
    value="1 2 3": expected 9 or 16 numbers
<lookat origin='0 0 1' target='0 0 1' up='0 1 0'/>
    target="[0, 0, 1]": expected a point other than the origin
<lookat origin='0 0 0' target='0 0 1' up='0 0 2'/>
    up="[0, 0, 2]": expected a vector that is not parallel to the view
<matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1'/>
    dir/s.xml:2:20: a transform whose last row is not 0 0 0 1 is not supported; use an affine transform
<scale y='0'/>
    dir/s.xml:2:20: transform="[[1, 0, 0], [0, 0, 0], [0, 0, 1]]": expected an invertible transform
"#,
        step,
    );
    let overflow = step("<scale value='1e200'/><scale value='1e200'/>");
    assert!(overflow.ends_with("expected numbers that do not overflow"), "{overflow}");
    check_table(
        r#"
1 0 0 0 2 0 0 0 1
    transform="[[1, 0, 0], [0, 2, 0], [0, 0, 1]]": expected a rigid motion (no shear, the same scale along all axes)
"#,
        |matrix| sensor(&format!("<transform name='to_world'><matrix value='{matrix}'/></transform>")),
    );
}

#[test]
fn plugins() {
    check_table(
        r#"
<shape/>
    <shape> needs an attribute "type"
<shape type='hair'/>
    shape "hair" is not supported; supported: obj, ply, serialized, rectangle, cube, sphere, disk, cylinder, bsplinecurve, linearcurve, shapegroup, instance, sdfgrid, sdfnetwork
<shape type='sphere'><float name='radius' value='0'/></shape>
    dir/s.xml:2:22: radius="0": expected a number greater than 0
<shape type='cylinder'><point name='p1' value='0'/></shape>
    p1="[0, 0, 0]": expected a point other than p0
<shape type='serialized'><string name='filename' value='quad.obj'/></shape>
    dir/quad.obj: expected a serialized mesh (0x041C) of version 3 or 4, found "0x2076, version 8240"
<shape type='ply'/>
    shape "ply" needs filename
<shape type='sdfgrid'/>
    shape "sdfgrid" needs filename
<shape type='sdfgrid'><string name='filename' value='a.vol'/></shape>
    cannot read dir/a.vol: entity not found
<shape type='sdfgrid'><float name='radius' value='3'/></shape>
    there is no such grid: every node is 0 or negative, so that the grid has no surface; values are positive outside and negative inside
<shape type='sdfgrid'><float name='radius' value='.3'/><string name='filename' value='a.vol'/></shape>
    shape "sdfgrid" takes either filename or radius, not both
<shape type='sdfnetwork'><string name='filename' value='a.safetensors'/></shape>
    cannot read dir/a.safetensors: entity not found
<shape type='sdfnetwork'><integer name='cells' value='2000'/></shape>
    dir/s.xml:2:26: cells="2000": expected 0 to 1024 cells
<shape type='sdfnetwork'><float name='radius' value='3'/></shape>
    the network cannot be put on a grid: the network makes no grid: every node is 0 or negative, so that the grid has no surface; values are positive outside and negative inside
<shape type='ply'><string name='filename' value='a.ply'/></shape>
    cannot read dir/a.ply: entity not found
<shape type='ply'><string name='filename' value='bad.ply'/></shape>
    dir/bad.ply:3: the header has no element vertex
<shape type='cube'><float name='a' value='1'/></shape>
    dir/s.xml:2:20: shape "cube" has no parameter "a" here; supported: face_normals, flip_normals, to_world
<shape type='cube'><bsdf type='diffuse'/><bsdf type='diffuse'/></shape>
    dir/s.xml:2:42: 2 <bsdf> in shape "cube"; expected at most one
<integrator type='volpath'/><shape type='cube'><bsdf type='dielectric'/><medium type='a'/></shape>
    dir/s.xml:2:73: <medium> is not supported inside shape "cube"; supported: <bsdf>, <emitter>
<shape type='instance'/>
    0 shapes "shapegroup" in shape "instance"; expected one
<shape type='instance'><shape type='cube'/></shape>
    dir/s.xml:2:24: shape "cube" is not supported; supported: shapegroup, within an instance
<shape type='shapegroup' id='g'><shape type='instance'><ref id='g'/></shape></shape><shape type='instance'><ref id='g'/></shape>
    dir/s.xml:2:33: a shape "instance" within a shapegroup is not supported; give meshes or grids
<shape type='shapegroup' id='g'><shape type='Instance'><ref id='g'/></shape></shape><shape type='instance'><ref id='g'/></shape>
    dir/s.xml:2:33: a shape "Instance" within a shapegroup is not supported; give meshes or grids
<shape type='ShapeGroup' id='g'><ref id='i'/></shape><shape type='INSTANCE' id='i'><ref id='g'/></shape>
    dir/s.xml:2:54: a shape "INSTANCE" within a shapegroup is not supported; give meshes or grids
<shape type='shapegroup'><shape type='ShapeGroup'><shape type='cube'/></shape></shape>
    dir/s.xml:2:26: a shape "ShapeGroup" within a shapegroup is not supported; give meshes or grids
<shape type='cube'><emitter type='point'/></shape>
    dir/s.xml:2:20: emitter "point" is not supported; supported: area, within a shape
<bsdf type='hair'/>
    bsdf "hair" is not supported; supported: diffuse, conductor, roughconductor, plastic, roughplastic, pplastic, dielectric, thindielectric, roughdielectric, principled, principledthin, null, polarizer, circular, retarder, blendbsdf, mask, bumpmap, normalmap, twosided
<bsdf type='twosided'><bsdf type='dielectric'/></bsdf>
    twosided around a material that light passes is not supported; leave out twosided: such a material has two sides
<bsdf type='principled'><float name='anisotropic' value='1.5'/></bsdf>
    dir/s.xml:2:25: anisotropic="1.5": expected a number between 0 and 1
<bsdf type='principledthin'><texture type='checkerboard' name='spec_trans'><float name='color0' value='2'/></texture></bsdf>
    dir/s.xml:2:29: a colour="[2, 2, 2]": expected numbers between 0 and 1
<bsdf type='bumpmap'><bsdf type='diffuse'/></bsdf>
    bsdf "bumpmap" needs a nested <texture>
<bsdf type='twosided'/>
    bsdf "twosided" needs a nested <bsdf>
<bsdf type='conductor'><string name='material' value='Xx'/></bsdf>
    the named material "Xx" is not supported; give eta and k as <rgb>, or material "none" (F = 1), or one of these: Ag, Al, Au, Cr, Cu, W, …
<bsdf type='conductor'><string name='material' value='Au'/><float name='k' value='1'/></bsdf>
    bsdf "conductor" takes either material or eta and k, not both
<bsdf type='conductor'><float name='k' value='-1'/></bsdf>
    eta, k="[0, 0, 0], [-1, -1, -1]": expected numbers of at least 0
<bsdf type='roughconductor'><string name='distribution' value='phong'/></bsdf>
    dir/s.xml:2:29: distribution="phong": expected beckmann or ggx
<bsdf type='roughconductor'><float name='alpha' value='-0.1'/></bsdf>
    dir/s.xml:2:29: alpha="-0.1": expected a number of at least 0
<bsdf type='roughplastic'><texture name='alpha' type='checkerboard'/></bsdf>
    dir/s.xml:2:27: a textured alpha of roughplastic is not supported; give a number; Mitsuba takes no texture there either
<bsdf type='roughconductor'><texture name='alpha' type='uniform'><float name='value' value='-1'/></texture></bsdf>
    dir/s.xml:2:29: alpha="-1": expected a number of at least 0
<bsdf type='diffuse'><texture name='reflectance' type='rawconstant'/></bsdf>
    dir/s.xml:2:22: value="": expected a number or three
<bsdf type='roughconductor'><float name='alpha_u' value='1'/></bsdf>
    bsdf "roughconductor" needs alpha_v beside alpha_u
<bsdf type='roughplastic'><float name='alpha_u' value='1'/><float name='alpha_v' value='.5'/></bsdf>
    an alpha_u other than alpha_v is not supported; give one alpha
<bsdf type='roughconductor'><float name='alpha_v' value='1'/><float name='alpha' value='.5'/></bsdf>
    bsdf "roughconductor" takes either alpha or alpha_u and alpha_v, not both
<texture type='wood'/>
    texture "wood" is not supported; supported: bitmap, checkerboard, mesh_attribute
<texture type='bitmap'/>
    texture "bitmap" needs filename
<texture type='bitmap'><transform name='to_uv'><rotate x='1' angle='9'/><rotate y='1' angle='9'/><translate x='1'/></transform></texture>
    dir/s.xml:2:24: a to_uv that mixes u and v with a third coordinate is not supported; leave z alone
<texture type='bitmap'><string name='filename' value='quad.obj'/></texture>
    dir/quad.obj: not a PNG, JPEG, BMP, OpenEXR or Radiance HDR image
<bsdf type='diffuse'><texture type='bitmap' name='reflectance'><string name='filename' value='sky.exr'/></texture></bsdf>
    dir/s.xml:2:22: dir/sky.exr: the pixel in column 0, row 0 (from the top left, from 0) is outside [0, 1]
<emitter type='sky'/>
    emitter "sky" is not supported; supported: constant, envmap, directional, point, spot, projector, and area within a shape
<emitter type='projector'/>
    emitter "projector" needs irradiance
<emitter type='area'/>
    an area emitter without a shape is not supported; put it inside the <shape> that emits
<emitter type='point'/>
    emitter "point" needs position or to_world
<emitter type='point'><point name='position' x='1' y='2'/></emitter>
    dir/s.xml:2:23: <point> needs an attribute "z"
<emitter type='constant'><texture name='radiance' type='bitmap'/></emitter>
    dir/s.xml:2:26: a textured radiance is not supported; give the same value everywhere
<emitter type='constant'><rgb name='radiance' value='-1'/></emitter>
    radiance="[-1, -1, -1]": expected numbers of at least 0
<emitter type='constant'/>
<emitter type='constant'/>
    dir/s.xml:3:1: 2 environments (emitters "constant" and "envmap") in the scene; expected at most one
<emitter type='directional'><float name='kappa' value='0'/></emitter>
    dir/s.xml:2:29: kappa="0": expected a number greater than 0
<emitter type='directional'><vector name='direction' value='0'/></emitter>
    direction="[0, 0, 0]": expected a vector other than 0
<emitter type='directional'><vector name='direction' value='1'/><transform name='to_world'/></emitter>
    emitter "directional" takes either direction or to_world, not both
<integrator type='depth'/>
    integrator "depth" is not supported; supported: path, direct, prb, prb_basic, prb_reparam, prb_projective, direct_reparam, direct_projective, volpath, volpathmis, prbvolpath, ptracer, bdpt, transient_path, transientpath, moment, aov, stokes, transientstokes
<integrator type='path'><integer name='max_depth' value='0'/></integrator>
    max_depth="0": expected −1 or a whole number of at least 1 (0 is a black image)
<integrator type='prb_reparam'><integer name='reparam_ray' value='8'/></integrator>
    dir/s.xml:2:32: integrator "prb_reparam" has no parameter "reparam_ray" here; supported: max_depth, rr_depth, hide_emitters, strict_normals
"#,
        case,
    );
}

#[test]
fn cameras() {
    check_table(
        r#"
<film type='specfilm'/>
    film "specfilm" is not supported; supported: hdrfilm, ldrfilm, mfilm, transient_hdr_film, streakhdrfilm
<film type='hdrfilm'><rfilter type='sinc'/></film>
    dir/s.xml:2:22: rfilter "sinc" is not supported; supported: box, tent, gaussian, mitchell, catmullrom, lanczos
<film type='hdrfilm'><rfilter type='box'><float name='radius' value='1'/></rfilter></film>
    dir/s.xml:2:42: radius="1": expected 0.5, the only box that is supported
<sampler type='sobol'><integer name='sample_count' value='0'/></sampler>
    dir/s.xml:2:23: sample_count="0": expected a whole number from 1 to 2^32 − 1
<float name='fov' value='180'/>
    fov="180": expected degrees between 0 and 180
<string name='fov_axis' value='z'/>
    fov_axis="z": expected x, y, diagonal, smaller or larger
<string name='focal_length' value='long'/>
    dir/s.xml:1:24: focal_length="long": expected a number greater than 0 and "mm"
<float name='fov' value='9'/><string name='focal_length' value='9mm'/>
    dir/s.xml:1:24: sensor "perspective" takes either fov or focal_length, not both
<float name='near_clip' value='-1'/>
    near_clip="-1": expected a number greater than 0
<float name='near_clip' value='2'/><float name='far_clip' value='1'/>
    dir/s.xml:2:36: far_clip="1": expected a number greater than near_clip
<float name='principal_point_offset_x' value='a'/>
    principal_point_offset_x="a": expected a finite number
<float name='toWorld' value='.1'/>
    sensor "perspective" has no parameter "toWorld" here; supported: pixel_aspect, fov_axis, fov, focal_length, near_clip, far_clip, principal_point_offset_x, principal_point_offset_y, focus_distance, jitter, shutter_open, shutter_close, to_world
"#,
        sensor,
    );
}
