"""Fits of parameters to pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _core
from ._arrays import Array, count, numbers, text
from ._core import FitError
from ._estimate import Progress, _method, _Report, _scene, _seed, _spp, select, split
from ._executor import Crew, Shared
from ._parameters import Parameters
from ._scene import Scene
from ._views import View


@dataclass(frozen=True)
class Adam:
    """Settings of Adam (Kingma and Ba 2015) for one parameter.

    A step is about `rate` in each number, in units of the parameter.
    """

    #: Size of the first steps, in units of the parameter.
    rate: float
    #: Decay of the mean of gradients.
    beta1: float = 0.9
    #: Decay of the mean of squared gradients.
    beta2: float = 0.999
    #: Whether all numbers share one mean of squares: for vertex positions.
    uniform: bool = False
    #: Smoothing λ of large steps (Nicolet, Jacobson and Jakob 2021). For vertex positions 10 to 50 is usual. For
    #: the nodes of an SDF grid 1 is a good start; φ is then made a distance again after each step.
    large_steps: float | None = None


@dataclass(frozen=True)
class Penalty:
    """A regularization term of a mesh whose vertices are fitted."""

    #: Name of the shape.
    shape: str
    #: "laplacian", "edge-length" or "normal-consistency".
    kind: str
    #: Factor of the term.
    weight: float


class Fit:
    """A fit of parameters of a scene to pictures, by Adam.

    >>> fit = v3.Fit(scene, ["block.translation", "block.rotation"], [v3.View(picture)], steps=100)  # doctest: +SKIP
    >>> fit.run()                                                                                   # doctest: +SKIP
    >>> fit.values["block.translation"]                                                             # doctest: +SKIP

    ===================  ==========================================================================
    argument             meaning
    ===================  ==========================================================================
    ``params``           names, or `Parameters`
    ``views``            pictures with cameras: `Views`, or a list of `View`
    ``optimizer``        `Adam` for all parameters, or a dict with one for each name
    ``loss``             "multiscale" (means over blocks of 1, 2, 4, … pixels, so that distant things
                         attract one another), "l2", "l1" or "relative"
    ``levels``           resolutions of "multiscale"
    ``epsilon``          radiance below which darkness no longer counts, of "relative"
    ``steps``            number of steps, over which ``schedule`` is spread: "cosine" (the rate falls
                         to ``end``), "constant" or "exponential"
    ``views_per_step``   views of a step; each is used once in a round
    ``spp``              samples per pixel of gradients; ``image_spp`` those of images
    ``pixels``           pixels of each view in a step, drawn at random; None is all
    ``chunks``           independent estimates of each view in a step, each with all samples: the step
                         is their mean, and has as many tasks for an executor times views
    ===================  ==========================================================================

    The scene that is given stays as it is. The same seed gives the same bits with any number of threads, and
    with any executor. Raises `FitError`, `ParameterError` or `GradientError`.
    """

    def __init__(
        self,
        scene: Scene,
        params: Parameters | Iterable[str],
        views: Sequence[View],
        *,
        optimizer: Adam | Mapping[str, Adam] = Adam(0.02),
        loss: str = "multiscale",
        levels: int = 4,
        epsilon: float = 0.01,
        penalties: Sequence[Penalty] = (),
        steps: int = 100,
        schedule: str = "cosine",
        end: float = 0.0,
        views_per_step: int | None = None,
        spp: int = 8,
        image_spp: int | None = None,
        pixels: int | None = None,
        chunks: int = 1,
        seed: int = 0,
        method: str = "auto",
    ) -> None:
        _scene(scene)
        self._names = [params] if isinstance(params, str) else list(params)
        if not self._names:
            raise FitError("there are no parameters: name at least one")
        if not views:
            raise FitError("there are no views: give at least one picture")
        selection = select(scene, self._names)
        self._scene, self._shapes = scene.copy(), selection.shapes
        adams = optimizer if isinstance(optimizer, Mapping) else dict.fromkeys(self._names, optimizer)
        missing = [name for name in self._names if name not in adams]
        if missing or len(adams) != len(self._names):
            raise FitError(f"the optimizers are of {', '.join(adams)}, the parameters {', '.join(self._names)}")
        scale = count(levels, "levels") if loss == "multiscale" else float(numbers(epsilon, "epsilon"))
        self._steps = count(steps, "steps")
        plain: _core.AdamSettings = (0.0, 0.9, 0.999, False, None)
        others = len(selection.core.groups(scene._rest)) - len(self._names)
        spps = _spp(spp if image_spp is None else image_spp), None if pixels is None else count(pixels, "pixels")
        self._work = Work(
            scene.copy(),
            self._names,
            [_view(view, str(index)) for index, view in enumerate(views)],
            (text(loss, "the loss"), float(scale)),
            (*spps, count(chunks, "chunks")),
            _method(method, spp, seed, None),
        )
        self._core = self._work.fit(
            [_settings(adams[name], name) for name in self._names] + [plain] * others,
            [(text(p.shape, "a shape"), text(p.kind, "a kind"), float(p.weight)) for p in penalties],
            (
                self._steps,
                text(schedule, "the schedule"),
                float(numbers(end, "end")),
                count(len(views) if views_per_step is None else views_per_step, "views_per_step"),
                _seed(seed),
            ),
        )

        self._work.own = self._core
        self._shared = Shared(self._work)

    def step(self) -> bool:
        """Takes one step. Returns False once all steps are taken.

        If it fails or is interrupted, the fit stays as before the step.
        """
        return self._core.step()

    def run(
        self,
        steps: int | None = None,
        *,
        progress: Progress = None,
        executor: Executor | None = None,
        threads: int | None = 1,
    ) -> Fit:
        """Takes `steps` steps, or all that are left, and returns the fit.

        `progress` is True for a bar or a function of the steps done and in total. After Ctrl-C the fit goes on
        with another `run`.

        With an `executor` of `concurrent.futures`, such as a `ProcessPoolExecutor` or the ``get_executor()`` of
        a client of Dask, each view and chunk of a step is a task. The bits are those without one, for any number
        of workers, where all have the same processor type and C library. Scene and pictures travel once to each
        process, parameters with each task. Worker processes use `threads` threads: 0 is one per core, None
        leaves `set_num_threads` as it is there.

        Raises `FitError` if worker processes die again and again, as soon as a pool of processes has lost one, or
        if one has another version of the package. The fit is then as after its last step: `run` goes on with a
        new executor, and `state` can be saved.
        """
        if threads is not None:
            threads = count(threads, "threads", least=0)
        crew = None if executor is None else Crew(executor, self._shared, threads, FitError)
        total = self._steps - self.steps_taken
        total = total if steps is None else min(total, count(steps, "steps", least=0))
        with _Report(progress, "fit") as report:
            for done in range(1, total + 1):
                if crew is None:
                    self.step()
                else:
                    self._step_of(crew)
                if report is not None:
                    report(done, total)
        return self

    def _step_of(self, crew: Crew) -> None:
        # A step has two rounds if there are chunks: images and derivatives.
        while tasks := self._core.ask():
            if self._core.tell(crew.map(tasks)):
                break

    @property
    def steps_taken(self) -> int:
        """Number of steps so far."""
        return self._core.steps_taken

    @property
    def losses(self) -> Array:
        """Mean loss of each step, before the step (n,). Noise of the images adds its variance to squares."""
        return np.array([loss for loss, _ in self._core.losses])

    @property
    def method(self) -> str:
        """The method of all steps, which a pilot chose unless one was given."""
        return self._core.method

    @property
    def values(self) -> dict[str, Array]:
        """The fitted values, by name."""
        size = sum(math.prod(shape) for shape in self._shapes)
        return dict(zip(self._names, split(self._core.values()[:size], self._shapes), strict=True))

    @property
    def scene(self) -> Scene:
        """The fitted scene."""
        return self._scene._updated(self.values)

    def state(self) -> bytes:
        """Everything that a later `resume` needs, with the moments of Adam."""
        return self._core.state()

    def resume(self, state: bytes) -> None:
        """Goes on from a state of the same fit, bit for bit.

        Raises `FitError` if the state is damaged or of other parameters.
        """
        if not isinstance(state, bytes):
            raise TypeError(f"the state must be bytes, not {type(state).__name__}")
        self._core.resume(state)

    def __repr__(self) -> str:
        losses = self.losses
        last = f", loss {losses[-1]:.4g}" if len(losses) else ""
        return f"<volume3d.Fit of {', '.join(self._names)}: step {self.steps_taken} of {self._steps}{last}>"


@dataclass(eq=False)
class Work:
    """What the tasks of a fit share."""

    scene: Scene
    names: list[str]
    views: list[_core.View]
    loss: tuple[str, float]
    samples: tuple[int, int | None, int]
    method: _core.Method
    #: The fit itself, in its own process.
    own: _core.Fit | None = field(default=None, init=False)
    core: _core.Worker | None = field(default=None, init=False)

    def fit(
        self,
        optimizers: list[_core.AdamSettings],
        penalties: list[tuple[str, str, float]],
        plan: tuple[int, str, float, int, int],
    ) -> _core.Fit:
        """A fit of the scene's parameters."""
        selection = select(self.scene, self.names)
        scene, core, x = self.scene._core, selection.core, selection.x
        return _core.Fit(
            scene, core, x, self.views, self.loss, optimizers, penalties, plan, self.samples, self.method
        )

    def prepare(self) -> None:
        """Makes what runs the tasks. Elsewhere the method of all steps is chosen as in the fit's own process."""
        if self.own is None:
            groups = select(self.scene, self.names).core.groups(self.scene._rest)
            plain: list[_core.AdamSettings] = [(1.0, 0.9, 0.999, False, None)] * len(groups)
            self.core = self.fit(plain, [], (1, "constant", 0.0, 1, 0)).worker()
        else:
            self.core = self.own.worker()

    def run(self, task: bytes, /) -> bytes:
        """The part of a task."""
        assert self.core is not None, "it is prepared"
        return self.core.run(task)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "own": None, "core": None}


def _view(view: View, index: str) -> _core.View:
    if not isinstance(view, View):
        raise TypeError(f"view {index} must be a volume3d.View, not {type(view).__name__}")
    name = view.name or index
    camera = view._camera(f"view `{name}`")
    if view.picture is None:
        raise FitError(f"view `{name}` has no picture")
    picture = numbers(np.asarray(view.picture), f"the picture of view `{name}`")
    weights = None if view.weights is None else numbers(view.weights, f"the weights of view `{name}`")
    return name, None if camera is None else camera._core, picture, weights


def _settings(adam: Adam, name: str) -> _core.AdamSettings:
    if not isinstance(adam, Adam):
        raise TypeError(f"the optimizer of `{name}` must be a volume3d.Adam, not {type(adam).__name__}")
    rate = float(numbers(adam.rate, f"the rate of `{name}`"))
    if not (rate > 0 and np.isfinite(rate)):
        raise FitError(f"the rate of `{name}` must be positive, not {rate}")
    return rate, float(adam.beta1), float(adam.beta2), bool(adam.uniform), adam.large_steps
