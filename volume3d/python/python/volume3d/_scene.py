"""Scenes."""

from __future__ import annotations

import functools
import hashlib
import math
import pickle
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Array, Path, colour, count, film_size, numbers, path, text, variables_of
from ._camera import Camera, camera_of
from ._core import SceneError


class Scene:
    """A scene: camera, film, shapes, materials and lights.

    Made by `load_file`, `load_string` or `scene_from_arrays`. `Parameters.update` changes it.
    """

    __slots__ = ("_core", "_notes", "_recipe", "_rest", "_values", "_view")

    def __init__(self, core: _core.Scene, recipe: Recipe, notes: Sequence[str] = ()) -> None:
        if not isinstance(core, _core.Scene):
            raise TypeError("scenes are made by load_file, load_string and scene_from_arrays")
        self._core = core
        #: How to make it again, and the camera and the size that `seen` gave it.
        self._recipe = recipe
        self._view: tuple[_core.Camera | None, tuple[int, int] | None] = None, None
        self._notes = tuple(notes)
        #: The scene as it was made, to which poses are relative, and all values assigned since.
        self._rest = core
        self._values: dict[str, Array] = {}

    def _select(self, names: Sequence[str]) -> Selection:
        """Parameters with these names, followed by all others that were assigned: a pose depends on all of
        its parameters."""
        others = [name for name in self._values if name not in names]
        core = _core.Parameters(self._rest, [*names, *others])
        groups = core.groups(self._rest)
        rest, end, flat = core.values(self._rest), 0, []
        for name, shape, _, _ in groups:
            begin, end = end, end + math.prod(shape)
            flat.append(self._values[name].ravel() if name in self._values else rest[begin:end])
        return Selection(core, groups[: len(names)], np.concatenate(flat) if flat else rest)

    def _updated(self, values: dict[str, Array]) -> Scene:
        """The scene with other values; itself unchanged."""
        scene = self.copy()
        scene._values = {**self._values, **values}
        selection = scene._select(list(scene._values))
        scene._core = selection.core.apply(self._core, selection.x)
        return scene

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of its images: (height, width, 3)."""
        width, height = self._core.size
        return height, width, 3

    @property
    def notes(self) -> tuple[str, ...]:
        """What the file's reader replaced or left out, one sentence each."""
        return self._notes

    @property
    def names(self) -> list[str]:
        """Names of all parameters; see `traverse`."""
        return self._core.parameter_names()

    def mesh(self, name: str) -> Mesh:
        """The mesh of a shape, as it is now.

        Raises `KeyError` if there is no mesh of that name.
        """
        positions, triangles = self._core.mesh(text(name, "the name"))
        return Mesh(positions, triangles)

    @property
    def camera(self) -> Camera:
        """Its camera, as it is now."""
        return Camera(self._core.camera)

    def seen(
        self,
        *,
        origin: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov: float = 40.0,
        camera: Camera | None = None,
        size: Sequence[int] | None = None,
    ) -> Scene:
        """The same scene through another camera, or on a film of another size. It is cheap.

        `camera`, or one at `origin` (3,) that looks at `target` (3,), in scene units; `fov` horizontal, in
        degrees; `size` (width, height) in pixels. What was assigned to the camera does not apply to another
        one. Raises `SceneError` if the camera is invalid.
        """
        if (origin is None) != (target is None):
            raise ValueError("a camera has both an origin and a target")
        if origin is not None and target is not None:
            if camera is not None:
                raise ValueError("give a camera, or an origin and a target, not both")
            camera = Camera.look_at(origin, target, up=up, fov=fov)
        core, film = None if camera is None else camera_of(camera, "the camera")._core, film_size(size)
        scene = self.copy()
        scene._core, scene._rest = self._core.seen(core, film), self._rest.seen(core, film)
        scene._view = core or self._view[0], film or self._view[1]
        if core is not None:
            # Poses of a camera are relative to that camera.
            scene._values = {name: x for name, x in self._values.items() if not name.startswith("camera.")}
        return scene

    def write(self, file: Path) -> None:
        """Writes the scene as Mitsuba XML, with its meshes and textures in files beside it."""
        self._core.write(path(file, "the file"))

    def copy(self) -> Scene:
        """A copy that later updates do not change. It is cheap."""
        scene = Scene(self._core, self._recipe, self._notes)
        scene._rest, scene._values, scene._view = self._rest, dict(self._values), self._view
        return scene

    __copy__ = copy

    def _at_rest(self) -> Scene:
        """The scene as it was made, with its present camera and film."""
        scene = self.copy()
        scene._core, scene._values = self._rest, {}
        return scene

    def _token(self) -> str:
        """A name of the scene at rest, the same for all of the same content."""
        return f"{self._recipe.digest}-{self._view}"

    def __reduce__(self) -> tuple[Any, ...]:
        """A pickle holds all files or arrays of which the scene was made, so that it can be read anywhere."""
        return _unpickled, (_core.__version__, self._recipe, self._notes, self._view, self._values)

    def __deepcopy__(self, _memo: Any) -> Scene:
        return self.copy()

    def __repr__(self) -> str:
        (width, height), (shapes, implicits, materials, lights) = self._core.size, self._core.objects
        counts = [
            (len(shapes), "meshes"),
            (len(implicits), "implicit surfaces"),
            (len(materials), "materials"),
            (len(lights), "lights without a surface"),
        ]
        parts = ", ".join(f"{n} {what}" for n, what in counts if n)
        return f"<volume3d.Scene {width} x {height}: {parts}>"


def _unpickled(
    version: str,
    recipe: Recipe,
    notes: tuple[str, ...],
    view: tuple[_core.Camera | None, tuple[int, int] | None],
    values: dict[str, Array],
) -> Scene:
    if version != _core.__version__:
        raise SceneError(f"the scene was pickled by volume3d {version}, and this is {_core.__version__}")
    scene = Scene(recipe.make(), recipe, notes)
    scene._core = scene._rest = scene._core if view == (None, None) else scene._core.seen(*view)
    scene._view = view
    return scene._updated(values) if values else scene


class Recipe:
    """How a scene is made; it can be pickled, and does not change."""

    def make(self) -> _core.Scene:
        """The scene."""
        raise NotImplementedError

    @functools.cached_property
    def digest(self) -> str:
        """A hash of its content."""
        return hashlib.sha256(pickle.dumps(self, protocol=5)).hexdigest()


@dataclass(frozen=True, eq=False)
class Files(Recipe):
    """A scene that was read: the files, the first that of the scene itself, and the options of the reader."""

    files: list[tuple[str, bytes]]
    variables: list[tuple[str, str]]
    size: tuple[int, int] | None
    lenient: bool

    def make(self) -> _core.Scene:
        return _core.Scene.load_files(self.files, self.variables, self.size, self.lenient)


@dataclass(frozen=True, eq=False)
class Calls(Recipe):
    """A scene from arrays: the arguments of the builder, and the names of its methods with theirs."""

    builder: tuple[Any, ...]
    calls: list[tuple[str, tuple[Any, ...]]]

    def make(self) -> _core.Scene:
        builder = _core.Builder(*self.builder)
        for method, arguments in self.calls:
            getattr(builder, method)(*arguments)
        return builder.build()


class _Recorder:
    """A builder of scenes that keeps what it is told."""

    def __init__(self, *arguments: Any) -> None:
        self.recipe = Calls(arguments, [])
        self.builder = _core.Builder(*arguments)

    def tell(self, method: str, *arguments: Any) -> Any:
        """Calls a method of the builder; arrays are copied, as their owner may change them."""
        kept = tuple(np.copy(a) if isinstance(a, np.ndarray) else a for a in arguments)
        result = getattr(self.builder, method)(*kept)
        self.recipe.calls.append((method, kept))
        return result


class Selection(NamedTuple):
    """Selected parameters of a scene."""

    #: These parameters, then all others that were assigned.
    core: _core.Parameters
    #: Name, shape, bounds, and whether it is a rotation vector.
    groups: list[_core.Group]
    #: The values of all.
    x: Array

    @property
    def shapes(self) -> list[tuple[int, ...]]:
        """Shapes of the selected parameters."""
        return [tuple(shape) for _, shape, _, _ in self.groups]

    @property
    def size(self) -> int:
        """Numbers of the selected parameters, the first of `x`."""
        return sum(math.prod(shape) for shape in self.shapes)

    def padded(self, flat: Array) -> Array:
        """A vector of the selected parameters, followed by zeros for the others."""
        return np.concatenate([flat, np.zeros(len(self.x) - len(flat))])


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh for `scene_from_arrays`."""

    #: Positions (n, 3), in scene units.
    positions: ArrayLike
    #: Vertex indices (m, 3) of triangles, counter-clockwise seen from the front.
    triangles: ArrayLike
    #: Name of its material; grey diffuse if None, black if the mesh emits.
    material: str | None = None
    #: Radiance emitted by the front: a number or linear RGB.
    radiance: ArrayLike | None = None
    #: Whether shading normals are interpolated between vertices.
    smooth: bool = False
    #: Texture coordinates (n, 2) of the vertices.
    uvs: ArrayLike | None = None


def load_file(
    file: Path,
    *,
    size: Sequence[int] | None = None,
    variables: Mapping[str, object] | None = None,
    lenient: bool = False,
) -> Scene:
    """Reads a scene from a Mitsuba 3 XML file.

    `size` (width, height) replaces the film's size. `variables` are values of the file's `$name`s. With
    `lenient`, plugins that are not supported are replaced, with a warning each.

    Raises `SceneError` with file, line and column.
    """
    options = variables_of(variables), film_size(size), lenient
    return _noted(*_core.Scene.load_file(path(file, "the file"), *options), options)


def load_string(
    xml: str,
    *,
    folder: Path = ".",
    size: Sequence[int] | None = None,
    variables: Mapping[str, object] | None = None,
    lenient: bool = False,
) -> Scene:
    """Reads a scene from the text of a Mitsuba 3 XML file. Files that it names are searched in `folder`.

    Raises `SceneError` with line and column.
    """
    options = variables_of(variables), film_size(size), lenient
    return _noted(*_core.Scene.load_string(text(xml, "the scene"), path(folder, "the folder"), *options), options)


def _noted(
    core: _core.Scene,
    notes: list[str],
    files: list[tuple[str, bytes]],
    options: tuple[list[tuple[str, str]], tuple[int, int] | None, bool],
) -> Scene:
    for note in notes:
        warnings.warn(note, UserWarning, stacklevel=3)
    return Scene(core, Files(files, *options), notes)


def scene_from_arrays(
    meshes: Mapping[str, Mesh],
    *,
    origin: ArrayLike,
    target: ArrayLike,
    up: ArrayLike = (0.0, 1.0, 0.0),
    fov: float = 40.0,
    size: Sequence[int] = (128, 128),
    materials: Mapping[str, Mapping[str, Any]] | None = None,
    sky: ArrayLike | None = None,
    max_depth: int | None = 3,
) -> Scene:
    """A scene without a file.

    `meshes` by name. `origin`, `target`, `up` (3,) and `fov` (horizontal, degrees) are the camera; `size`
    (width, height) the film. `materials` by name, each a dict:

    - ``{"type": "diffuse", "reflectance": number, RGB, or a texture (height, width, 3)}``
    - ``{"type": "metal", "reflectance": number or RGB, "alpha": roughness from 1e-4 to 1}``

    `sky` is the radiance of a constant environment: a number or linear RGB. `max_depth` is the greatest number
    of segments of a light path: 2 is direct light, None has no limit.

    Raises `SceneError` if the scene is invalid, `ValueError` or `TypeError` for arguments of a wrong shape or
    type.

    >>> import volume3d as v3
    >>> square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> scene = v3.scene_from_arrays(
    ...     {"square": v3.Mesh(*square)}, origin=[0, 0, 5], target=[0, 0, 0], size=(8, 8), sky=1)
    >>> v3.render(scene, spp=4).shape
    (8, 8, 3)
    """
    film = film_size(size)
    if film is None:
        raise TypeError("size must be (width, height)")
    depth = None if max_depth is None else count(max_depth, "max_depth")
    builder = _Recorder(Camera.look_at(origin, target, up=up, fov=fov)._core, film, depth)
    known: dict[str, int] = {}
    for name, definition in (materials or {}).items():
        known[name] = _add_material(builder, text(name, "a material's name"), definition)
    for name, mesh in meshes.items():
        if not isinstance(mesh, Mesh):
            raise TypeError(f"mesh `{name}` must be a volume3d.Mesh, not {type(mesh).__name__}")
        if mesh.material is not None and mesh.material not in known:
            names = ", ".join(known) or "none"
            raise SceneError(f"mesh `{name}`: there is no material `{mesh.material}`; there are: {names}")
        builder.tell(
            "mesh",
            text(name, "a mesh's name"),
            numbers(mesh.positions, f"the positions of `{name}`"),
            _indices(mesh.triangles, f"the triangles of `{name}`"),
            bool(mesh.smooth),
            None if mesh.uvs is None else numbers(mesh.uvs, f"the uvs of `{name}`"),
            None if mesh.material is None else known[mesh.material],
            None if mesh.radiance is None else colour(mesh.radiance, f"the radiance of `{name}`"),
        )
    if sky is not None:
        builder.tell("sky", colour(sky, "sky"))
    return Scene(builder.builder.build(), builder.recipe)


def _add_material(builder: _Recorder, name: str, definition: Mapping[str, Any]) -> Any:
    options = dict(definition)
    kind = options.pop("type", None)
    reflectance = options.pop("reflectance", 0.5)
    alpha: Any = options.pop("alpha", 0.1) if kind == "metal" else 0.1
    if options:
        raise SceneError(f"material `{name}`: unknown keys {', '.join(map(repr, options))}")
    what = f"the reflectance of `{name}`"
    if kind == "metal":
        return builder.tell("metal", name, colour(reflectance, what), float(numbers(alpha, f"the alpha of `{name}`")))
    if kind != "diffuse":
        raise SceneError(f"material `{name}`: type must be 'diffuse' or 'metal', not {kind!r}")
    array = numbers(reflectance, what)
    if array.ndim == 3:
        return builder.tell("diffuse", name, (0.0, 0.0, 0.0), builder.tell("texture", f"{name}-texture", array))
    return builder.tell("diffuse", name, colour(array, what), None)


def _indices(value: ArrayLike, what: str) -> NDArray[np.uint32]:
    array = np.asarray(value)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{what} must be integers, not {array.dtype}")
    if array.size and (array.min() < 0 or array.max() > 2**32 - 1):
        raise ValueError(f"{what} must be from 0 to the number of vertices")
    if array.ndim != 2:
        raise ValueError(f"{what} must have the shape (m, 3), not {array.shape}")
    return np.require(array, np.uint32, ["C", "A"])


def read_image(file: Path) -> Array:
    """Reads a PNG, JPEG, BMP, OpenEXR or Radiance HDR file as linear RGB (height, width, 3).

    Integers are converted from sRGB. Raises `SceneError` if the file cannot be read.
    """
    return _core.read_image(path(file, "the file"))


def write_image(file: Path, image: ArrayLike) -> None:
    """Writes linear RGB (height, width, 3) as .exr or .png, atomically.

    Raises `SceneError` if the file cannot be written.
    """
    _core.write_image(path(file, "the file"), numbers(image, "the image"))
