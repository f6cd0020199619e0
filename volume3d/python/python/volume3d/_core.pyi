"""The library without conveniences: contiguous arrays of float64, flat vectors of parameters."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Triple: TypeAlias = tuple[float, float, float]
LookAt: TypeAlias = tuple[Triple, Triple, Triple, float]
Method: TypeAlias = tuple[str, int, int, float | None]
Group: TypeAlias = tuple[str, list[int], tuple[float, float], bool]
View: TypeAlias = tuple[str, LookAt | None, Array, Array | None]
AdamSettings: TypeAlias = tuple[float, float, float, bool, float | None]
Place: TypeAlias = tuple[int, int, int]
Report: TypeAlias = Callable[[int, int], Any] | None

__version__: str
METHODS: list[str]

class Error(Exception):
    """Base class of all exceptions of this package."""

class SceneError(Error):
    """A scene, a mesh or a file is invalid."""

class ParameterError(Error):
    """A parameter does not exist, or its value is invalid."""

class GradientError(Error):
    """An image or a derivative cannot be computed."""

class FitError(Error):
    """A fit cannot begin, go on or resume."""

class InternalError(Error):
    """A fault of this package: please report it."""

class Scene:
    @staticmethod
    def load_file(
        path: str, variables: list[tuple[str, str]], size: tuple[int, int] | None, lenient: bool
    ) -> tuple[Scene, list[str]]: ...
    @staticmethod
    def load_string(
        text: str, folder: str, variables: list[tuple[str, str]], size: tuple[int, int] | None, lenient: bool
    ) -> tuple[Scene, list[str]]: ...
    def write(self, path: str) -> None: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def objects(self) -> tuple[list[str], list[str], list[str], list[str]]: ...
    def parameter_names(self) -> list[str]: ...
    @property
    def camera(self) -> tuple[Triple, Triple, Triple, Triple, float]: ...
    def mesh(self, name: str) -> tuple[Array, NDArray[np.uint32]]: ...
    def seen(self, look_at: LookAt | None, size: tuple[int, int] | None) -> Scene: ...
    def render(self, spp: int, seed: int, report: Report) -> tuple[Array, Array, list[Place]]: ...

class Builder:
    def __new__(cls, look_at: LookAt, size: tuple[int, int], max_depth: int | None) -> Builder: ...
    def texture(self, name: str, texels: Array) -> int: ...
    def diffuse(self, name: str, colour: Triple, texture: int | None) -> int: ...
    def metal(self, name: str, colour: Triple, alpha: float) -> int: ...
    def mesh(
        self,
        name: str,
        positions: Array,
        triangles: NDArray[np.uint32],
        smooth: bool,
        uvs: Array | None,
        material: int | None,
        radiance: Triple | None,
    ) -> None: ...
    def sky(self, radiance: Triple) -> None: ...
    def build(self) -> Scene: ...

class Parameters:
    def __new__(cls, scene: Scene, names: Sequence[str]) -> Parameters: ...
    def groups(self, scene: Scene) -> list[Group]: ...
    def values(self, scene: Scene) -> Array: ...
    def apply(self, scene: Scene, x: Array) -> Scene: ...
    def retract(self, x: Array, step: Array) -> Array: ...

class Fit:
    def __new__(
        cls,
        scene: Scene,
        parameters: Parameters,
        x: Array,
        views: list[View],
        loss: tuple[str, float],
        optimizers: list[AdamSettings],
        penalties: list[tuple[str, str, float]],
        plan: tuple[int, str, float, int, int],
        samples: tuple[int, int | None],
        method: Method,
    ) -> Fit: ...
    def step(self) -> bool: ...
    @property
    def steps_taken(self) -> int: ...
    @property
    def losses(self) -> list[tuple[float, float]]: ...
    @property
    def method(self) -> str: ...
    def values(self) -> Array: ...
    def state(self) -> bytes: ...
    def resume(self, state: bytes) -> None: ...

def forward(
    scene: Scene, parameters: Parameters, x: Array, direction: Array, method: Method, report: Report
) -> dict[str, Any]: ...
def reverse(
    scene: Scene, parameters: Parameters, x: Array, adjoint: Array, method: Method, report: Report
) -> tuple[Array, list[Place], str | None, list[str]]: ...
def png(array: Array, signed_range: float | None = None) -> bytes: ...
def read_image(path: str) -> Array: ...
def write_image(path: str, array: Array, comments: str = "") -> None: ...
def set_num_threads(threads: int) -> None:
    """Sets the number of threads of this process; 0 is one per core."""

def num_threads() -> int:
    """The number of threads of this process."""
