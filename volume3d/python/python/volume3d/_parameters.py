"""Parameters of a scene, by name."""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Iterable, Iterator, Mapping, MutableMapping

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import Array, shaped, text
from ._core import ParameterError
from ._scene import Scene, Selection


class Parameters(MutableMapping[str, Array]):
    """Parameters of a scene: a mapping from names to arrays, made by `traverse`.

    Assign values, then call `update`, which changes the scene:

    >>> import volume3d as v3
    >>> scene = v3.load_file("table.xml")                       # doctest: +SKIP
    >>> params = v3.traverse(scene)                             # doctest: +SKIP
    >>> params.keep(["block.translation"])                      # doctest: +SKIP
    >>> params["block.translation"] = [0.1, 0, 0]               # doctest: +SKIP
    >>> params.update()                                         # doctest: +SKIP

    Poses are relative to the scene as it was loaded: with p0 the vertices and c0 their mean there,
    p = c0 + t + s R (p0 - c0); `translation` is t in scene units, `rotation` the rotation vector of R in
    radians, `scale` is s. Gradients by a rotation are those by a further turn about the moved centre; take
    steps by `retract`, which composes rotations.
    """

    def __init__(self, scene: Scene, names: Iterable[str]) -> None:
        self._scene = scene
        self._names = list(names)
        self._changed: dict[str, Array] = {}

    def keep(self, names: str | Iterable[str]) -> None:
        """Restricts the parameters to names or patterns such as ``"block.*"``.

        Raises `ParameterError` if one matches nothing.
        """
        kept: list[str] = []
        for pattern in [names] if isinstance(names, str) else list(names):
            found = fnmatch.filter(self._names, text(pattern, "a name"))
            if not found:
                raise ParameterError(_unknown(pattern, self._names))
            kept += [name for name in found if name not in kept]
        self._names = kept
        self._changed = {name: value for name, value in self._changed.items() if name in kept}

    def _one(self, name: str) -> Selection:
        if name not in self._names:
            raise KeyError(_unknown(str(name), self._names))
        return self._scene._select([name])

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of a parameter's array."""
        return self._one(name).shapes[0]

    def bounds(self, name: str) -> tuple[float, float]:
        """Least and greatest value of each number of a parameter."""
        _, _, (low, high), _ = self._one(name).groups[0]
        return low, high

    def __getitem__(self, name: str) -> Array:
        if name in self._changed:
            return self._changed[name].copy()
        selection = self._one(name)
        return selection.x[: selection.size].reshape(selection.shapes[0]).copy()

    def __setitem__(self, name: str, value: ArrayLike) -> None:
        self._changed[name] = shaped(value, self.shape(name), f"`{name}`").copy()

    def __delitem__(self, name: str) -> None:
        self._one(name)
        self._names.remove(name)
        self._changed.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        return iter(list(self._names))

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def update(self, values: Mapping[str, ArrayLike] | None = None, /) -> None:  # type: ignore[override]
        """Assigns `values`, if given, and sets the scene to all assigned values, or to none of them.

        Raises `ParameterError` with name, index and value if one is out of its bounds or not finite; the scene
        is then unchanged, and the assignments are forgotten.
        """
        try:
            for name, value in (values or {}).items():
                self[name] = value
            if self._changed:
                updated = self._scene._updated(self._changed)
                self._scene._core, self._scene._values = updated._core, updated._values
        finally:
            self._changed = {}

    def retract(self, step: Mapping[str, ArrayLike]) -> None:
        """Assigns the values moved along a step: rotations are composed, everything else is added, and bounds
        are kept. Call `update` to change the scene.
        """
        for name, value in step.items():
            moved = shaped(value, self.shape(name), f"the step of `{name}`")
            selection = self._one(name)
            x = np.concatenate([self[name].ravel(), selection.x[moved.size :]])
            x = selection.core.retract(x, selection.padded(moved.ravel()))
            self._changed[name] = x[: moved.size].reshape(moved.shape)

    def __repr__(self) -> str:
        lines = (f"  {name}: {self.shape(name)}" for name in self._names)
        return "\n".join(["<volume3d.Parameters", *lines, ">"])


def _unknown(name: str, names: list[str]) -> str:
    close = difflib.get_close_matches(name, names, n=3)
    hint = f"did you mean {', '.join(close)}?" if close else f"there are: {', '.join(names[:20])}"
    return f"there is no parameter `{name}`; {hint}"


def traverse(scene: Scene) -> Parameters:
    """All parameters of a scene, by name; `Parameters.keep` selects some."""
    if not isinstance(scene, Scene):
        raise TypeError(f"traverse takes a volume3d.Scene, not {type(scene).__name__}")
    return Parameters(scene, scene.names)
