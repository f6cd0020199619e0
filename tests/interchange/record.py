"""Records what Mitsuba 3 finds of the scenes of this folder: python record.py [NAME …]

values.json has for every scene the mean of each block of 8 × 8 pixels of the image and, where the shape `thing` moves along x, of its derivative by
central differences of step STEP with common random numbers, each with its standard error from independent seeds.
"""

import json
import pathlib
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
HERE = pathlib.Path(__file__).parent
STEP = 0.02
RUNS, SPP = 16, 256
MOVING_RUNS, MOVING_SPP = 32, 256


def blocks(image):
    height, width, _ = image.shape
    rows, columns = -(-height // 8), -(-width // 8)
    return np.array([image[8 * r:8 * r + 8, 8 * c:8 * c + 8].mean((0, 1)) for r in range(rows) for c in range(columns)])


def render(path, x, spp, seed):
    scene = mi.load_file(str(path), x=str(x))
    return blocks(np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64)[..., :3])


def summary(runs):
    runs = np.array(runs)
    rounded = lambda a: [[float(f"{v:.5g}") for v in block] for block in a]
    return {"mean": rounded(runs.mean(0)), "error": rounded(runs.std(0, ddof=1) / np.sqrt(len(runs)))}


def record(path):
    found = {"image": summary([render(path, 0, SPP, seed) for seed in range(RUNS)])}
    if "$x" in path.read_text():
        seeds = range(1000, 1000 + MOVING_RUNS)
        slopes = [(render(path, STEP, MOVING_SPP, s) - render(path, -STEP, MOVING_SPP, s)) / (2 * STEP) for s in seeds]
        found["derivative"] = summary(slopes)
    return found


def main():
    file = HERE / "values.json"
    values = json.loads(file.read_text()) if file.exists() else {}
    values["renderer"] = f"Mitsuba {mi.__version__}, scalar_rgb"
    wanted = sys.argv[1:]
    for path in sorted((HERE / "scenes").glob("*.xml")):
        if not wanted or path.stem in wanted:
            try:
                values[path.stem] = record(path)
            except RuntimeError as error:
                values[path.stem] = {"refused": str(error).splitlines()[0]}
            print(path.stem, flush=True)
            file.write_text(json.dumps(values, indent=None, sort_keys=True) + "\n")


main()
