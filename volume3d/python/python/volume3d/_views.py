"""Pictures with cameras."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Array, Path, colour, film_size, numbers, path, variables_of, vector
from ._camera import Camera, camera_of
from ._results import Rendering


@dataclass(frozen=True, eq=False)
class View:
    """A picture with its camera.

    The camera is `camera`, or at `origin` and looks at `target`. Without any it is the scene's own, which may
    then be fitted; that is for a single view.
    """

    #: The picture: linear RGB (height, width, 3), or a `Rendering`. None for a camera whose picture is rendered
    #: later: `Fit` needs one.
    picture: ArrayLike | Rendering | None
    #: Position of the camera (3,), in scene units.
    origin: ArrayLike | None = None
    #: A point at which it looks (3,).
    target: ArrayLike | None = None
    #: The direction that is up in the picture (3,).
    up: ArrayLike = (0.0, 1.0, 0.0)
    #: Horizontal field of view, in degrees.
    fov: float = 40.0
    #: Factor of the difference of each pixel and channel (height, width, 3).
    weights: ArrayLike | None = None
    #: Its name in messages.
    name: str = ""
    #: The camera, in the place of `origin`, `target`, `up` and `fov`.
    camera: Camera | None = None
    #: Where the object is seen: booleans (height, width). For your own use: `Fit` does not read it.
    mask: ArrayLike | None = None
    #: (width, height) of the picture, or of one that is to be rendered.
    size: tuple[int, int] | None = None

    def _camera(self, what: str) -> Camera | None:
        """The camera, if there is one; `what` names the view in messages."""
        if (self.origin is None) != (self.target is None):
            raise ValueError(f"{what}: a camera has both an origin and a target")
        if self.origin is None or self.target is None:
            return None if self.camera is None else camera_of(self.camera, f"{what}: the camera")
        if self.camera is not None:
            raise ValueError(f"{what}: give a camera, or an origin and a target, not both")
        return Camera.look_at(self.origin, self.target, up=self.up, fov=self.fov)


class Views(Sequence[View]):
    """Pictures with their cameras, for `Fit`.

    >>> views = v3.Views.from_nerf("lego/transforms_train.json", size=(100, 100), background=1)   # doctest: +SKIP
    >>> fit = v3.Fit(scene, ["block.translation"], views, views_per_step=4)                       # doctest: +SKIP

    =================  ================================================================================
    `from_nerf`        ``transforms.json`` of NeRF, instant-ngp and nerfstudio
    `from_colmap`      a COLMAP model, text or binary
    `from_dtu`         folders of DTU and IDR data, with masks
    `from_mitsuba`     the sensors of a Mitsuba scene
    `look_at`          cameras that look at points
    =================  ================================================================================

    Poses are those of the files. Lenses that distort are refused: undistort the pictures first, with
    ``colmap image_undistorter``. Pictures are read at once, and take 24 bytes a pixel; with `size` (width,
    height) each pixel is the mean over its area. `background` is what transparent pixels show: a number or
    linear RGB. Errors are `SceneError`, with the file and its line, frame or camera.
    """

    __slots__ = ("_list",)

    def __init__(self, views: Iterable[View]) -> None:
        self._list = tuple(views)
        for index, view in enumerate(self._list):
            if not isinstance(view, View):
                raise TypeError(f"view {index} must be a volume3d.View, not {type(view).__name__}")

    @classmethod
    def from_nerf(cls, file: Path, *, size: Sequence[int] | None = None, background: ArrayLike = 0.0) -> Views:
        """Views of ``transforms.json``; a camera's x is right, y up, and it looks along −z.

        Pictures are named from the folder of the file, with or without extension. Read are ``camera_angle_x``,
        ``camera_angle_y``, ``fl_x``, ``fl_y``, ``cx``, ``cy``, ``w`` and ``h``, of the file or of a frame, which
        takes precedence, and ``mask_path``, which becomes `weights`: its black pixels do not count.
        """
        core = _core.Views.from_nerf(path(file, "the file"), film_size(size))
        return cls(_loaded(core, background))

    @classmethod
    def from_colmap(
        cls,
        model: Path,
        images: Path | None = None,
        *,
        size: Sequence[int] | None = None,
        background: ArrayLike = 0.0,
    ) -> Views:
        """Views of a COLMAP model, sorted by the names of pictures; a camera's x is right, y down, and it looks
        along z.

        `model` is the folder of ``cameras.bin`` and ``images.bin``, or else ``cameras.txt`` and ``images.txt``.
        `images` is the folder of pictures: ``images`` in the folder of the model or in the nearest above it that
        has one, unless given. Cameras are SIMPLE_PINHOLE, PINHOLE, or a model whose distortion is 0.
        """
        folder = None if images is None else path(images, "the folder of images")
        core = _core.Views.from_colmap(path(model, "the model"), folder, film_size(size))
        return cls(_loaded(core, background))

    @classmethod
    def from_dtu(
        cls,
        folder: Path,
        *,
        cut: bool = False,
        size: Sequence[int] | None = None,
        background: ArrayLike = 0.0,
    ) -> Views:
        """Views of ``image/*.png``, ``mask/*.png`` and ``cameras.npz``, in coordinates of the data's unit ball.

        With `cut`, pixels outside of masks are the background.
        """
        views = _loaded(_core.Views.from_dtu(path(folder, "the folder"), film_size(size)), background)
        return cls([_cut(view, background) for view in views] if cut else views)

    @classmethod
    def from_mitsuba(
        cls,
        file: Path,
        pictures: Sequence[Path] | None = None,
        *,
        variables: Mapping[str, object] | None = None,
        size: Sequence[int] | None = None,
        background: ArrayLike = 0.0,
    ) -> Views:
        """Views of all sensors of a Mitsuba 3 XML file, in order; other objects of the scene are not read.

        `pictures` are their files, one each; without them the pictures are None, to be rendered. `variables` are
        values of the file's ``$name``s. Names are the ids of sensors.
        """
        source, values = path(file, "the file"), variables_of(variables)
        if pictures is not None:
            files = [path(picture, "a picture") for picture in pictures]
            core = _core.Views.from_mitsuba(source, values, files, film_size(size))
            return cls(_loaded(core, background))
        if size is not None:
            raise ValueError("size is that of pictures, and none are given")
        sensors = enumerate(_core.sensors(source, values))
        return cls(
            View(None, name=str(index) if name is None else name, camera=Camera(camera), size=pixels)
            for index, (name, camera, pixels) in sensors
        )

    @classmethod
    def look_at(
        cls,
        origins: ArrayLike,
        target: ArrayLike = (0.0, 0.0, 0.0),
        *,
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov: float = 40.0,
        size: Sequence[int] | None = None,
        pictures: Sequence[ArrayLike | Rendering] | None = None,
    ) -> Views:
        """Views of cameras at `origins` (n, 3) that look at `target` (3,).

        `up` (3,), and `fov` horizontal in degrees. `pictures` (height, width, 3), one each; without them they are
        None, and of `size` (width, height) when they are rendered.
        """
        points = numbers(origins, "origins")
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"origins must have the shape (n, 3), not {points.shape}")
        if pictures is not None and len(pictures) != len(points):
            raise ValueError(f"there are {len(points)} origins, but {len(pictures)} pictures")
        at, above, pixels = vector(target, "target"), vector(up, "up"), film_size(size)
        images = [None] * len(points) if pictures is None else pictures
        return cls(
            View(picture, name=str(index), camera=Camera.look_at(point, at, up=above, fov=fov), size=pixels)
            for index, (point, picture) in enumerate(zip(points, images, strict=True))
        )

    @overload
    def __getitem__(self, index: int) -> View: ...
    @overload
    def __getitem__(self, index: slice) -> Views: ...
    def __getitem__(self, index: int | slice) -> View | Views:
        return Views(self._list[index]) if isinstance(index, slice) else self._list[index]

    def __len__(self) -> int:
        return len(self._list)

    def __repr__(self) -> str:
        names = ", ".join(view.name for view in self._list[:3])
        return f"<volume3d.Views: {len(self)}: {names}{', ...' if len(self) > 3 else ''}>"


def _loaded(core: _core.Views, background: ArrayLike) -> list[View]:
    behind = colour(background, "the background")
    views = []
    for index, (name, camera, size) in enumerate(core.entries):
        picture, weights, mask = core.load(index, behind)
        views.append(View(picture, weights=weights, name=name, camera=Camera(camera), mask=mask, size=size))
    return views


def _cut(view: View, background: ArrayLike) -> View:
    mask: NDArray[np.bool_] = np.asarray(view.mask, bool)
    picture: Array = np.where(mask[..., None], np.asarray(view.picture), colour(background, "the background"))
    return replace(view, picture=picture)
