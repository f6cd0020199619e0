"""Conversion of arguments."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
Path: TypeAlias = "str | os.PathLike[str]"

#: Greatest seed.
MAX_SEED = 2**64 - 1


def numbers(value: ArrayLike, what: str) -> Array:
    """`value` as an aligned array of float64 in C order; `what` names it in messages."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            raise ValueError(f"it holds {array.dtype}")
        return np.require(array, np.float64, ["C", "A"])
    except (TypeError, ValueError) as error:
        raise TypeError(f"{what} must be an array of real numbers: {error}") from None


def shaped(value: ArrayLike, shape: Sequence[int], what: str) -> Array:
    """`value` as an array of a shape."""
    array = numbers(value, what)
    if array.shape != tuple(shape):
        raise ValueError(f"{what} must have the shape {tuple(shape)}, not {array.shape}")
    return array


def colour(value: ArrayLike, what: str) -> tuple[float, float, float]:
    """One number for grey, or three."""
    array = numbers(value, what)
    if array.shape == ():
        array = np.full(3, array)
    if array.shape != (3,):
        raise ValueError(f"{what} must be a number or three numbers, not of shape {array.shape}")
    return float(array[0]), float(array[1]), float(array[2])


def vector(value: ArrayLike, what: str) -> tuple[float, float, float]:
    """Three numbers."""
    array = shaped(value, (3,), what)
    return float(array[0]), float(array[1]), float(array[2])


def count(value: Any, what: str, *, least: int = 1, most: int = 2**31 - 1) -> int:
    """An integer within bounds."""
    try:
        number = int(np.asarray(value).item())
        if number != value:
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{what} must be an integer, not {value!r}") from None
    if not least <= number <= most:
        raise ValueError(f"{what} must be from {least} to {most}, not {number}")
    return number


def film_size(value: Sequence[int] | None) -> tuple[int, int] | None:
    """Columns and rows."""
    if value is None:
        return None
    try:
        width, height = value
    except (TypeError, ValueError):
        raise TypeError(f"size must be (width, height), not {value!r}") from None
    return count(width, "the width", most=2**20), count(height, "the height", most=2**20)


def text(value: Any, what: str) -> str:
    """A string without surrogates."""
    if not isinstance(value, str):
        raise TypeError(f"{what} must be a string, not {type(value).__name__}")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{what} is not valid Unicode: {value!r}") from None
    return value


def path(value: Path, what: str) -> str:
    """The text of a path."""
    try:
        plain = os.fsdecode(value)
    except TypeError:
        raise TypeError(f"{what} must be a path, not {type(value).__name__}") from None
    return text(plain, what)


def variables_of(values: Mapping[str, object] | None) -> list[tuple[str, str]]:
    """Values of a scene file's variables, as text."""
    return [(text(name, "a variable"), str(value)) for name, value in (values or {}).items()]
