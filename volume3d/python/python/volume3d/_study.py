"""What gradients of a scene are worth: `check`, `lint` and `tune`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from . import _core
from ._arrays import numbers, shaped
from ._estimate import Progress, _method, _Report, _scene, _seed, _spp, along
from ._scene import Scene

#: Independent runs of each estimate of `check`.
RUNS = 16


@dataclass(frozen=True)
class Slope:
    """The weighted total by finite differences with one step."""

    #: The step, in units of the change.
    step: float
    #: The weighted total.
    total: float
    #: Its standard error.
    stderr: float
    #: Upper bound on its error due to the step; infinite at the largest step.
    bias: float
    #: (the method's total - this one) in standard errors.
    z: float


@dataclass(frozen=True, repr=False)
class Check:
    """A gradient beside finite differences. Both are reduced to one number, a weighted sum over pixels."""

    #: ``"agrees"``; ``"differs"``; ``"open"`` if noise or steps do not decide; or ``"nothing changes"``.
    verdict: str
    #: The step with the narrowest bounds if they agree, or with the clearest difference if they differ.
    step: float | None
    #: Largest relative difference that would not have been detected, unless they differ.
    within: float | None
    #: Relative difference, if they differ.
    by: float | None
    #: Number of samples per pixel that is likely to decide an open check, if more samples do.
    spp_needed: int | None
    #: The weighted total by the method.
    total: float
    #: Its standard error.
    total_stderr: float
    #: Finite differences, from the largest step to the smallest.
    slopes: tuple[Slope, ...]
    #: The method that was used.
    method: str
    #: (column, row, sample) of samples that were not finite; they are left out.
    non_finite: list[tuple[int, int, int]]
    #: Sentences on what may be wrong with the result.
    warnings: list[str]

    @property
    def agrees(self) -> bool:
        """Whether no difference was found that is larger than a tenth."""
        return self.verdict == "agrees"

    def __repr__(self) -> str:
        words = self.verdict
        if self.within is not None:
            words += f" within {100 * self.within:.1f} %"
        if self.by is not None and math.isfinite(self.by):
            words += f" by {100 * self.by:.1f} %"
        return f"<volume3d.Check: {words}, total {self.total:.4g} ± {self.total_stderr:.1g}>"


def check(
    scene: Scene,
    change: Mapping[str, ArrayLike],
    *,
    spp: int = 256,
    seed: int = 0,
    method: str = "auto",
    steps: Sequence[float] | None = None,
    progress: Progress = None,
) -> Check:
    """Compares the derivative along `change`, as of `forward`, with central finite differences at several steps.

    Both estimates have 16 independent runs, with `spp` samples per pixel in all. The verdict is ``"differs"``
    only if neither noise, nor changes that no sample saw, nor the error due to the step explain the
    difference: for correct gradients at most once in 900 checks. `steps` are in units of `change`; by default
    the fastest parameter moves by 3e-2, 1e-2, 3e-3, 1e-3 and 3e-4 of the scene's size, of a radian, or of a
    unit of radiance or reflectance.

    Raises `ParameterError` for unknown names, `GradientError` if the method does not support the scene or is
    ``finite-difference``.
    """
    core, settings = _scene(scene), _method(method, -(-_spp(spp) // RUNS), seed, None)
    given = [] if steps is None else numbers(steps, "the steps").ravel().tolist()
    if not all(0 < step < math.inf for step in given):
        raise ValueError("the steps must be positive and finite")
    with _Report(progress, "check") as report:
        found = _core.check(core, along(scene, change), settings, given, report)
    more = found.pop("more")
    return Check(
        slopes=tuple(Slope(*row) for row in found.pop("slopes")),
        method=found.pop("choice") or method,
        spp_needed=None if more is None else math.ceil(more * settings[1] * RUNS),
        **found,
    )


@dataclass(frozen=True)
class Finding:
    """A problem of a scene for gradients."""

    #: ``unsupported``, ``crossing``, ``coordinates``, ``unlit``, ``contact``, ``pixel-border`` or ``mesh``.
    kind: str
    #: Names of the shapes, implicit surfaces or lights concerned; empty if it is the scene as a whole.
    shapes: tuple[str, ...]
    #: Whether gradients are wrong or refused; otherwise it is a hint.
    is_wrong: bool
    #: The problem and its place.
    message: str
    #: Advice.
    advice: str

    def __str__(self) -> str:
        return f"{'WRONG' if self.is_wrong else 'hint'}: {self.message}\n    {self.advice}"


def lint(scene: Scene, change: Mapping[str, ArrayLike] | None = None) -> list[Finding]:
    """Problems of a scene for derivatives with respect to geometry, shape by shape, with advice.

    With a `change` these are the problems of the derivative along it. Without one, any shape may move, and
    surfaces in contact are only hints, because derivatives are wrong where they separate, not where they slide.
    """
    found = _core.lint(_scene(scene), None if change is None else along(scene, change))
    return [
        Finding(kind, tuple(shapes), wrong, message, advice) for kind, shapes, wrong, message, advice in found
    ]


@dataclass(frozen=True)
class Setting:
    """A method with what was measured of it. Numbers are relative to the gradient, root mean square."""

    #: The method.
    method: str
    #: Its step, for finite differences.
    step: float | None
    #: Whether it is proved to be unbiased for the change.
    unbiased: bool
    #: Whether single samples carry so much that the numbers are unreliable.
    heavy_tails: bool
    #: Reason why it was not measured; otherwise empty.
    note: str
    #: Samples per pixel of the largest runs.
    spp: int = 0
    #: Median wall time of these runs.
    seconds: float = math.nan
    #: Slope of the gradient on the reference; below 1, gradients are too small.
    slope: float = math.nan
    #: Standard error of `slope`.
    slope_stderr: float = math.nan
    #: The error that more samples do not reduce, or an upper bound on it.
    bias: float = math.nan
    #: Whether `bias` is distinguishable from noise; otherwise it is an upper bound.
    bias_is_resolved: bool = False
    #: Standard deviation of one of these runs.
    noise: float = math.nan


@dataclass(frozen=True)
class Advice:
    """The best setting for a time or an error."""

    #: The method.
    method: str
    #: Its step, for finite differences.
    step: float | None
    #: Samples per pixel.
    spp: int
    #: Expected wall time in seconds.
    seconds: float
    #: Expected root mean square error, relative to the gradient.
    error: float
    #: Standard error of `error`.
    error_stderr: float
    #: Whether single samples carry so much that the numbers are unreliable.
    heavy_tails: bool

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of `forward`."""
        step = {} if self.step is None else {"step": self.step}
        return {"method": self.method, "spp": self.spp, **step}


class Tuning:
    """The results of `tune`."""

    def __init__(self, core: _core.Tuning) -> None:
        self._core = core

    @property
    def settings(self) -> list[Setting]:
        """All settings, with measurements."""
        return [Setting(**row) for row in self._core.settings]

    @property
    def reference(self) -> str:
        """The setting that the others are compared with."""
        setting, spp, unbiased = self._core.reference
        return f"{setting}, {spp} spp" + ("" if unbiased else ", biased: no unbiased method supports the scene")

    @property
    def filters(self) -> dict[str, float]:
        """Noise under other pixel filters, divided by that under the scene's own filter."""
        return dict(self._core.filters)

    @property
    def seconds(self) -> float:
        """Duration of the study."""
        return self._core.seconds

    def best(self, *, seconds: float | None = None, error: float | None = None) -> Advice | None:
        """The setting with the smallest error within `seconds`, or the fastest one with an `error` such as 0.05;
        None if no setting reaches it.

        ``forward(scene, change, **tuning.best(error=0.05).options)`` uses it.
        """
        if (seconds is None) == (error is None):
            raise ValueError("best takes either seconds or error")
        target = _positive(seconds if error is None else error, "the target")
        found = self._core.best(*((target, None) if error is None else (None, target)))
        if found is None:
            return None
        (method, step), spp, expected, (value, stderr), heavy = found
        return Advice(method, step, spp, expected, value, stderr, heavy)

    def __repr__(self) -> str:
        rows = [f"{'method':24} {'spp':>6} {'seconds':>8} {'slope':>15} {'bias':>9} {'noise':>7}"]
        for s in self.settings:
            name = s.method if s.step is None else f"{s.method} {s.step:.1e}"
            if s.note:
                rows.append(f"{name:24} {s.note}")
                continue
            bias = f"{'' if s.bias_is_resolved else '< '}{100 * s.bias:.2g}%"
            slope = f"{s.slope:.3f} ± {s.slope_stderr:.3f}"
            rows.append(f"{name:24} {s.spp:6} {s.seconds:8.3f} {slope:>15} {bias:>9} {100 * s.noise:6.2g}%")
        return "\n".join(["<volume3d.Tuning", *("  " + row for row in rows), f"  reference: {self.reference}>"])


def tune(
    scene: Scene,
    change: Mapping[str, ArrayLike],
    *,
    seconds: float = 60.0,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = None,
) -> Tuning:
    """Measures bias, noise and time of every method of `forward` on a scene, and finds the best for a purpose.

    Each method is run 16 times along `change` with 1, 4, 16, ... samples per pixel and compared with the better
    of two unbiased methods. The study takes about `seconds`; with `spp`, the largest number of samples per
    pixel, time decides nothing, and all numbers but times have the same bits for the same seed.

    >>> best = v3.tune(scene, change).best(error=0.05)                # doctest: +SKIP
    >>> along = v3.forward(scene, change, **best.options)             # doctest: +SKIP

    Raises `ParameterError` for unknown names, `GradientError` if the derivative is 0 everywhere or hidden by
    noise, or if the time is too short for every method.
    """
    core, most = _scene(scene), None if spp is None else _spp(spp)
    limit = _positive(seconds, "seconds")
    with _Report(progress, "tune") as report:
        return Tuning(_core.Tuning(core, along(scene, change), limit, most, _seed(seed), report))


def _positive(value: ArrayLike | None, what: str) -> float:
    if value is None:
        raise TypeError(f"{what} must be a number, not None")
    number = float(shaped(value, (), what))
    if not 0 < number < math.inf:
        raise ValueError(f"{what} must be positive and finite, not {number}")
    return number
