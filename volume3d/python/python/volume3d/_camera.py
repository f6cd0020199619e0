"""Cameras."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Array, film_size, numbers, vector
from ._core import SceneError


class Camera:
    """A camera: position, axes, focal lengths and principal point, without the number of pixels.

    Made by `Camera.look_at` and the readers of `Views`; `Scene.camera` is the one of a scene. For
    `Scene.seen` and `View`.
    """

    __slots__ = ("_core",)

    def __init__(self, core: _core.Camera) -> None:
        if not isinstance(core, _core.Camera):
            raise TypeError("cameras are made by Camera.look_at and the readers of Views")
        self._core = core

    @classmethod
    def look_at(
        cls, origin: ArrayLike, target: ArrayLike, *, up: ArrayLike = (0.0, 1.0, 0.0), fov: float = 40.0
    ) -> Camera:
        """A camera at `origin` that looks at `target`.

        `origin`, `target` and `up` (3,) in scene units; `fov` horizontal, in degrees. Raises `SceneError` if
        `up` is along the view, the points are equal, or `fov` is not between 0 and 180.
        """
        angle = float(numbers(fov, "fov"))
        if not 0 < angle < 180:
            raise SceneError(f"fov must be between 0 and 180 degrees, not {angle}")
        return cls(_core.Camera.look_at(vector(origin, "origin"), vector(target, "target"), vector(up, "up"), angle))

    @property
    def origin(self) -> Array:
        """Position (3,), in scene units."""
        return np.array(self._core.frame[0])

    @property
    def right(self) -> Array:
        """Unit vector (3,) to the right in the picture."""
        return np.array(self._core.frame[1])

    @property
    def up(self) -> Array:
        """Unit vector (3,) up in the picture."""
        return np.array(self._core.frame[2])

    @property
    def forward(self) -> Array:
        """Unit vector (3,) into the scene."""
        return np.array(self._core.frame[3])

    @property
    def fov(self) -> float:
        """Horizontal field of view in degrees, for a principal point in the middle."""
        return math.degrees(self._core.frame[4])

    def intrinsics(self, size: Sequence[int]) -> Array:
        """K (3, 3) in pixels on a film of `size` (width, height).

        A point x of the world is seen at (u, v) = (p0/p2, p1/p2), p = K (R x + t), with [R | t] the
        `extrinsics`: u from the left and v from the top border of the picture, so that the middle of the first
        pixel is at (½, ½). Raises `SceneError` for thin lenses and orthographic sensors.
        """
        _, _, (fx, fy), (cx, cy) = self._core.calibration(_whole(size))
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])

    @property
    def extrinsics(self) -> Array:
        """[R | t] (3, 4): coordinates of the world to those of the camera, x right, y down, z into the scene."""
        rotation, center, _, _ = self._core.calibration((1, 1))
        turn = np.array(rotation)
        return np.column_stack([turn, -turn @ np.array(center)])

    def __repr__(self) -> str:
        x, y, z = self.origin
        return f"<volume3d.Camera at ({x:.6g}, {y:.6g}, {z:.6g}), fov {self.fov:.6g} degrees>"


def camera_of(value: object, what: str) -> Camera:
    """`value` if it is a camera; `what` names it in messages."""
    if not isinstance(value, Camera):
        raise TypeError(f"{what} must be a volume3d.Camera, not {type(value).__name__}")
    return value


def _whole(size: Sequence[int]) -> tuple[int, int]:
    film = film_size(size)
    if film is None:
        raise TypeError("size must be (width, height)")
    return film
