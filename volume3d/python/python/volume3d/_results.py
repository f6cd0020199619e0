"""Results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from . import _core
from ._arrays import Array, Path, path


class _Picture:
    """What NumPy and notebooks ask of an image."""

    def _pixels(self) -> Array:
        raise NotImplementedError

    @property
    def shape(self) -> tuple[int, ...]:
        """(height, width, 3)."""
        return self._pixels().shape

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        pixels = self._pixels()
        converted = pixels.astype(dtype, copy=False)
        return converted.copy() if copy and converted is pixels else converted

    def __dlpack__(self, **options: Any) -> Any:
        return self._pixels().__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        kind, index = self._pixels().__dlpack_device__()
        return int(kind), int(index)

    def save(self, file: Path) -> None:
        """Writes the pixels as .exr (linear, single precision) or .png (sRGB), by the name of the file.

        Files are written atomically. Raises `SceneError` if the file cannot be written, `ValueError` for
        other names.
        """
        _core.write_image(path(file, "the file"), self._pixels())


@dataclass(frozen=True, eq=False, repr=False)
class Rendering(_Picture):
    """An image with its standard error.

    It converts to an array (`numpy.asarray(rendering)`), and notebooks show it.
    """

    #: Linear RGB (height, width, 3).
    image: Array
    #: Standard error of each pixel. Pixels share noise: the error of a sum does not follow from these.
    stderr: Array
    #: (column, row, sample) of samples that were not finite; they are left out of the image.
    non_finite: list[tuple[int, int, int]]

    def _pixels(self) -> Array:
        return self.image

    def _repr_png_(self) -> bytes:
        return _core.png(self.image)

    def __repr__(self) -> str:
        height, width, _ = self.image.shape
        return f"<volume3d.Rendering {width} x {height}, mean {self.image.mean():.4g}>"


@dataclass(frozen=True, eq=False, repr=False)
class GradientImage(_Picture):
    """dI/dθ of every pixel, with its standard error.

    It converts to an array, and notebooks show it: blue is negative, white 0, red positive.
    """

    #: dI/dθ (height, width, 3).
    gradient: Array
    #: Standard error of each pixel's derivative. Pixels share noise: use `total_stderr` for the sum.
    stderr: Array
    #: The image (height, width, 3), from the same samples as the gradient.
    image: Array
    #: Standard error of the image.
    image_stderr: Array
    #: Sum of the gradient over all pixels, by channel (3,).
    total: Array
    #: Standard error of `total` (3,).
    total_stderr: Array
    #: The method that was used.
    method: str
    #: (column, row, sample) of samples that were not finite; they are left out.
    non_finite: list[tuple[int, int, int]]
    #: Sentences on what may be wrong with the result.
    warnings: list[str]

    def _pixels(self) -> Array:
        return self.gradient

    def _repr_png_(self) -> bytes:
        return _core.png(self.gradient, 0.0)

    def __repr__(self) -> str:
        height, width, _ = self.gradient.shape
        total, error = self.total.sum(), np.sqrt((self.total_stderr**2).sum())
        return f"<volume3d.GradientImage {width} x {height}, total {total:.4g} ± {error:.1g}>"


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Mapping[str, Array]):
    """Gradient of a number: a mapping from names of parameters to arrays."""

    _arrays: dict[str, Array]
    #: Standard errors by name, if several runs were asked for; otherwise empty.
    stderr: dict[str, Array] = field(default_factory=dict)
    #: The method that was used.
    method: str = ""
    #: (column, row, sample) of samples that were not finite; they are left out.
    non_finite: list[tuple[int, int, int]] = field(default_factory=list)
    #: Sentences on what may be wrong with the result.
    warnings: list[str] = field(default_factory=list)

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        parts = (f"{name}: {np.array2string(array, precision=4, threshold=6)}" for name, array in self.items())
        return "<volume3d.Gradient " + ", ".join(parts) + ">"
