"""Derivatives against central differences, against one another, and of other frameworks."""

import numpy as np
import pytest

import volume3d as v3
from conftest import lit_square

#: Runs of each estimate; Student's |t| of 15 degrees of freedom exceeds 5 in 1 of 6,000 comparisons.
RUNS, TOLERATED = 16, 5.0

CHANGES = [
    {"square.translation": [1.0, 0.5, 0.0]},
    {"square.rotation": [0.3, 0.2, 1.0]},
    {"lamp.translation": [1.0, 0.0, 0.0]},
    {"paint.reflectance": [1.0, 0.5, 0.2]},
    {"camera.translation": [0.2, 0.1, 0.0]},
]


def weights():
    y, x = np.mgrid[0:20, 0:24]
    u, v = (x - 11.5) / 12, (y - 9.5) / 10
    return np.repeat((0.2 + u + 0.5 * v + u * v)[:, :, None], 3, axis=2)


def totals(change, **options):
    scene = lit_square()
    runs = [v3.forward(scene, change, seed=100 + run, **options) for run in range(RUNS)]
    return np.array([(run.gradient * weights()).sum() for run in runs])


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: next(iter(change)))
def test_forward_agrees_with_differences(change):
    ours = totals(change, spp=128 if "lamp.translation" in change else 32, method="edge")
    theirs = totals(change, spp=256, method="finite-difference", step=0.05)
    error = np.hypot(*(np.std(t, ddof=1) / np.sqrt(RUNS) for t in (ours, theirs)))
    size = abs(theirs.mean())
    print(f"{change}: {ours.mean():.4f} against {theirs.mean():.4f} ± {error:.4f}; "
          f"smallest visible bias {100 * TOLERATED * error / size:.0f} %")
    assert TOLERATED * error < 0.5 * size, "the comparison has no power"
    assert abs(ours.mean() - theirs.mean()) < TOLERATED * error
    # Its control: the interior term alone, wherever geometry moves.
    if "paint.reflectance" not in change:
        interior = totals(change, spp=32, method="interior")
        assert abs(interior.mean() - theirs.mean()) > TOLERATED * error


@pytest.mark.parametrize("method", ["warped-area", "rotation", "edge"])
def test_reverse_is_the_transpose_of_forward(scene, method):
    names = ["square.translation", "square.rotation", "paint.reflectance"]
    gradient = v3.reverse(scene, names, weights(), spp=8, seed=7, method=method)
    rng = np.random.default_rng(1)
    direction = {name: rng.normal(size=gradient[name].shape) for name in names}
    forward = v3.forward(scene, direction, spp=8, seed=7, method=method)
    expected = (forward.gradient * weights()).sum()
    found = sum((gradient[name] * direction[name]).sum() for name in names)
    assert found == pytest.approx(expected, rel=1e-9)


def test_runs_give_a_standard_error(scene):
    gradient = v3.reverse(scene, ["square.translation"], weights(), spp=4, runs=16, seed=3)
    again = v3.reverse(scene, ["square.translation"], weights(), spp=64, runs=16, seed=4)
    z = (gradient["square.translation"] - again["square.translation"])[:2]
    z /= np.hypot(gradient.stderr["square.translation"], again.stderr["square.translation"])[:2]
    assert np.abs(z).max() < TOLERATED
    assert (gradient.stderr["square.translation"][:2] > again.stderr["square.translation"][:2]).all()


def test_an_adjoint_that_is_not_finite_is_refused(scene):
    adjoint = weights()
    adjoint[3, 5, 1] = np.nan
    with pytest.raises(v3.GradientError, match="5"):
        v3.reverse(scene, ["square.translation"], adjoint)
    with pytest.raises(v3.GradientError, match="24"):
        v3.reverse(scene, ["square.translation"], np.ones((4, 4, 3)))


def test_arrays_of_other_types_and_layouts_are_converted(scene):
    plain = v3.reverse(scene, ["square.translation"], weights(), spp=2)["square.translation"]
    for adjoint in (
        np.asfortranarray(weights()),
        weights()[::-1][::-1],
        np.broadcast_to(weights(), (1, 20, 24, 3))[0],
        weights().tolist(),
    ):
        assert np.array_equal(v3.reverse(scene, ["square.translation"], adjoint, spp=2)["square.translation"], plain)
    unaligned = np.frombuffer(b"x" + weights().tobytes(), np.uint8)[1:].view(np.float64).reshape(20, 24, 3)
    assert np.array_equal(v3.reverse(scene, ["square.translation"], unaligned, spp=2)["square.translation"], plain)


def test_compare_finds_what_is_wrong_with_a_gradient(scene):
    change = {"square.translation": [1.0, 0.0, 0.0]}
    right = np.stack([v3.forward(scene, change, spp=16, seed=s, method="edge").gradient for s in range(500, 516)])
    found = v3.compare(right, scene, change, spp=8)
    assert abs(found.z) < TOLERATED and abs(found.slope - 1) < TOLERATED * found.slope_stderr
    assert found.slope_stderr < 0.05 and found.includes_their_noise
    interior = np.stack([
        v3.forward(scene, change, spp=16, seed=s, method="interior").gradient for s in range(500, 516)
    ])
    assert abs(v3.compare(interior, scene, change, spp=8).z) > TOLERATED
    assert abs(v3.compare(0.8 * right, scene, change, spp=8).z) > TOLERATED
    assert found._repr_png_().startswith(b"\x89PNG")


def test_pytorch():
    torch = pytest.importorskip("torch")
    from volume3d.torch import Retracted, render

    scene = lit_square()
    x = {name: torch.tensor(v3.traverse(scene)[name], requires_grad=True)
         for name in ("square.translation", "square.rotation")}
    image = render(scene, x, spp=4, seed=1, method="warped-area")
    (image * torch.from_numpy(weights())).sum().backward()
    plain = v3.reverse(scene, list(x), weights(), spp=4, seed=1, method="warped-area")
    for name in x:
        assert np.array_equal(x[name].grad.numpy(), plain[name])
    optimizer = Retracted(scene, x, lambda tensors: torch.optim.Adam(tensors, lr=0.02))
    optimizer.step()
    assert all((value.detach() != 0).any() for value in x.values())


def test_jax():
    jax = pytest.importorskip("jax")
    from volume3d.jax import renderer

    scene = lit_square()
    image = renderer(scene, spp=4, method="warped-area")
    zeros = {"square.translation": jax.numpy.zeros(3)}
    loss = jax.jit(jax.grad(lambda x: (image(x, 1) * weights()).sum()))
    plain = v3.reverse(scene, list(zeros), weights().astype(np.float32), spp=4, seed=1, method="warped-area")
    np.testing.assert_allclose(loss(zeros)["square.translation"], plain["square.translation"], rtol=1e-5)
