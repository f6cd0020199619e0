"""Writes the scenes of this folder, one for each feature of the format: python generate.py

Needs Mitsuba 3 (pip install mitsuba), for the .exr and .ply files. `$x` moves the shape `thing` along x.
"""

import math
import pathlib

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
HERE = pathlib.Path(__file__).parent / "scenes"

DIFFUSE = '<bsdf type="diffuse"><rgb name="reflectance" value="0.7 0.5 0.3"/></bsdf>'
LAMP = """<shape type="rectangle" id="lamp">
        <transform name="to_world"><scale x="0.6" y="0.5"/><rotate x="1" angle="100"/><translate x="-0.8" y="2.4" z="0.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="9 8 7"/></emitter>
    </shape>"""
PLACE = '<scale value="0.5"/><rotate x="0.28" y="0.96" angle="35"/><translate x="0.1" y="0.55" z="0.1"/><translate x="$x"/>'
LOOKAT = '<lookat origin="0.3, 1.3, 3.4" target="0, 0.5, 0" up="0, 1, 0"/>'


SMALLER = '<scale value="0.7"/>'


def place(more=""):
    return f'<transform name="to_world">{more}{PLACE}</transform>'


def sphere(bsdf=DIFFUSE, more=""):
    return f'<shape type="obj" id="thing"><string name="filename" value="ball.obj"/>{place(more)}{bsdf}</shape>'


def cube(bsdf=DIFFUSE):
    return f'<shape type="cube" id="thing">{place(SMALLER)}{bsdf}</shape>'


def write(name, thing=None, lights=LAMP, filter='<rfilter type="tent"/>', sensor="perspective", more_sensor="", more_film="",
          integrator='<integrator type="path"><integer name="max_depth" value="3"/></integrator>', before="", transform=LOOKAT):
    thing = cube() if thing is None else thing
    (HERE / f"{name}.xml").write_text(f"""<scene version="3.0.0">
    <default name="x" value="0"/>
    {integrator}
    <sensor type="{sensor}">
        <float name="fov" value="38"/>{more_sensor}
        <transform name="to_world">{transform}</transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/>{more_film}{filter}</film>
    </sensor>
    {before}<shape type="rectangle" id="floor">
        <transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.4 0.5 0.6"/></bsdf>
    </shape>
    {thing}
    {lights}
</scene>
""".replace('<float name="fov" value="38"/>' if sensor == "orthographic" else "\0", ""))


def ball(rings=10):
    """A ball of radius 1 with normals and texture coordinates, bumpy so that it is no sphere."""
    around = 2 * rings
    lines = []
    for i in range(rings + 1):
        for j in range(around + 1):
            a, b = math.pi * i / rings, 2 * math.pi * j / around
            n = (math.sin(a) * math.cos(b), math.cos(a), math.sin(a) * math.sin(b))
            lines.append("v %.6f %.6f %.6f" % n)
            lines.append("vn %.6f %.6f %.6f" % n)
            lines.append("vt %.6f %.6f" % (j / around, 1 - i / rings))
    at = lambda i, j: i * (around + 1) + j + 1
    for i in range(rings):
        for j in range(around):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            face = lambda *v: "f " + " ".join(f"{k}/{k}/{k}" for k in v)
            if i > 0:
                lines.append(face(a, d, c))
            if i < rings - 1:
                lines.append(face(a, c, b))
    (HERE / "ball.obj").write_text("\n".join(lines) + "\n")


def files():
    HERE.mkdir(exist_ok=True)
    ball()
    rng = np.random.default_rng(1)
    tiles = (0.2 + 0.6 * rng.random((8, 8, 3))).astype(np.float32)
    mi.Bitmap(tiles).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True).write(str(HERE / "tiles.png"))
    height, width = 16, 32
    y, x = np.mgrid[0:height, 0:width]
    sky = np.stack([0.3 + 0.2 * np.cos(2 * np.pi * x / width), 0.4 + 0 * x, 0.5 - 0.3 * y / height], -1)
    sky[3:5, 20:23] += 12
    mi.Bitmap(sky.astype(np.float32)).write(str(HERE / "sky.exr"))
    mesh = mi.load_dict({"type": "obj", "filename": str(HERE / "ball.obj")})
    mesh.write_ply(str(HERE / "ball.ply"))
    sides = ["1 3 7 5", "2 6 8 4", "1 5 6 2", "3 4 8 7", "1 2 4 3", "5 7 8 6"]
    corners = [f"v {x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    (HERE / "bare.obj").write_text("\n".join(corners + ["f " + side for side in sides]) + "\n")
    header = ["ply", "format ascii 1.0", "element vertex 4"] + [f"property float {name}" for name in ("x", "y", "z", "texture_u", "texture_v")]
    header += ["element face 2", "property list uchar int vertex_indices", "end_header"]
    (HERE / "sheet.ply").write_text("\n".join(header + ["-1 -1 0 0 0", "1 -1 0 1 .2", "1 1 0 .9 1", "-1 1 0 0 .8", "3 0 1 2", "3 0 2 3"]) + "\n")


def main():
    files()
    tiles = '<texture type="bitmap" name="reflectance"><string name="filename" value="tiles.png"/>%s</texture>'
    rough = '<bsdf type="roughconductor"><string name="material" value="Cu"/><string name="distribution" value="%s"/>%s</bsdf>'
    # Shapes.
    write("cube")
    write("obj_with_normals", sphere())
    write("ply_with_normals", f'<shape type="ply" id="thing"><string name="filename" value="ball.ply"/>{place()}{DIFFUSE}</shape>')
    write("obj_face_normals", f'<shape type="obj" id="thing"><string name="filename" value="ball.obj"/><boolean name="face_normals" value="true"/>{place()}{DIFFUSE}</shape>')
    write("sphere", f'<shape type="sphere" id="thing"><point name="center" x="0.1" y="0.2" z="0"/><float name="radius" value="0.8"/>{place()}{DIFFUSE}</shape>')
    write("cylinder", f'<shape type="cylinder" id="thing"><float name="radius" value="0.5"/>{place()}<bsdf type="twosided">{DIFFUSE}</bsdf></shape>')
    write("disk", f'<shape type="disk" id="thing">{place()}<bsdf type="twosided">{DIFFUSE}</bsdf></shape>')
    write("instance", before='<shape type="shapegroup" id="group"><shape type="cube"><transform name="to_world"><scale value="0.3"/></transform>'
          f'{DIFFUSE}</shape></shape>', thing=f'<shape type="instance"><ref id="group"/>{place()}</shape>')
    # Axes of rotations that are not of length 1, which shear.
    other = lambda name, thing, **more: write(name, thing.replace('x="0.28" y="0.96" angle="35"', 'x="0.9" y="1.1" angle="50"'), **more)
    other("axis_cube", cube())
    other("axis_with_normals", sphere())
    other("axis_face_normals", f'<shape type="obj" id="thing"><string name="filename" value="ball.obj"/><boolean name="face_normals" value="true"/>{place()}{DIFFUSE}</shape>')
    other("axis_sphere", f'<shape type="sphere" id="thing"><point name="center" x="0.1" y="0.2" z="0"/><float name="radius" value="0.8"/>{place()}{DIFFUSE}</shape>')
    other("axis_cylinder", f'<shape type="cylinder" id="thing"><float name="radius" value="0.5"/>{place()}<bsdf type="twosided">{DIFFUSE}</bsdf></shape>')
    other("axis_disk", f'<shape type="disk" id="thing">{place()}<bsdf type="twosided">{DIFFUSE}</bsdf></shape>')
    other("axis_instance", f'<shape type="instance"><ref id="group"/>{place()}</shape>', before='<shape type="shapegroup" id="group"><shape type="cube">'
          f'<transform name="to_world"><scale value="0.5"/></transform>{DIFFUSE}</shape></shape>')
    # Materials.
    write("bitmap", sphere(f'<bsdf type="diffuse">{tiles % ""}</bsdf>'))
    write("bitmap_transformed_nearest", sphere('<bsdf type="diffuse">' + tiles % (
        '<string name="filter_type" value="nearest"/><transform name="to_uv"><scale x="2" y="1.5"/></transform>') + "</bsdf>"))
    write("checkerboard", sphere('<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"><rgb name="color0" value="0.1 0.2 0.5"/>'
                                 '<transform name="to_uv"><scale x="6" y="3"/></transform></texture></bsdf>'))
    write("roughconductor_ggx", sphere(rough % ("ggx", '<float name="alpha" value="0.3"/>')))
    write("roughconductor_beckmann_stretched", sphere(rough % ("beckmann", '<float name="alpha_u" value="0.15"/><float name="alpha_v" value="0.4"/>')))
    write("roughplastic", sphere('<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.2 0.4 0.6"/><float name="alpha" value="0.2"/></bsdf>'))
    write("principled", sphere('<bsdf type="principled"><rgb name="base_color" value="0.7 0.4 0.2"/><float name="roughness" value="0.4"/>'
                               '<float name="metallic" value="0.5"/><float name="specular" value="0.6"/></bsdf>'))
    write("blendbsdf", sphere('<bsdf type="blendbsdf"><float name="weight" value="0.35"/>' + DIFFUSE + rough % ("ggx", '<float name="alpha" value="0.4"/>') + "</bsdf>"))
    write("plastic", sphere('<bsdf type="plastic"><rgb name="diffuse_reflectance" value="0.2 0.4 0.6"/></bsdf>'))
    write("dielectric", sphere('<bsdf type="dielectric"/>'), integrator='<integrator type="path"><integer name="max_depth" value="6"/></integrator>')
    # Without a sky, `path` of Mitsuba 3.9 drops the light of paths that pass masks only and then leave the scene.
    sky = '<emitter type="constant"><rgb name="radiance" value="0.02 0.03 0.04"/></emitter>'
    write("mask", sphere(f'<bsdf type="mask"><float name="opacity" value="0.6"/><bsdf type="twosided">{DIFFUSE}</bsdf></bsdf>'), lights=LAMP + "\n    " + sky)
    # Texture coordinates.
    painted = f'<bsdf type="twosided"><bsdf type="diffuse">{tiles % ""}</bsdf></bsdf>'
    write("cube_textured", cube(painted))
    write("sphere_textured", f'<shape type="sphere" id="thing"><float name="radius" value="0.8"/>{place()}{painted}</shape>')
    write("cylinder_textured", f'<shape type="cylinder" id="thing"><float name="radius" value="0.7"/>{place()}{painted}</shape>')
    write("disk_textured", f'<shape type="disk" id="thing">{place()}{painted}</shape>')
    write("obj_without_coordinates", f'<shape type="obj" id="thing"><string name="filename" value="bare.obj"/>'
          f'<boolean name="face_normals" value="true"/>{place(SMALLER)}{painted}</shape>')
    write("ply_texture_u", f'<shape type="ply" id="thing"><string name="filename" value="sheet.ply"/>{place()}{painted}</shape>')
    # Materials at their limits, and textures that are the same everywhere.
    alpha = '<texture type="bitmap" name="alpha_%s"><string name="filename" value="tiles.png"/><boolean name="raw" value="true"/></texture>'
    write("roughconductor_textured", sphere(rough % ("ggx", alpha % "u" + '<float name="alpha_v" value="0.5"/>')))
    deeper = '<integrator type="path"><integer name="max_depth" value="6"/></integrator>'
    write("roughdielectric_textured", sphere('<bsdf type="roughdielectric"><string name="distribution" value="ggx"/>' + alpha % "u" + alpha % "v" + "</bsdf>"),
          integrator=deeper)
    write("roughdielectric_stretched", sphere('<bsdf type="roughdielectric"><float name="alpha_u" value="0.15"/><float name="alpha_v" value="0.4"/></bsdf>'),
          integrator=deeper)
    write("roughconductor_smooth", sphere(rough % ("ggx", '<float name="alpha" value="0"/>')))
    write("principled_no_boundary", sphere('<bsdf type="principled"><rgb name="base_color" value="0.7 0.4 0.2"/><float name="roughness" value="0.4"/>'
                                           '<float name="clearcoat" value="0.5"/><float name="eta" value="1"/></bsdf>'))
    write("constant_textures", sphere('<bsdf type="principled"><texture type="srgb" name="base_color"><rgb name="color" value="0.7 0.4 0.2"/></texture>'
                                      '<texture type="rawconstant" name="roughness"><float name="value" value="0.4"/></texture></bsdf>'))
    # Mirrors.
    write("camera_mirrored", transform=f'<scale x="-1"/>{LOOKAT}')
    # Lights.
    sky = '<emitter type="envmap"><string name="filename" value="sky.exr"/><float name="scale" value="0.8"/><transform name="to_world"><rotate y="1" angle="50"/></transform></emitter>'
    write("envmap", lights=sky)
    write("envmap_mirrored", lights=sky.replace("<rotate", '<scale x="-1"/><rotate'))
    write("constant", lights='<emitter type="constant"><rgb name="radiance" value="0.6 0.7 0.8"/></emitter>')
    write("point", lights='<emitter type="point"><point name="position" x="-1" y="2.5" z="1.5"/><rgb name="intensity" value="9 8 7"/></emitter>')
    write("spot", lights='<emitter type="spot"><transform name="to_world"><lookat origin="-1,2.5,1.5" target="0,0.4,0" up="0,1,0"/></transform>'
          '<rgb name="intensity" value="20 18 16"/><float name="cutoff_angle" value="22"/></emitter>')
    write("directional", lights='<emitter type="directional"><vector name="direction" x="0.4" y="-1" z="-0.5"/><rgb name="irradiance" value="2 2 2"/></emitter>')
    write("directional_scaled", lights='<emitter type="directional"><transform name="to_world"><scale value="1.5"/><rotate x="1" y="0.4" angle="110"/></transform>'
          '<rgb name="irradiance" value="1 1 1"/></emitter>')
    write("lamp_with_normals", lights=LAMP.replace('type="rectangle"', 'type="obj"').replace("<transform", '<string name="filename" value="ball.obj"/><transform')
          .replace('<scale x="0.6" y="0.5"/>', '<scale value="0.3"/>'))
    write("lamp_textured", lights=LAMP.replace('<rgb name="radiance" value="9 8 7"/>',
                                               '<texture type="bitmap" name="radiance"><string name="filename" value="tiles.png"/><boolean name="raw" value="true"/></texture>'))
    # Sensors, films and integrators.
    write("thinlens", sensor="thinlens", more_sensor='<float name="aperture_radius" value="0.12"/><float name="focus_distance" value="3.2"/>')
    write("orthographic", sensor="orthographic", transform=f'<scale x="1.3" y="1.3"/>{LOOKAT}')
    write("crop", more_film='<integer name="crop_offset_x" value="8"/><integer name="crop_offset_y" value="4"/><integer name="crop_width" value="16"/><integer name="crop_height" value="16"/>')
    for filter in ["box", "gaussian", "mitchell", "catmullrom", "lanczos"]:
        write(f"filter_{filter}", filter=f'<rfilter type="{filter}"/>')
    write("sample_border", filter='<rfilter type="gaussian"/>', more_film='<boolean name="sample_border" value="true"/>')
    write("hide_emitters", integrator='<integrator type="path"><integer name="max_depth" value="3"/><boolean name="hide_emitters" value="true"/></integrator>',
          lights=LAMP.replace('<translate x="-0.8" y="2.4" z="0.5"/>', '<translate x="-0.8" y="1.3" z="-0.5"/>'))
    write("direct", integrator='<integrator type="direct"><integer name="emitter_samples" value="2"/><integer name="bsdf_samples" value="1"/></integrator>')
    write("fov_axis_y", more_sensor='<string name="fov_axis" value="y"/>')
    write("principal_point", more_sensor='<float name="principal_point_offset_x" value="0.1"/><float name="principal_point_offset_y" value="-0.05"/>')


main()
