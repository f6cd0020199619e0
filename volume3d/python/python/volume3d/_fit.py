"""Fits of parameters to pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Array, count, numbers, text
from ._core import FitError
from ._estimate import Progress, _method, _Report, _scene, _seed, _spp, select, split
from ._parameters import Parameters
from ._results import Rendering
from ._scene import Scene, _look_at


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
    #: Smoothing λ of large steps (Nicolet, Jacobson and Jakob 2021), for vertex positions: 10 to 50 is usual.
    large_steps: float | None = None


@dataclass(frozen=True, eq=False)
class View:
    """A picture with its camera.

    Without `origin` and `target` the camera is the scene's own, which may then be fitted; that is for a single
    view.
    """

    #: The picture: linear RGB (height, width, 3), or a `Rendering`.
    picture: ArrayLike | Rendering
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
    ``views``            pictures with cameras
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
    ===================  ==========================================================================

    The scene that is given stays as it is. The same seed gives the same bits with any number of threads. Raises
    `FitError`, `ParameterError` or `GradientError`.
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
        seed: int = 0,
        method: str = "auto",
    ) -> None:
        core = _scene(scene)
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
        self._core = _core.Fit(
            core,
            selection.core,
            selection.x,
            [_view(view, str(index)) for index, view in enumerate(views)],
            (text(loss, "the loss"), float(scale)),
            [_settings(adams[name], name) for name in self._names]
            + [(0.0, 0.9, 0.999, False, None)] * (len(selection.core.groups(scene._rest)) - len(self._names)),
            [(text(p.shape, "a shape"), text(p.kind, "a kind"), float(p.weight)) for p in penalties],
            (
                self._steps,
                text(schedule, "the schedule"),
                float(numbers(end, "end")),
                count(len(views) if views_per_step is None else views_per_step, "views_per_step"),
                _seed(seed),
            ),
            (_spp(spp if image_spp is None else image_spp), None if pixels is None else count(pixels, "pixels")),
            _method(method, spp, seed, None),
        )

    def step(self) -> bool:
        """Takes one step. Returns False once all steps are taken.

        If it fails or is interrupted, the fit stays as before the step.
        """
        return self._core.step()

    def run(self, steps: int | None = None, *, progress: Progress = None) -> Fit:
        """Takes `steps` steps, or all that are left, and returns the fit.

        `progress` is True for a bar or a function of the steps done and in total. After Ctrl-C the fit goes on
        with another `run`.
        """
        total = self._steps - self.steps_taken
        total = total if steps is None else min(total, count(steps, "steps", least=0))
        with _Report(progress, "fit") as report:
            for done in range(1, total + 1):
                self.step()
                if report is not None:
                    report(done, total)
        return self

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


def _view(view: View, index: str) -> _core.View:
    if not isinstance(view, View):
        raise TypeError(f"view {index} must be a volume3d.View, not {type(view).__name__}")
    name = view.name or index
    if (view.origin is None) != (view.target is None):
        raise ValueError(f"view `{name}`: a camera has both an origin and a target")
    camera = None
    if view.origin is not None and view.target is not None:
        camera = _look_at(view.origin, view.target, view.up, view.fov)
    picture = numbers(np.asarray(view.picture), f"the picture of view `{name}`")
    weights = None if view.weights is None else numbers(view.weights, f"the weights of view `{name}`")
    return name, camera, picture, weights


def _settings(adam: Adam, name: str) -> _core.AdamSettings:
    if not isinstance(adam, Adam):
        raise TypeError(f"the optimizer of `{name}` must be a volume3d.Adam, not {type(adam).__name__}")
    rate = float(numbers(adam.rate, f"the rate of `{name}`"))
    if not (rate > 0 and np.isfinite(rate)):
        raise FitError(f"the rate of `{name}` must be positive, not {rate}")
    return rate, float(adam.beta1), float(adam.beta2), bool(adam.uniform), adam.large_steps
