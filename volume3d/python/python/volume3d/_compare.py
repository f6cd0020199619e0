"""Comparison of somebody else's gradient with ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Array, count, numbers
from ._estimate import Progress, _run_seed, forward
from ._scene import Scene

#: Side of the blocks of a comparison, in pixels.
BLOCK = 8


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """How a gradient image differs from ours.

    Both are reduced to one number, the weighted sum of their pixels. The weights are a third, independent
    estimate of the gradient, between -1 and 1, so that parts of opposite sign do not cancel. Notebooks show the
    difference by blocks in standard errors: blue is too small, red too large.
    """

    #: Their weighted sum divided by ours: 1 if both agree.
    slope: float
    #: Standard error of `slope`.
    slope_stderr: float
    #: (theirs - ours) in standard errors. Beyond ±4, chance is an unlikely explanation.
    z: float
    #: Our gradient, the mean of all runs (height, width, 3).
    ours: Array
    #: Their gradient, the mean of all images (height, width, 3).
    theirs: Array
    #: (theirs - ours) of each block of 8 x 8 pixels, all channels, in standard errors (rows, columns).
    blocks: Array
    #: Whether the noise of their gradient is included, which takes at least two images of theirs.
    includes_their_noise: bool

    def _repr_png_(self) -> bytes:
        height, width, _ = self.ours.shape
        large = np.kron(np.nan_to_num(self.blocks), np.ones((BLOCK, BLOCK)))[:height, :width]
        return _core.png(np.repeat(large[:, :, None], 3, axis=2).copy(), 5.0)

    def __repr__(self) -> str:
        note = "" if self.includes_their_noise else ", without the noise of theirs"
        return f"<volume3d.Comparison: slope {self.slope:.4f} ± {self.slope_stderr:.4f}, z {self.z:.1f}{note}>"


def compare(
    gradient: ArrayLike,
    scene: Scene,
    change: Mapping[str, ArrayLike],
    *,
    spp: int = 64,
    runs: int = 16,
    seed: int = 0,
    method: str = "auto",
    progress: Progress = None,
) -> Comparison:
    """By how many standard errors, and by what slope, a gradient image differs from ours.

    `gradient` is dI/dθ along `change` by another renderer: one image (height, width, 3), or several independent
    ones (n, height, width, 3), whose spread is then counted as their noise. Ours is the mean of `runs` runs of
    `spp` samples each, whose spread is the standard error.

    The scene must be the same in both: film, filter, units of `change`, and an image that agrees, too.

    Raises `ValueError` for a wrong shape, and what `forward` raises.
    """
    theirs = numbers(gradient, "the gradient")
    theirs = theirs[None] if theirs.ndim == 3 else theirs
    if theirs.shape[1:] != scene.shape or not len(theirs):
        shape = scene.shape
        wanted = f"{shape} or (n, {shape[0]}, {shape[1]}, 3)"
        raise ValueError(f"the gradient must have the shape {wanted}, not {np.shape(gradient)}")
    if not np.isfinite(theirs).all():
        raise ValueError("the gradient must be finite")
    count(runs, "runs", least=2)

    def estimate(run: int) -> Array:
        found = forward(scene, change, seed=_run_seed(seed, run), spp=spp, method=method, progress=progress)
        return found.gradient

    weights = _weights(estimate(runs))
    ours = np.stack([estimate(run) for run in range(runs)])
    (t, t_error), (o, o_error) = (_mean((images * weights).sum(axis=(1, 2, 3))) for images in (theirs, ours))
    error = float(np.hypot(t_error, o_error))
    slope = t / o if o else np.nan
    slope_stderr = float(np.hypot(t_error, slope * o_error) / abs(o)) if o else np.inf
    blocks_of = [np.stack([_block_sums(image) for image in images]) for images in (theirs, ours)]
    (theirs_by_block, theirs_errors), (ours_by_block, ours_errors) = (_mean(blocks) for blocks in blocks_of)
    with np.errstate(divide="ignore", invalid="ignore"):
        blocks = (theirs_by_block - ours_by_block) / np.hypot(theirs_errors, ours_errors)
    difference = t - o
    z = difference / error if difference else 0.0
    return Comparison(
        float(slope), slope_stderr, float(z), ours.mean(axis=0), theirs.mean(axis=0), blocks, len(theirs) > 1
    )


def _weights(gradient: Array) -> Array:
    """In units of the root mean square, clipped to ±1."""
    size = np.sqrt(np.mean(gradient**2))
    return np.clip(gradient / size, -1.0, 1.0) if size > 0 else np.ones_like(gradient)


def _mean(values: Array) -> tuple[Array, Array]:
    """Mean over the first axis, and its standard error; 0 for a single value."""
    n = len(values)
    error = values.std(axis=0, ddof=1) / np.sqrt(n) if n > 1 else np.zeros(values.shape[1:])
    return values.mean(axis=0), error


def _block_sums(image: Array) -> Array:
    rows, columns = (range(0, n, BLOCK) for n in image.shape[:2])
    return np.array([[image[y : y + BLOCK, x : x + BLOCK].sum() for x in columns] for y in rows])

