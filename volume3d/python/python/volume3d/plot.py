"""Pictures of images and gradient images, by Matplotlib.

>>> from volume3d.plot import show, show_gradient                   # doctest: +SKIP
>>> show(v3.render(scene, spp=64))                                  # doctest: +SKIP
>>> show_gradient(v3.forward(scene, change))                        # doctest: +SKIP

``pip install "./volume3d/python[plot]"`` installs Matplotlib, which is imported at the first call.
"""

from __future__ import annotations

import functools
import io
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Array, numbers
from ._results import GradientImage, Rendering

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["WITHIN", "scale", "show", "show_gradient"]

#: Fraction of the pixels that are not 0 within the range of colours, unless a range is given.
WITHIN = 0.995

#: Entries of the table of colours: an odd number, so that 0 is exactly white.
_ENTRIES = 257


def show(image: ArrayLike | Rendering, *, title: str = "", axes: Axes | None = None) -> Axes:
    """Shows an image (height, width, 3) of linear RGB as sRGB, and returns its axes.

    `axes` are those to draw in; a new figure otherwise. Values beyond 1 are shown as 1. Raises `ImportError`
    without Matplotlib, `ValueError` for another shape.
    """
    drawn = _axes(axes)
    drawn.imshow(_decoded(_core.png(_pixels(image))), interpolation="nearest")
    return _finished(drawn, title)


def show_gradient(
    gradient: ArrayLike | GradientImage,
    *,
    title: str = "",
    limit: float | None = None,
    label: str = "dI/dθ",
    axes: Axes | None = None,
) -> Axes:
    """Shows dI/dθ, or any other signed image, with a colour bar called `label`, and returns the axes.

    An array (height, width, 3), of which the mean over the channels is shown, or (height, width). Blue is negative,
    white 0, red positive, yellow not a number.
    The scale is from -`limit` to `limit`, in units of the gradient, and values beyond are clipped. Without
    `limit` it is `scale` of the gradient, as the colour bar then says. Give several pictures the same one to
    compare them. `axes` are those to draw in; a new figure otherwise.

    Raises `ImportError` without Matplotlib, `ValueError` for another shape or a `limit` that is not positive.
    """
    drawn = _axes(axes)
    values = _means(gradient)
    chosen = limit is None
    bound = scale(values) if limit is None else float(numbers(limit, "the limit"))
    if not chosen and not (bound > 0 and math.isfinite(bound)):
        raise ValueError(f"the limit must be positive and finite, not {bound}")
    # A gradient that is 0 everywhere is white on any scale.
    bound = bound or 1.0
    picture = drawn.imshow(values, cmap=_colours(), vmin=-bound, vmax=bound, interpolation="nearest")
    bar = drawn.figure.colorbar(picture, ax=drawn, extend="both", fraction=0.046, pad=0.04)
    bar.set_label(f"{label}, {100 * WITHIN:g} % within the scale" if chosen else label)
    return _finished(drawn, title)


def scale(*gradients: ArrayLike | GradientImage) -> float:
    """A bound for `show_gradient`: of the pixels of all `gradients` whose mean over the channels is finite and
    not 0, `WITHIN` lie within ± it. 0 if there are none.
    """
    means = np.concatenate([np.abs(_means(gradient)).ravel() for gradient in gradients])
    sizes = np.sort(means[np.isfinite(means) & (means != 0)])
    return float(sizes[math.ceil(WITHIN * len(sizes)) - 1]) if len(sizes) else 0.0


def _pixels(image: ArrayLike | Rendering | GradientImage) -> Array:
    array = numbers(np.asarray(image), "the image")
    if array.ndim != 3 or array.shape[2] != 3:
        raise ValueError(f"an image must have the shape (height, width, 3), not {array.shape}")
    return array


def _means(gradient: ArrayLike | GradientImage) -> Array:
    array = numbers(np.asarray(gradient), "the gradient")
    return array if array.ndim == 2 else _pixels(array).mean(axis=2)


def _axes(axes: Axes | None) -> Any:
    if axes is not None:
        return axes
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError('pictures need Matplotlib: pip install "matplotlib>=3.7"') from error
    return plt.subplots()[1]


def _finished(axes: Axes, title: str) -> Axes:
    axes.set_title(title)
    axes.set_axis_off()
    return axes


def _decoded(png: bytes) -> NDArray[Any]:
    from matplotlib.image import imread

    return np.asarray(imread(io.BytesIO(png), format="png"))[..., :3]


@functools.cache
def _colours() -> Any:
    """The colours of signed PNG files."""
    from matplotlib.colors import ListedColormap

    def of(values: ArrayLike) -> NDArray[Any]:
        row = np.asarray(values, dtype=np.float64)[None, :, None]
        colours: NDArray[Any] = _decoded(_core.png(np.repeat(row, 3, axis=2).copy(), 1.0))[0]
        return colours

    table = ListedColormap(of(np.linspace(-1, 1, _ENTRIES)), name="volume3d-signed")
    return table.with_extremes(bad=tuple(of([math.nan])[0]))
