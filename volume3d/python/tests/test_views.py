"""Pictures with cameras: every format, against points that are computed by hand."""

import json
import math
import struct

import numpy as np
import pytest

import volume3d as v3
from conftest import HALVES, SQUARE, lit_square

#: Columns and rows of all pictures.
SIZE = (48, 40)
#: f_x, f_y, c_x, c_y in pixels, with the middle of the first pixel at (½, ½).
LENS = (60.0, 66.0, 21.0, 23.5)
#: A camera at (0, 0, 4) that looks along −z, with x right and y up: by OpenCV's axes, R and t.
ROTATION, TRANSLATION = np.diag([1.0, -1, -1]), np.array([0.0, 0, 4])
#: The quaternion w, x, y, z of the rotation: half a turn about x.
QUATERNION = (0, 1, 0, 0)
POINT = np.array([0.5, 0.25, 1.0])
#: At depth 3: 21 + 60 · 0.5/3 from the left, 23.5 − 66 · 0.25/3 from the top.
SEEN = (31.0, 18.0)


def projected(view, x=POINT):
    p = view.camera.intrinsics(view.size) @ view.camera.extrinsics @ [*x, 1]
    return p[:2] / p[2]


def pictures(folder, names, value=0.5):
    folder.mkdir(exist_ok=True)
    for name in names:
        v3.write_image(folder / name, np.full((SIZE[1], SIZE[0], 3), value))


def transforms(folder, lens=LENS, **changes):
    fx, fy, cx, cy = lens
    pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]
    frame = {"file_path": "./photos/a", "transform_matrix": pose}
    file = {"w": SIZE[0], "h": SIZE[1], "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy, "frames": [frame], **changes}
    pictures(folder / "photos", ["a.png"])
    path = folder / "transforms.json"
    path.write_text(json.dumps(file))
    return path


def colmap(folder, camera=f"7 PINHOLE 48 40 {' '.join(map(str, LENS))}"):
    """A model in sparse/0, its pictures in images."""
    pictures(folder / "images", ["a.png"])
    model = folder / "sparse" / "0"
    model.mkdir(parents=True, exist_ok=True)
    pose = " ".join(map(str, [*QUATERNION, *TRANSLATION]))
    (model / "cameras.txt").write_text(f"# cameras\n{camera}\n")
    (model / "images.txt").write_text(f"# images\n1 {pose} 7 a.png\n1.5 2.5 -1\n")
    return model


def colmap_binary(folder):
    model = colmap(folder)
    (model / "cameras.bin").write_bytes(struct.pack("<QIiQQ4d", 1, 7, 1, *SIZE, *LENS))
    image = struct.pack("<QI7dI", 1, 1, *QUATERNION, *TRANSLATION, 7) + b"a.png\0" + struct.pack("<Q2dQ", 1, 1, 2, 3)
    (model / "images.bin").write_bytes(image)
    # They come first.
    (model / "cameras.txt").write_text("not read")
    return model


def dtu(folder):
    pictures(folder / "image", ["a.png"])
    mask = np.zeros((SIZE[1], SIZE[0], 3))
    mask[:, :10] = 1
    (folder / "mask").mkdir()
    v3.write_image(folder / "mask" / "a.png", mask)
    fx, fy, cx, cy = LENS
    # Pixel centres have whole coordinates there. The data's unit ball is that of the world.
    intrinsics = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
    world = np.eye(4)
    world[:3] = intrinsics @ np.column_stack([ROTATION, TRANSLATION])
    np.savez(folder / "cameras.npz", world_mat_0=world, scale_mat_0=np.eye(4))
    return folder


def mitsuba(folder):
    fx, fy, cx, cy = LENS
    fov = 2 * math.degrees(math.atan(0.5 * SIZE[0] / fx))
    path = folder / "scene.xml"
    path.write_text(f"""<scene version="3.0.0">
        <sensor type="perspective" id="a">
            <float name="fov" value="{fov!r}"/>
            <float name="principal_point_offset_x" value="{0.5 - cx / SIZE[0]!r}"/>
            <float name="principal_point_offset_y" value="{0.5 - cy / SIZE[1]!r}"/>
            <float name="pixel_aspect" value="{fy / fx!r}"/>
            <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
            <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="40"/></film>
        </sensor>
    </scene>""")
    pictures(folder / "photos", ["a.png"])
    return path


def every_format(folder):
    for name in ("nerf", "text", "binary", "dtu", "mitsuba"):
        (folder / name).mkdir()
    scene = mitsuba(folder / "mitsuba")
    return {
        "nerf": v3.Views.from_nerf(transforms(folder / "nerf")),
        "text": v3.Views.from_colmap(colmap(folder / "text")),
        "binary": v3.Views.from_colmap(colmap_binary(folder / "binary")),
        "dtu": v3.Views.from_dtu(dtu(folder / "dtu")),
        "mitsuba": v3.Views.from_mitsuba(scene, [scene.parent / "photos" / "a.png"]),
        "sensors": v3.Views.from_mitsuba(scene),
    }


def test_every_format_sees_a_point_where_its_definition_does(tmp_path):
    for name, views in every_format(tmp_path).items():
        (view,) = views
        assert view.size == SIZE and view.name in ("a", "photos/a"), name
        np.testing.assert_allclose(projected(view), SEEN, rtol=0, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(view.camera.origin, [0, 0, 4], rtol=0, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(view.camera.forward, [0, 0, -1], rtol=0, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(view.camera.up, [0, 1, 0], rtol=0, atol=1e-12, err_msg=name)
        if name == "sensors":
            assert view.picture is None
        else:
            np.testing.assert_allclose(view.picture, np.full((40, 48, 3), 0.5), atol=0.005)
        assert (view.mask is None) == (name != "dtu")


def test_images_show_points_there(tmp_path):
    """A small lamp at the point, in a dark scene: its picture is around the pixel."""
    (view,) = v3.Views.from_nerf(transforms(tmp_path))
    lamp = v3.Mesh(0.06 * SQUARE + POINT, HALVES, radiance=1)
    dark = v3.scene_from_arrays({"lamp": lamp}, origin=[0, 0, 9], target=[0, 0, 0])
    image = v3.render(dark.seen(camera=view.camera, size=view.size), spp=64).image[..., 0]
    rows, columns = np.mgrid[:40, :48] + 0.5
    center = np.array([(image * columns).sum(), (image * rows).sum()]) / image.sum()
    print(center)
    # Half a pixel, or another axis, is farther away.
    np.testing.assert_allclose(center, SEEN, rtol=0, atol=0.1)


def test_dtu_masks_cut(tmp_path):
    (view,) = v3.Views.from_dtu(dtu(tmp_path), cut=True, background=[0, 0, 1])
    assert view.mask.shape == (40, 48) and view.mask[:, :10].all() and not view.mask[:, 10:].any()
    np.testing.assert_array_equal(view.picture[:, 10:], np.broadcast_to([0.0, 0, 1], (40, 38, 3)))
    assert (view.picture[:, :10] < 0.6).all()


def test_fewer_pixels_are_the_same_camera(tmp_path):
    (view,) = v3.Views.from_nerf(transforms(tmp_path), size=(24, 20))
    assert view.size == (24, 20) and view.picture.shape == (20, 24, 3)
    np.testing.assert_allclose(projected(view), np.array(SEEN) / 2, rtol=0, atol=1e-9)
    with pytest.raises(v3.SceneError, match="48×40 pixels, and cannot be read with 96×80"):
        v3.Views.from_nerf(tmp_path / "transforms.json", size=(96, 80))


def test_cameras_look_at_points():
    views = v3.Views.look_at([[0, 3, 4], [0, 0, 5]], [0, 0, 0], fov=2 * math.degrees(math.atan(0.5)), size=(80, 60))
    assert len(views) == 2 and [view.name for view in views] == ["0", "1"]
    # f = 40/0.5, at depth 5.
    np.testing.assert_allclose(projected(views[0], [1, 0, 0]), [56, 30], rtol=0, atol=1e-9)
    np.testing.assert_allclose(projected(views[1], [0, 1, 0]), [40, 14], rtol=0, atol=1e-9)
    assert isinstance(views[1:], v3.Views) and "1: 1" in repr(views[1:])
    with pytest.raises(v3.SceneError, match="up"):
        v3.Views.look_at([[0, 3, 0]])
    with pytest.raises(ValueError, match="2 origins, but 1 pictures"):
        v3.Views.look_at([[0, 0, 3], [0, 0, 4]], pictures=[np.ones((4, 4, 3))])


def test_a_fit_takes_views(tmp_path):
    """A square is found from two photographs whose cameras a file describes."""
    poses = [np.array([[1, 0, 0, x], [0, 1, 0, 0.2], [0, 0, 1, 4], [0, 0, 0, 1.0]]) for x in (-0.3, 0.4)]
    frames = [{"file_path": f"{i}.exr", "transform_matrix": pose.tolist()} for i, pose in enumerate(poses)]
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps({"camera_angle_x": 0.6, "frames": frames}))
    truth = lit_square()
    for i, pose in enumerate(poses):
        eye = pose[:3, 3]
        one = truth.seen(origin=eye, target=eye - [0, 0, 1], fov=np.degrees(0.6))
        v3.write_image(tmp_path / f"{i}.exr", v3.render(one, spp=256, seed=i).image)
    views = v3.Views.from_nerf(path)
    scene = lit_square()
    v3.traverse(scene).update({"square.translation": [0.15, -0.1, 0]})
    options = {"optimizer": v3.Adam(0.02), "steps": 50, "spp": 4, "levels": 3}

    def error(views):
        found = v3.Fit(scene, ["square.translation"], views, **options).run().values["square.translation"]
        return np.abs(found[:2]).max()

    # The control: each picture with the camera of the other.
    swapped = [v3.View(a.picture, camera=b.camera) for a, b in zip(views, views[::-1], strict=True)]
    errors = error(views), error(swapped)
    print(errors)
    assert errors[0] < 0.015 < 0.03 < errors[1]


def test_mistakes_are_named(tmp_path):
    distorted = "7 OPENCV 48 40 60 66 21 23.5 0.1 0 0 0"
    with pytest.raises(v3.SceneError, match=r"cameras.txt:2: camera 7 is OPENCV with k1 = 0.1.*undistort"):
        v3.Views.from_colmap(colmap(tmp_path, distorted))
    with pytest.raises(v3.SceneError, match=r"cameras.txt:2: there is no cy"):
        v3.Views.from_colmap(colmap(tmp_path, "7 PINHOLE 48 40 60 66 21"))
    with pytest.raises(v3.SceneError, match=r"transforms.json, frame 0: a lens with k1 = 0.1"):
        v3.Views.from_nerf(transforms(tmp_path, k1=0.1))
    with pytest.raises(v3.SceneError, match=r'transforms.json: "frames" is null, but must be a list'):
        v3.Views.from_nerf(transforms(tmp_path, frames=None))
    with pytest.raises(v3.SceneError, match="no-such-folder"):
        v3.Views.from_dtu("no-such-folder")
    with pytest.raises(v3.SceneError, match="there are 1 sensors, but 0 pictures"):
        v3.Views.from_mitsuba(mitsuba(tmp_path), [])
    with pytest.raises(ValueError, match="size is that of pictures"):
        v3.Views.from_mitsuba(mitsuba(tmp_path), size=SIZE)
    views = v3.Views.from_mitsuba(mitsuba(tmp_path))
    with pytest.raises(v3.FitError, match="view `a` has no picture"):
        v3.Fit(lit_square(), ["square.translation"], views)
    both = v3.View(np.ones((20, 24, 3)), origin=[0, 0, 4], target=[0, 0, 0], camera=views[0].camera)
    with pytest.raises(ValueError, match="not both"):
        v3.Fit(lit_square(), ["square.translation"], [both])
    with pytest.raises(v3.SceneError, match="180"):
        v3.Camera.look_at([0, 0, 1], [0, 0, 0], fov=180)
    with pytest.raises(TypeError, match="view 0 must be"):
        v3.Views([1])
