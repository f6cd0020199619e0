"""Fits and derivatives in other threads, processes and machines."""

import itertools
import os
import pickle
import random
import shutil
import signal
import threading
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import volume3d as v3
from conftest import HALVES, SQUARE, lit_square
from volume3d import _executor

NAMES = ["square.translation", "square.rotation", "paint.reflectance"]
VIEWS = [{"origin": [x, 0.3, 4], "target": [0, 0, 0], "fov": 30} for x in (-1.0, 0.0, 1.0)]

#: Processes killed in the test of dying workers.
KILLS = 20 if os.environ.get("WARPED_AREA_TESTS") == "thorough" else 1


def fit(**options):
    truth = lit_square()
    views = [v3.View(v3.render(truth.seen(**view), spp=16, seed=4), **view) for view in VIEWS]
    scene = lit_square()
    v3.traverse(scene).update({"square.translation": [0.15, -0.1, 0], "square.rotation": [0, 0, 0.3]})
    settings = {"optimizer": v3.Adam(0.03), "steps": 4, "spp": 2, "levels": 3, "views_per_step": 2, **options}
    return v3.Fit(scene, NAMES, views, **settings)


def same(first, second):
    assert first.steps_taken == second.steps_taken
    assert np.array_equal(first.losses, second.losses)
    for name in NAMES:
        assert np.array_equal(first.values[name], second.values[name]), name


def processes(count):
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


class Backwards:
    """Runs what was submitted within a tenth of a second in threads, the last first, and notes the order."""

    def __init__(self):
        self.tasks, self.order, self.lock = [], [], threading.Lock()
        self.count = itertools.count()

    def submit(self, fn, /, *args):
        future = Future()
        self.tasks.append((next(self.count), future, fn, args))
        threading.Timer(0.1, self._run).start()
        return future

    def _run(self):
        with self.lock:
            index, future, fn, args = self.tasks.pop()
            try:
                result = fn(*args)
            except BaseException as error:
                future.set_exception(error)
                raise
            self.order.append(index)
            future.set_result(result)


class Counted:
    """An executor, and the sizes of what it was sent with each task: the worker and the task itself."""

    def __init__(self, executor):
        self.executor, self.workers, self.tasks = executor, [], []

    def submit(self, fn, /, *args):
        *_, payload, task = args
        self.tasks.append(len(pickle.dumps(task)))
        if payload is not None:
            self.workers.append(len(payload))
        return self.executor.submit(fn, *args)


class Dropping(ThreadPoolExecutor):
    """Threads that drop every task a few times."""

    def __init__(self, times):
        super().__init__(2)
        self.times, self.seen = times, {}

    def submit(self, fn, /, *args):
        task = args[-1]
        self.seen[task] = self.seen.get(task, 0) + 1
        if self.seen[task] <= self.times:
            dropped = Future()
            dropped.set_exception(CancelledError("dropped"))
            return dropped
        return super().submit(fn, *args)


@pytest.fixture(scope="module")
def whole():
    """Fits without an executor, by the number of chunks."""
    return {chunks: fit(chunks=chunks).run() for chunks in (1, 3)}


@pytest.mark.parametrize("chunks", [1, 3])
def test_threads_in_any_order_give_the_same_bits(whole, chunks):
    executor = Backwards()
    same(fit(chunks=chunks).run(executor=executor), whole[chunks])
    assert executor.order != sorted(executor.order), "they ran in the order in which they were submitted"
    with ThreadPoolExecutor(4) as several:
        same(fit(chunks=chunks).run(executor=several), whole[chunks])
    assert not np.array_equal(whole[1].losses, whole[3].losses)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_processes_give_the_same_bits_and_are_sent_the_scene_once(whole, count):
    with processes(count) as executor:
        counted = Counted(executor)
        for chunks in (1, 3):
            same(fit(chunks=chunks).run(executor=counted), whole[chunks])
    # Once to each process for each of the two fits; a process that is busy may let another take both.
    assert 2 <= len(counted.workers) <= 2 * count + (count > 1) * 2
    if count == 1:
        assert len(counted.workers) == 2
    # The nine numbers, and with several chunks the adjoint image: no pictures or scenes.
    assert max(counted.tasks) < 24 * 24 * 20 + 500 and min(counted.tasks) < 500


def test_reverse_runs_are_tasks():
    scene = lit_square().seen(**VIEWS[0])
    adjoint = np.random.default_rng(1).normal(size=scene.shape)
    with processes(2) as executor:
        for moved in (0.1, 0.2):
            v3.traverse(scene).update({"square.translation": [moved, 0, 0], "lamp.translation": [0, moved, 0]})
            counted, progress = Counted(executor), []
            here = v3.reverse(scene, NAMES, adjoint, spp=2, runs=4, seed=5)
            there = v3.reverse(
                scene, NAMES, adjoint, spp=2, runs=4, seed=5, executor=counted,
                progress=lambda done, total: progress.append((done, total)),
            )
            for name in NAMES:
                assert np.array_equal(here[name], there[name])
                assert np.array_equal(here.stderr[name], there.stderr[name])
            assert progress[-1] == (4, 4)
            # The second time the scene is known.
            assert bool(counted.workers) == (moved == 0.1)


def test_dropped_tasks_are_submitted_again_within_bounds(whole):
    with Dropping(2) as executor:
        same(fit().run(executor=executor), whole[1])
    with Dropping(100) as executor, pytest.raises(v3.FitError, match="given up.*dropped"):
        fit().run(executor=executor)
    with Dropping(100) as executor, pytest.raises(v3.GradientError, match="given up.*dropped"):
        v3.reverse(lit_square(), NAMES, np.ones((20, 24, 3)), executor=Unhashed(executor))


class Unhashed:
    """Arguments of `reverse` for `Dropping`, which needs tasks that can be hashed."""

    def __init__(self, executor):
        self.executor = executor

    def submit(self, fn, /, *args):
        return self.executor.submit(fn, *args[:-1], str(args[-1]))


def test_a_fit_goes_on_after_its_pool_broke(whole):
    broken = fit()
    with processes(2) as executor:
        def kill(done, _total):
            if done == 2:
                os.kill(next(iter(executor._processes)), signal.SIGKILL)

        with pytest.raises(v3.FitError, match="no more tasks.*BrokenProcessPool"):
            broken.run(executor=executor, progress=kill)
    assert broken.steps_taken == 2
    resumed = fit()
    resumed.resume(broken.state())
    with processes(1) as executor:
        same(resumed.run(executor=executor), whole[1])
        same(broken.run(executor=executor), whole[1])
    with pytest.raises(v3.FitError, match="no more tasks"):
        fit().run(executor=executor)


@pytest.mark.parametrize(
    ("options", "differs"),
    [
        ({"seed": 1}, "its method"),
        ({"spp": 3, "image_spp": 2}, "its method"),
        ({"method": "edge"}, "its method"),
        ({"image_spp": 3}, "its view `0`"),
        ({"loss": "l1"}, "its view `0`"),
    ],
)
def test_a_worker_of_another_fit_is_refused(options, differs):
    (task, *_), worker = fit()._core.ask(), fit(**options)._core.worker()
    with pytest.raises(v3.FitError, match=f"another fit: {differs}"):
        worker.run(task)


def test_a_worker_with_another_scene_or_damaged_tasks_is_refused():
    own, moved = fit(), lit_square()
    (task, *_) = own._core.ask()
    v3.traverse(moved).update({"square.translation": [0.15, -0.1, 1e-9], "square.rotation": [0, 0, 0.3]})
    truth = lit_square()
    views = [v3.View(v3.render(truth.seen(**view), spp=16, seed=4), **view) for view in VIEWS]
    other = v3.Fit(moved, NAMES, views, spp=2, levels=3, views_per_step=2)
    with pytest.raises(v3.FitError, match="another fit: its scene"):
        other._core.worker().run(task)
    with pytest.raises(v3.FitError, match="damaged"):
        own._core.worker().run(task[:-9])
    part = own._core.worker().run(task)
    with pytest.raises(v3.FitError, match="missing"):
        own._core.tell([part])
    with pytest.raises(v3.FitError, match="damaged"):
        own._core.tell([part[:-9]])


def test_an_error_of_a_task_is_that_without_an_executor():
    bad = np.ones((20, 24, 3))
    bad[3, 5, 1] = np.nan
    with processes(1) as executor, pytest.raises(v3.GradientError, match="5"):
        v3.reverse(lit_square(), NAMES, bad, executor=executor)
    with pytest.raises(TypeError, match="executor"):
        fit().run(executor="dask")


def test_another_version_is_refused(monkeypatch):
    with processes(1) as executor:
        monkeypatch.setattr(_executor, "__version__", "0.0.1")
        with pytest.raises(v3.FitError, match=rf"has volume3d {v3.__version__}.*0\.0\.1"):
            fit().run(executor=executor)


def test_threads_of_processes_are_limited():
    with processes(1) as executor:
        for threads, expected in ((1, 1), (2, 2), (None, 2)):
            v3.reverse(lit_square(), NAMES, np.ones((20, 24, 3)), spp=1, executor=executor, threads=threads)
            assert executor.submit(v3.num_threads).result() == expected


def cluster():
    distributed = pytest.importorskip("distributed")
    return distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )


def test_dask_gives_the_same_bits_though_workers_are_killed(whole):
    with cluster() as local, local.get_client() as client:
        same(fit(chunks=3).run(executor=client.get_executor()), whole[3])
        expected = fit(steps=3 * KILLS + 6).run()
        victim, killed, ended = fit(steps=3 * KILLS + 6), [], threading.Event()

        def kill():
            moments = random.Random(1)
            while len(killed) < KILLS and not ended.wait(moments.uniform(0.2, 1.0)):
                pids = list(client.run(os.getpid, on_error="ignore").values())
                if pids:
                    killed.append(moments.choice(pids))
                    os.kill(killed[-1], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        try:
            # Repeated until all kills have happened: a fit may be too quick for them.
            while len(killed) < KILLS:
                victim = fit(steps=3 * KILLS + 6).run(executor=client.get_executor())
        finally:
            ended.set()
            killer.join()
        print(f"{len(killed)} processes were killed")
        same(victim, expected)


def test_a_scheduler_that_ends_leaves_a_fit_that_goes_on(whole):
    victim = fit()
    with cluster() as local, local.get_client() as client:
        def end(done, _total):
            if done == 2:
                local.close()

        with pytest.raises(v3.FitError):
            victim.run(executor=client.get_executor(), progress=end)
    assert victim.steps_taken == 2
    same(victim.run(), whole[1])


def renderings(scene):
    return v3.render(scene, spp=4, seed=3).image, v3.reverse(scene, ["camera.translation"], np.ones(scene.shape), spp=2)


def value(scene, name):
    try:
        return v3.traverse(scene)[name]
    except v3.ParameterError as error:
        # A scene of which single objects were moved has no pose of all objects.
        assert name.startswith("all.") and "both move" in str(error)
        return str(error)


def agree(first, second):
    assert first.names == second.names and first.notes == second.notes and first.shape == second.shape
    for name in first.names:
        assert np.array_equal(value(first, name), value(second, name)), name
    (image, gradient), (other, its) = renderings(first), renderings(second)
    assert np.array_equal(image, other)
    assert np.array_equal(gradient["camera.translation"], its["camera.translation"])


def textured():
    positions = np.random.default_rng(2).normal(size=(12, 3)) * 0.3
    triangles = np.arange(12).reshape(4, 3)
    texels = np.random.default_rng(0).uniform(0.1, 0.9, (4, 4, 3))
    uvs = (SQUARE[:, :2] + 1) / 2
    scene = v3.scene_from_arrays(
        {
            "square": v3.Mesh(SQUARE, HALVES, material="paint", uvs=uvs),
            "shards": v3.Mesh(positions, triangles, material="steel", smooth=True),
            "lamp": v3.Mesh(SQUARE * [0.2, -0.2, 1] + [0.5, 0, 2], HALVES[:, ::-1], radiance=[4, 5, 6]),
        },
        origin=[0, 0, 4], target=[0, 0, 0], size=(16, 12), sky=1,
        materials={
            "paint": {"type": "diffuse", "reflectance": texels},
            "steel": {"type": "metal", "reflectance": 0.8, "alpha": 0.3},
        },
    )
    positions += 1
    texels[:] = 0
    return scene


MOVES = [
    {"square.translation": [0.1, 0.2, 0]},
    {"shards.rotation": [0.1, 0.5, 2], "camera.translation": [0.1, 0, 0]},
    {"square.translation": [0, 0.3, 0.1], "square.rotation": [0, 0.4, 0]},
]


def test_scenes_from_arrays_are_pickled():
    scene = textured()
    agree(scene, pickle.loads(pickle.dumps(scene)))
    for move in MOVES:
        v3.traverse(scene).update(move)
        agree(scene, pickle.loads(pickle.dumps(scene)))
    other = scene.seen(origin=[1, 1, 4], target=[0, 0, 0], fov=20, size=(10, 6))
    agree(other, pickle.loads(pickle.dumps(other)))
    smaller = scene.seen(size=(10, 6))
    agree(smaller, pickle.loads(pickle.dumps(smaller)))


def test_another_camera_does_not_have_what_was_assigned_to_the_first(scene):
    view = {"origin": [1, 1, 4], "target": [0, 0, 0]}
    expected = v3.render(scene.seen(**view), spp=4, seed=3).image
    v3.traverse(scene).update({"camera.translation": [0.5, 0, 0]})
    other = scene.seen(**view)
    assert not v3.traverse(other)["camera.translation"].any()
    v3.traverse(other).update({"lamp.translation": [0, 0, 0]})
    assert np.array_equal(v3.render(other, spp=4, seed=3).image, expected)


def test_scenes_from_files_are_pickled_with_their_files(tmp_path):
    folder = tmp_path / "scene"
    folder.mkdir()
    textured().write(folder / "scene.xml")
    assert len(list(folder.iterdir())) > 1, "there are meshes or textures beside it"
    text = (folder / "scene.xml").read_text()
    scenes = [v3.load_file(folder / "scene.xml", size=(20, 10)), v3.load_string(text, folder=folder)]
    shutil.rmtree(folder)
    for scene in scenes:
        for move in MOVES:
            v3.traverse(scene).update(move)
        pickled = pickle.dumps(scene)
        agree(scene, pickle.loads(pickled))
        # What was unpickled can be pickled again.
        agree(scene, pickle.loads(pickle.dumps(pickle.loads(pickled))))


def test_scenes_of_another_version_are_refused(monkeypatch):
    monkeypatch.setattr("volume3d._core.__version__", "0.0.1")
    pickled = pickle.dumps(lit_square())
    monkeypatch.undo()
    with pytest.raises(v3.SceneError, match=rf"0\.0\.1.*{v3.__version__}"):
        pickle.loads(pickled)
