"""Fits."""

import numpy as np
import pytest

import volume3d as v3
from conftest import lit_square

NAMES = ["square.translation", "square.rotation"]


def displaced():
    """The true scene's picture, and the scene with the square elsewhere."""
    picture = v3.render(lit_square(), spp=256, seed=9)
    scene = lit_square()
    v3.traverse(scene).update({"square.translation": [0.15, -0.1, 0], "square.rotation": [0, 0, 0.3]})
    return scene, picture


def fit(**options):
    scene, picture = displaced()
    settings = {"optimizer": v3.Adam(0.03), "steps": 60, "spp": 4, "levels": 3, **options}
    return v3.Fit(scene, NAMES, [v3.View(picture)], **settings)


def test_a_pose_is_found():
    result = fit().run()
    found = result.values
    print(found, result.method)
    assert np.abs(found["square.translation"][:2]).max() < 0.01
    assert abs(found["square.rotation"][2]) < 0.03
    corners = result.scene.mesh("square").positions
    np.testing.assert_allclose(corners, lit_square().mesh("square").positions, atol=0.05)
    # Its control: without the boundary term the fit does not arrive.
    interior = fit(method="interior").run().values
    assert np.abs(interior["square.translation"][:2]).max() > 0.05


def test_a_fit_resumes_bit_for_bit():
    whole = fit(steps=6).run()
    first = fit(steps=6)
    first.run(3)
    state = first.state()
    second = fit(steps=6)
    second.resume(state)
    second.run()
    for name in NAMES:
        assert np.array_equal(whole.values[name], second.values[name])
    assert np.array_equal(whole.losses, second.losses) and second.steps_taken == 6
    for damaged in (b"", state[:-1], state[:40] + bytes([state[40] ^ 1]) + state[41:]):
        with pytest.raises(v3.FitError):
            fit(steps=6).resume(damaged)


def test_several_views_move_vertices():
    cameras = [{"origin": [x, 0.3, 4], "target": [0, 0, 0], "fov": 30} for x in (-1.0, 1.0)]
    truth = lit_square()
    views = [v3.View(v3.render(truth.seen(**c), spp=64, seed=4), **c) for c in cameras]
    scene = lit_square()
    positions = v3.traverse(scene)["square.vertex_positions"]
    v3.traverse(scene).update({"square.vertex_positions": positions * [1.2, 0.8, 1]})
    before = v3.traverse(scene)["square.vertex_positions"]
    result = v3.Fit(
        scene, ["square.vertex_positions"], views,
        optimizer=v3.Adam(0.02, uniform=True), steps=30, spp=4, levels=3,
        penalties=[v3.Penalty("square", "laplacian", 1e-4)],
    ).run()
    error = [np.abs((x - positions)[:, :2]).mean() for x in (before, result.values["square.vertex_positions"])]
    print(error)
    assert error[1] < 0.4 * error[0]


def test_mistakes_are_named():
    with pytest.raises(v3.FitError, match="views"):
        v3.Fit(lit_square(), NAMES, [])
    with pytest.raises(v3.FitError, match="rate"):
        fit(optimizer=v3.Adam(-1))
    with pytest.raises(ValueError, match="loss"):
        fit(loss="l3")
    with pytest.raises(v3.ParameterError, match="square.translatoin"):
        v3.Fit(lit_square(), ["square.translatoin"], [v3.View(np.ones((20, 24, 3)))])
