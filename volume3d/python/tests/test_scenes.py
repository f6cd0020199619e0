"""Scenes, parameters, images and files."""

import copy

import numpy as np
import pytest

import volume3d as v3
from conftest import HALVES, SQUARE, lit_square

XML = """<scene version="3.0.0">
    <default name="size" value="16"/>
    <integrator type="direct"/>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="$size"/><integer name="height" value="16"/></film>
    </sensor>
    <bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.2 0.4 0.6"/></bsdf>
    <shape type="rectangle" id="square"><ref id="paint"/></shape>
    <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
</scene>"""


def test_a_square_under_a_white_sky_has_its_reflectance():
    scene = v3.load_string(XML, variables={"size": 8})
    assert scene.shape == (16, 8, 3)
    runs = [v3.render(scene, spp=16, seed=seed) for seed in range(16)]
    assert all(image.non_finite == [] for image in runs)
    inner = np.array([image.image[6:10, 3:5].mean(axis=(0, 1)) for image in runs]) / [0.2, 0.4, 0.6]
    error = inner.std(axis=0, ddof=1) / 4
    assert (5 * error < 0.02).all(), "the comparison has no power"
    assert (abs(inner.mean(axis=0) - 1) < 5 * error).all()


def test_a_file_is_read_like_its_text(tmp_path):
    path = tmp_path / "scene.xml"
    path.write_text(XML)
    from_file, from_text = v3.load_file(path, size=(12, 9)), v3.load_string(XML, size=(12, 9))
    assert np.array_equal(v3.render(from_file, spp=2), v3.render(from_text, spp=2))


def test_errors_name_the_line_and_share_a_base():
    with pytest.raises(v3.SceneError, match=":10:.*rectangel"):
        v3.load_string(XML.replace("rectangle", "rectangel"))
    with pytest.raises(v3.Error, match="no-such-file"):
        v3.load_file("no-such-file.xml")


def test_parameters_are_set_together_or_not_at_all(scene):
    params = v3.traverse(scene)
    before = v3.render(scene, spp=4).image
    with pytest.raises(v3.ParameterError, match="reflectance"):
        params.update({"square.translation": [0.1, 0, 0], "paint.reflectance": [0.5, 2.0, 0.5]})
    assert np.array_equal(v3.render(scene, spp=4), before)
    np.testing.assert_array_equal(params["square.translation"], 0)
    params.update({"square.translation": [0.1, 0, 0], "paint.reflectance": [0.5, 0.25, 0.5]})
    assert not np.array_equal(v3.render(scene, spp=4), before)
    np.testing.assert_array_equal(params["square.translation"], [0.1, 0, 0])


def test_poses_are_relative_to_the_scene_as_it_was_made(scene):
    corners = scene.mesh("square").positions
    v3.traverse(scene).update({"square.translation": [0.1, 0, 0]})
    again = v3.traverse(scene)
    np.testing.assert_array_equal(again["square.translation"], [0.1, 0, 0])
    again.update({"square.translation": [0, 0.2, 0]})
    np.testing.assert_allclose(scene.mesh("square").positions, corners + [0, 0.2, 0], atol=1e-15)


def test_names_are_selected_by_patterns(scene):
    params = v3.traverse(scene)
    params.keep("square.*")
    assert "square.translation" in params and "lamp.translation" not in params
    with pytest.raises(v3.ParameterError, match="square.translation"):
        v3.traverse(scene).keep("square.translatoin")


def test_rotations_are_composed(scene):
    params = v3.traverse(scene)
    params.update({"square.rotation": [0, 0, 3.0]})
    params.retract({"square.rotation": np.array([0, 0, 0.5])})
    np.testing.assert_allclose(params["square.rotation"], [0, 0, 3.5 - 2 * np.pi], atol=1e-12)


def test_copies_are_independent(scene):
    other = copy.deepcopy(scene)
    v3.traverse(other).update({"square.translation": [0.3, 0, 0]})
    np.testing.assert_array_equal(v3.traverse(scene)["square.translation"], 0)


def test_images_are_written_and_shown(scene, tmp_path):
    image = v3.render(scene, spp=4)
    image.save(tmp_path / "image.exr")
    np.testing.assert_allclose(v3.read_image(tmp_path / "image.exr"), image.image, rtol=1e-6)
    assert image._repr_png_().startswith(b"\x89PNG")
    assert np.from_dlpack(image).shape == scene.shape and np.asarray(image, np.float32).dtype == np.float32
    with pytest.raises(ValueError, match="png"):
        image.save(tmp_path / "image.gif")


def test_another_view_leaves_the_scene(scene):
    other = scene.seen(origin=[1, 1, 4], target=[0, 0, 0], fov=20, size=(10, 6))
    assert other.shape == (6, 10, 3) and scene.shape == (20, 24, 3)
    with pytest.raises(ValueError, match="target"):
        scene.seen(origin=[0, 0, 1])


def test_textures_are_parameters():
    texels = np.random.default_rng(0).uniform(0.1, 0.9, (4, 4, 3))
    uvs = (SQUARE[:, :2] + 1) / 2
    scene = v3.scene_from_arrays(
        {"square": v3.Mesh(SQUARE, HALVES, material="paint", uvs=uvs)},
        origin=[0, 0, 4], target=[0, 0, 0], size=(16, 16), sky=1,
        materials={"paint": {"type": "diffuse", "reflectance": texels}},
    )
    [name] = [name for name in scene.names if name.startswith("paint")]
    np.testing.assert_array_equal(v3.traverse(scene)[name].reshape(4, 4, 3), texels)


def test_threads_change_no_bit():
    try:
        images = []
        for threads in (1, 2, 3):
            v3.set_num_threads(threads)
            assert v3.num_threads() == threads
            images.append(v3.render(lit_square(), spp=4, seed=5).image)
    finally:
        v3.set_num_threads(0)
    assert np.array_equal(images[0], images[1]) and np.array_equal(images[0], images[2])
