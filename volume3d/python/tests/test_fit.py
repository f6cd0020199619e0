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


BALL = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="2"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film>
    </sensor>
    <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
    <shape type="sdfgrid" id="ball">
        <float name="radius" value="$radius"/>
        <integer name="cells" value="8"/>
        <vector name="low" value="-1 -1 -1"/>
        <vector name="high" value="1 1 1"/>
    </shape>
</scene>"""


def test_a_grid_stays_a_distance():
    """A ball grows. With large steps φ keeps the slope 1 of a distance; plain steps are the control."""
    small, large = (v3.load_string(BALL, variables={"radius": radius}) for radius in (0.5, 0.65))
    origins = 3 * np.vstack([np.eye(3), -np.eye(3)]) + [0, 0.1, 0.1]
    pictures = [v3.render(large.seen(origin=o, target=[0, 0, 0]), spp=64) for o in origins]
    views = v3.Views.look_at(origins, pictures=pictures)
    at = np.linspace(-1, 1, 9)
    radius = np.sqrt(at[:, None, None] ** 2 + at[:, None] ** 2 + at**2)
    shell, results = (radius > 0.3) & (radius < 0.9), []
    for large_steps in (1, None):
        adam = v3.Adam(0.03, beta2=0.95, large_steps=large_steps)
        found = v3.Fit(small, ["ball.sdf"], views, optimizer=adam, steps=20, views_per_step=2, spp=4).run()
        phi = found.values["ball.sdf"].reshape(9, 9, 9)
        slopes = np.linalg.norm(np.gradient(phi, 0.25), axis=0)
        results.append((np.abs(phi - (radius - 0.65))[shell].mean(), np.abs(slopes - 1)[shell].mean()))
    print(results)
    (error, slope), (_, control) = results
    assert error < 0.075 and 3 * slope < control


def test_mistakes_are_named():
    with pytest.raises(v3.FitError, match="views"):
        v3.Fit(lit_square(), NAMES, [])
    with pytest.raises(v3.FitError, match="rate"):
        fit(optimizer=v3.Adam(-1))
    with pytest.raises(v3.FitError, match="vertex positions and SDF grids"):
        fit(optimizer=v3.Adam(0.1, large_steps=1))
    with pytest.raises(ValueError, match="loss"):
        fit(loss="l3")
    with pytest.raises(v3.ParameterError, match="square.translatoin"):
        v3.Fit(lit_square(), ["square.translatoin"], [v3.View(np.ones((20, 24, 3)))])
