"""Images and derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import MAX_SEED, Array, count, numbers, shaped, text
from ._core import GradientError, ParameterError
from ._executor import Crew, Shared
from ._parameters import Parameters
from ._results import Gradient, GradientImage, Rendering
from ._scene import Scene, Selection

#: Names of methods: see the table in the documentation of `forward`.
METHODS: tuple[str, ...] = tuple(_core.METHODS)

#: A callback with the numbers of steps done and in total, or True for a bar by tqdm.
Progress: TypeAlias = "bool | Callable[[int, int], Any] | None"


def render(scene: Scene, *, spp: int = 16, seed: int = 0, progress: Progress = None) -> Rendering:
    """The image of a scene, from `spp` samples per pixel.

    Images are unbiased. The same seed gives the same bits with any number of threads. `progress` is True for a
    bar (by tqdm, if it is installed) or a function of the steps done and in total. Ctrl-C cancels.

    Raises `GradientError` if the image cannot be computed.
    """
    with _Report(progress, "render") as report:
        return Rendering(*_scene(scene).render(_spp(spp), _seed(seed), report))


def forward(
    scene: Scene,
    change: Mapping[str, ArrayLike],
    *,
    spp: int = 64,
    seed: int = 0,
    method: str = "auto",
    step: float | None = None,
    progress: Progress = None,
) -> GradientImage:
    """dI/dθ of every pixel as the parameters change at the rates `change`, by name.

    ``{"block.translation": [1, 0, 0]}`` is the derivative as the block moves to the right by one scene unit.

    ====================  ===========================================================================
    method                the derivative
    ====================  ===========================================================================
    ``auto``              unbiased; a pilot of few samples chooses between the next two
    ``warped-area``       unbiased; mean over edges
    ``edge``              unbiased; edge sampling
    ``rotation``          biased unless objects turn as a whole (Loubet et al. 2019)
    ``interior``          biased wherever silhouettes, shadows or borders of lights move
    ``finite-difference`` biased by O(step²); differentiates everything
    ====================  ===========================================================================

    `step` is that of finite differences, in units of `change`.

    Raises `ParameterError` for unknown names, `GradientError` if the method does not support the scene.
    """
    core, (parameters, x, direction) = _scene(scene), along(scene, change)
    settings = _method(method, spp, seed, step)
    with _Report(progress, "gradient") as report:
        found = _core.forward(core, parameters, x, direction, settings, report)
    return GradientImage(
        gradient=found["gradient"],
        stderr=found["stderr"],
        image=found["image"],
        image_stderr=found["image_stderr"],
        total=np.array(found["total"]),
        total_stderr=np.array(found["total_stderr"]),
        method=found["choice"] or method,
        non_finite=found["non_finite"],
        warnings=found["warnings"],
    )


def reverse(
    scene: Scene,
    params: Parameters | Iterable[str],
    adjoint: ArrayLike,
    *,
    spp: int = 16,
    seed: int = 0,
    method: str = "auto",
    runs: int = 1,
    progress: Progress = None,
    executor: Executor | None = None,
    threads: int | None = 1,
) -> Gradient:
    """The gradient of a number L by all of `params`, from `adjoint` = ∂L/∂I (height, width, 3).

    `params` are `Parameters` or names. With several independent `runs` of `spp` samples each, the result is
    their mean, and `Gradient.stderr` its standard error; 16 runs or more give a reliable one.

    The adjoint must not come from the image of the same samples, or the product is biased: `render` draws
    independent ones at any seed.

    With an `executor` of `concurrent.futures` the runs are its tasks, with the same bits; see `Fit.run`.
    `progress` then counts runs, and worker processes use `threads` threads.

    Raises `GradientError` if the adjoint has another size than the film or is not finite, if the method
    does not support the scene, or if workers die again and again; `ParameterError` for unknown or conflicting
    names.
    """
    core = _scene(scene)
    names = [params] if isinstance(params, str) else list(params)
    if not names:
        raise ParameterError("there are no parameters: name at least one")
    selection = select(scene, names)
    array = numbers(adjoint, "the adjoint")
    if threads is not None:
        threads = count(threads, "threads", least=0)
    every = [_method(method, spp, _run_seed(seed, run), None) for run in range(count(runs, "runs"))]
    results = []
    if executor is None:
        for settings in every:
            with _Report(progress, "gradient") as report:
                results.append(_core.reverse(core, selection.core, selection.x, array, settings, report))
    else:
        rest = scene._at_rest()
        crew = Crew(executor, Shared(Reverse(rest), rest._token()), threads, GradientError)
        with _Report(progress, "gradient") as report:
            results = crew.map([(scene._values, names, array, settings) for settings in every], report)
    found = [one[0][: selection.size] for one in results]
    places = [place for one in results for place in one[1]]
    used = results[-1][2] or method
    notes = list(dict.fromkeys(note for one in results for note in one[3]))
    stack = np.stack(found)
    mean = stack.sum(axis=0) / runs
    error = stack.std(axis=0, ddof=1) / math.sqrt(runs) if runs > 1 else None
    return Gradient(
        dict(zip(names, split(mean, selection.shapes), strict=True)),
        {} if error is None else dict(zip(names, split(error, selection.shapes), strict=True)),
        used,
        places,
        notes,
    )


@dataclass(eq=False)
class Reverse:
    """Derivatives of a scene at any values of its parameters."""

    scene: Scene

    def prepare(self) -> None:
        """Nothing has to be made."""

    def run(self, task: tuple[dict[str, Array], list[str], Array, _core.Method], /) -> Any:
        """What `_core.reverse` returns."""
        values, names, adjoint, settings = task
        scene = self.scene._updated(values) if values else self.scene
        selection = select(scene, names)
        array = numbers(adjoint, "the adjoint")
        return _core.reverse(scene._core, selection.core, selection.x, array, settings, None)


def along(scene: Scene, change: Mapping[str, ArrayLike]) -> _core.Change:
    """Parameters of a change, their values and rates."""
    _scene(scene)
    if not change:
        raise ParameterError("the change is empty: name at least one parameter")
    selection = select(scene, list(change))
    directions = [
        shaped(value, shape, f"the rate of `{name}`")
        for (name, value), shape in zip(change.items(), selection.shapes, strict=True)
    ]
    flat = np.concatenate([direction.ravel() for direction in directions])
    if not np.isfinite(flat).all():
        raise ValueError("the change must be finite")
    return selection.core, selection.x, selection.padded(flat)


def split(flat: Array, shapes: list[tuple[int, ...]]) -> list[Array]:
    """Parts of a flat vector, each with its shape."""
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    return [part.reshape(shape) for part, shape in zip(np.split(flat, ends[:-1]), shapes, strict=True)]


def select(scene: Scene, names: list[str]) -> Selection:
    """Parameters by name."""
    _scene(scene)
    return scene._select([text(name, "a parameter's name") for name in names])


def _scene(scene: Scene) -> _core.Scene:
    if not isinstance(scene, Scene):
        raise TypeError(f"the scene must be a volume3d.Scene, not {type(scene).__name__}")
    return scene._core


def _spp(spp: int) -> int:
    return count(spp, "spp")


def _seed(seed: int) -> int:
    return count(seed, "the seed", least=0, most=MAX_SEED)


def _run_seed(seed: int, run: int) -> int:
    """Seeds of runs; that of run 0 is `seed` itself."""
    _seed(seed)
    if run == 0:
        return seed
    return int(np.random.SeedSequence([seed, run]).generate_state(1, np.uint64)[0])


def _method(name: str, spp: int, seed: int, step: float | None) -> _core.Method:
    if step is not None:
        if name != "finite-difference":
            raise ValueError("step belongs to method='finite-difference'")
        step = float(numbers(step, "step"))
    return text(name, "the method"), _spp(spp), _seed(seed), step


class _Report:
    """A callback for progress; with True a bar by tqdm, if it is installed."""

    def __init__(self, progress: Progress, what: str) -> None:
        self._bar: Any = None
        self._callback: Callable[[int, int], Any] | None = None
        if progress is True:
            try:
                from tqdm.auto import tqdm
            except ImportError:
                return
            self._bar = tqdm(desc=what, leave=False)
            self._callback = self._show
        elif callable(progress):
            self._callback = progress
        elif progress not in (None, False):
            raise TypeError("progress must be True, False, None or a function of two numbers")

    def _show(self, done: int, total: int) -> None:
        self._bar.total = total
        self._bar.update(done - self._bar.n)

    def __enter__(self) -> Callable[[int, int], Any] | None:
        return self._callback

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
