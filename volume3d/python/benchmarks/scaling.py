"""Strong scaling of a fit: milliseconds and bytes of a step, measured, and a model of them up to 1,000 workers.

    python volume3d/python/benchmarks/scaling.py

fits the vertices of a sphere of about 10,000 and 1,000,000 coordinates to 16 views of 128 x 128, and prints tables of
Markdown: wall time of a step, without an executor and with 1 and 2 processes of one thread each; the parts of a step, in
processor time of one thread, which hardly depends on what else the machine does; and the model. Wall times depend on
it: run the first part on a machine that is idle otherwise. The load is printed.
"""

import argparse
import math
import os
import pickle
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

import volume3d as v3

#: Views of a step, those of which the parts are measured, and the side of their pictures.
VIEWS, MEASURED, SIDE = 16, 4, 128

#: Assumed rate of the network card of the machine that takes the steps, bytes in a second: 10 Gbit/s.
NETWORK = 1.25e9

#: Workers of the model.
WORKERS = (1, 2, 4, 8, 16, 32, 64, 125, 250, 500, 1000)


def sphere(coordinates):
    """A sphere with about so many coordinates of vertices, from a grid of angles."""
    rows = round(math.sqrt(coordinates / 6))
    columns = 2 * rows
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    phi = np.arange(columns) / columns * 2 * np.pi
    t, p = np.meshgrid(theta, phi, indexing="ij")
    positions = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    faces = np.stack([a, b, b + columns, a, b + columns, a + columns], axis=-1).reshape(-1, 3)
    return v3.Mesh(positions, faces, material="clay", smooth=True)


def make_fit(coordinates, spp, *, count=VIEWS, steps=100):
    """A fit of the sphere's vertices to pictures of itself, as costly as one to pictures of another shape."""
    scene = v3.scene_from_arrays(
        {"shape": sphere(coordinates)}, origin=[0, 0, 4], target=[0, 0, 0], fov=40, size=(SIDE, SIDE), sky=1,
        materials={"clay": {"type": "diffuse", "reflectance": 0.6}}, max_depth=2,
    )
    angles = np.arange(count) / count * 2 * np.pi
    views = [
        v3.View(np.full((SIDE, SIDE, 3), 0.5), origin=[4 * np.sin(a), np.cos(5 * a), 4 * np.cos(a)],
                target=[0, 0, 0], fov=40)
        for a in angles
    ]
    return v3.Fit(
        scene, ["shape.vertex_positions"], views, optimizer=v3.Adam(1e-4), steps=steps, spp=spp, method="warped-area",
    )


def timed(work, clock=time.perf_counter):
    """Result and seconds."""
    start = clock()
    return work(), clock() - start


def processor(work):
    """Result and seconds of processor time."""
    return timed(work, time.process_time)


def parts(coordinates, spp):
    """Processor seconds and bytes of the parts of a step, in this process, with one thread."""
    fit = make_fit(coordinates, spp, count=MEASURED)
    core = fit._core
    worker = core.worker()
    tasks, ask = processor(core.ask)
    found = [processor(lambda task=task: worker.run(task)) for task in tasks]
    _, tell = processor(lambda: core.tell([part for part, _ in found]))
    return {
        "ask": ask, "tell": tell / MEASURED, "run": statistics.median(seconds for _, seconds in found),
        "task": len(pickle.dumps(tasks[0])), "part": len(pickle.dumps(found[0][0])),
        "scene": len(fit._shared.payload),
    }


def wall(coordinates, spp, workers, steps):
    """Seconds of a step, without an executor or with processes; the first step, which sends the scene, apart."""
    fit = make_fit(coordinates, spp, steps=steps + 1)
    if workers == 0:
        _, first = timed(fit.step)
        return first, timed(fit.run)[1] / steps
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as executor:
        list(executor.map(abs, range(4 * workers)))
        _, first = timed(lambda: fit.run(1, executor=executor))
        return first, timed(lambda: fit.run(executor=executor))[1] / steps


def model(found, fixed, workers):
    """Seconds of a step with `workers`, from the measured parts.

    V views in c chunks of n/c samples each are V c tasks, in rounds of as many as there are workers. A task takes
    f + (t - f)/c: preparations f, and samples. Serial are: asking, telling (in proportion to the tasks), and the
    bytes through the network card of the machine that takes the steps. There are as many chunks as workers of a view.
    """
    chunks = max(1, math.ceil(workers / VIEWS))
    tasks = VIEWS * chunks
    run = fixed + (found["run"] - fixed) / chunks
    serial = found["ask"] + tasks * found["tell"] + tasks * (found["task"] + found["part"]) / NETWORK
    return math.ceil(tasks / workers) * run + serial


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--coordinates", type=int, nargs="+", default=[10_000, 1_000_000])
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("--steps", type=int, default=3, help="steps of the first table; 0 leaves it out")
    options = parser.parse_args()
    v3.set_num_threads(1)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; {VIEWS} views of {SIDE} x {SIDE}, {options.spp} spp\n")
    if options.steps:
        print("| coordinates | workers | first step, s | step, ms | speed-up |\n|---|---|---|---|---|")
    for coordinates in options.coordinates if options.steps else []:
        alone = None
        for workers in (0, 1, 2):
            first, each = wall(coordinates, options.spp, workers, options.steps)
            alone = alone or each
            name = workers or "none"
            print(f"| {coordinates:.0e} | {name} | {first:.2f} | {1e3 * each:.0f} | {alone / each:.2f} |", flush=True)
    print("\n| coordinates | ask, ms | view, ms | of it fixed, ms | tell a part, ms | task, bytes | part, bytes | scene, bytes |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for coordinates in options.coordinates:
        found, twice = parts(coordinates, options.spp), parts(coordinates, 2 * options.spp)
        fixed = min(found["run"], max(0.0, 2 * found["run"] - twice["run"]))
        times = [1e3 * x for x in (found["ask"], found["run"], fixed, found["tell"])]
        sizes = [found[key] for key in ("task", "part", "scene")]
        print(f"| {coordinates:.0e} | " + " | ".join(f"{x:.1f}" for x in times) + " | "
              + " | ".join(f"{x:,}" for x in sizes) + " |", flush=True)
        rows.append((coordinates, found, fixed))
    print("\nModel: milliseconds of a step (efficiency)\n")
    print("| coordinates | " + " | ".join(map(str, WORKERS)) + " |\n|" + "---|" * (len(WORKERS) + 1))
    for coordinates, found, fixed in rows:
        times = [model(found, fixed, workers) for workers in WORKERS]
        cells = [f"{1e3 * t:.0f} ({100 * times[0] / t / w:.0f} %)" for t, w in zip(times, WORKERS, strict=True)]
        print(f"| {coordinates:.0e} | " + " | ".join(cells) + " |")
        every = range(1, 1001)
        curve = [model(found, fixed, workers) for workers in every]
        best = min(every, key=lambda w: curve[w - 1])
        half = max(w for w in every if curve[0] / curve[w - 1] / w >= 0.5)
        print(f"  {coordinates:.0e}: half of the workers' time is used up to {half} workers; the shortest step is with {best}",
              file=sys.stderr)


if __name__ == "__main__":
    main()
