"""Wrong arguments, signals, forks and types."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import volume3d as v3
from conftest import lit_square

#: Calls of the fuzz.
CALLS = 10_000


def test_ctrl_c_ends_a_render_soon(scene):
    # Shells start background jobs with this signal ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)

    def interrupt():
        time.sleep(0.3)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        v3.render(scene.seen(size=(512, 512)), spp=4096)
    late = time.monotonic() - start - 0.3
    print(f"{1e3 * late:.0f} ms after the signal")
    assert late < 2.0, "about 0.1 s on a quiet machine"


def test_other_threads_go_on(scene):
    count, done = 0, threading.Event()

    def work():
        nonlocal count
        while not done.is_set():
            count += 1
            time.sleep(0.001)

    thread = threading.Thread(target=work)
    thread.start()
    v3.render(scene.seen(size=(128, 128)), spp=64)
    done.set()
    thread.join()
    assert count > 10


def test_a_callback_sees_progress_and_may_cancel(scene):
    seen = []
    v3.render(scene, spp=16, progress=lambda done, total: seen.append((done, total)))
    assert seen and seen[-1][0] == seen[-1][1] > 0

    def cancel(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        v3.render(scene.seen(size=(512, 512)), spp=4096, progress=cancel)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_forked_children_render(scene):
    expected = v3.render(scene, spp=4).image
    code = os.fork()
    if code == 0:
        same = np.array_equal(v3.render(scene, spp=4).image, expected)
        os._exit(0 if same else 1)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        ended, status = os.waitpid(code, os.WNOHANG)
        if ended:
            assert os.waitstatus_to_exitcode(status) == 0
            return
        time.sleep(0.01)
    os.kill(code, signal.SIGKILL)
    pytest.fail("the child hangs")


def test_no_argument_causes_a_panic():
    """Every function with wrong types, shapes, values and layouts: only ordinary exceptions."""
    rng = np.random.default_rng(0)
    scene = lit_square((6, 5))
    odd = [
        None, True, 0, 1, -1, 2**70, 0.5, float("nan"), float("inf"), "", "square.translation", "square", "\ud800",
        b"x", [], {}, (), [1, 2, 3], [[1, 2], [3]], object(), np.nan, np.zeros(3), np.full((5, 6, 3), np.nan),
        np.zeros((5, 6, 3)), np.zeros((5, 6, 3), np.float32), np.ones((5, 6, 4)), np.zeros((0, 0, 3)),
        np.zeros((5, 6, 3), complex), np.array(["a"]), np.ones((5, 6, 3))[::-1], np.asfortranarray(np.ones((5, 6, 3))),
        {"square.translation": [1, 0, 0]}, {"square.translation": [np.inf, 0, 0]}, {"square": 1}, {1: 2},
        {"square.rotation": np.zeros((3, 1))}, ["square.translation"], scene, v3.traverse(scene), v3.Mesh([], []),
        {"m": v3.Mesh(np.zeros((3, 3)), [[0, 1, 7]])}, {"m": v3.Mesh(np.zeros((2, 2)), [[0, 1]])}, (3, 2), (0, 1),
        "edge", "rays", range(3), lambda *_: None,
    ]

    def some():
        return odd[rng.integers(len(odd))]

    def params(*_):
        fresh = v3.traverse(scene.copy())
        return fresh

    functions = [
        lambda: v3.render(some(), spp=some(), seed=some()),
        lambda: v3.render(scene, spp=2, seed=some()),
        lambda: v3.render(scene, spp=2, progress=some()),
        lambda: v3.forward(scene, some(), spp=2, method=some()),
        lambda: v3.forward(scene, {"square.translation": some()}, spp=2, step=some()),
        lambda: v3.reverse(scene, some(), some(), spp=2),
        lambda: v3.reverse(scene, ["square.translation"], some(), spp=2, seed=some()),
        lambda: v3.compare(some(), scene, some(), spp=2, runs=2),
        lambda: v3.check(some(), some(), spp=some()),
        lambda: v3.check(lit_square((3, 2)), {"square.translation": some()}, spp=1, steps=[0.1, 0.03], method="edge"),
        lambda: v3.check(lit_square((3, 2)), {"square.translation": [1, 0, 0]}, spp=1, method=some(), steps=some()),
        lambda: v3.lint(some()),
        lambda: v3.lint(scene, some()),
        lambda: v3.tune(some(), some(), seconds=some(), spp=1),
        lambda: v3.tune(scene, some(), seconds=0.01, seed=some()),
        lambda: v3.traverse(some()),
        lambda: params().update(some()),
        lambda: params().update({"square.vertex_positions": some()}),
        lambda: params().retract({"square.rotation": some()}),
        lambda: params().keep(some()),
        lambda: params()[some()],
        lambda: params().__setitem__(some(), some()),
        lambda: scene.seen(origin=some(), target=some(), up=some(), fov=some(), size=some()),
        lambda: scene.seen(origin=[0, 0, 4], target=some(), size=(4, 4)),
        lambda: scene.mesh(some()),
        lambda: v3.scene_from_arrays(some(), origin=some(), target=[0, 0, 0]),
        lambda: v3.scene_from_arrays(some(), origin=[0, 0, 2], target=[0, 0, 0], sky=some(), materials={"a": some()}),
        lambda: v3.load_string(some(), size=some()),
        lambda: v3.load_file(some()),
        lambda: v3.read_image(some()),
        lambda: v3.Scene(some()),
        lambda: v3.Fit(scene, some(), some(), steps=some()),
        lambda: v3.Fit(scene, ["square.translation"], [v3.View(some())], optimizer=some(), steps=2),
        lambda: v3.Fit(scene, ["square.translation"], [v3.View(np.ones((5, 6, 3)), camera=some())], steps=some()),
        lambda: v3.Views.from_nerf(some(), size=some(), background=some()),
        lambda: v3.Views.from_colmap(some(), some()),
        lambda: v3.Views.from_dtu(some(), cut=some()),
        lambda: v3.Views.from_mitsuba(some(), some(), variables=some()),
        lambda: v3.Views.look_at(some(), some(), up=some(), fov=some(), size=some(), pictures=some()),
        lambda: v3.Views(some())[some()],
        lambda: v3.Camera.look_at(some(), some(), fov=some()).intrinsics(some()),
        lambda: scene.seen(camera=some()),
    ]
    ordinary = (v3.Error, TypeError, ValueError, KeyError, IndexError, OverflowError, AttributeError)
    failed = 0
    for call in range(CALLS):
        function = functions[call % len(functions)]
        try:
            function()
        except v3.InternalError:
            raise
        except ordinary:
            failed += 1
    print(f"{failed} of {CALLS} calls raised")
    assert failed > CALLS // 4


def test_types_are_those_stated():
    pytest.importorskip("mypy")
    # The source: mypy refuses to check a folder of its own environment.
    source = Path(__file__).parent.parent / "python" / "volume3d"
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--no-incremental",
         "--exclude", r"(torch|jax)\.py$", str(source)],
        capture_output=True, text=True, check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_optional_packages_are_not_imported():
    code = "import sys, volume3d; print([m for m in ('torch', 'jax', 'tqdm', 'matplotlib') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
