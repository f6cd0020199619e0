"""The renderer as a differentiable function of PyTorch.

>>> from volume3d.torch import render                                # doctest: +SKIP
>>> x = {name: torch.tensor(value, requires_grad=True) for name, value in params.items()}   # doctest: +SKIP
>>> image = render(scene, x, spp=16, spp_grad=8, seed=step)         # doctest: +SKIP
>>> ((image - target) ** 2).mean().backward()                       # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from ._estimate import render as _render
from ._estimate import reverse
from ._parameters import Parameters, traverse
from ._scene import Scene

__all__ = ["Retracted", "render"]


class _Render(torch.autograd.Function):
    """The scene is copied with the values of each call, so that several calls may precede a backward pass."""

    @staticmethod
    def forward(ctx: Any, scene: Scene, names: list[str], options: dict[str, Any], *values: torch.Tensor) -> Any:
        scene = scene.copy()
        arrays = {name: value.detach().cpu().double().numpy() for name, value in zip(names, values, strict=True)}
        traverse(scene).update(arrays)
        ctx.scene, ctx.names, ctx.options = scene, names, options
        ctx.likes = [(value.dtype, value.device) for value in values]
        image = _render(scene, spp=options["spp"], seed=options["seed"]).image
        return torch.from_numpy(image).to(values[0].dtype).to(values[0].device)

    @staticmethod
    def backward(ctx: Any, adjoint: torch.Tensor) -> Any:
        options = ctx.options
        found = reverse(
            ctx.scene,
            ctx.names,
            adjoint.detach().cpu().double().numpy(),
            spp=options["spp_grad"],
            seed=options["seed"],
            method=options["method"],
        )
        gradients = (
            torch.from_numpy(np.array(found[name])).to(dtype).to(device)
            for name, (dtype, device) in zip(ctx.names, ctx.likes, strict=True)
        )
        return None, None, None, *gradients


def render(
    scene: Scene,
    values: Mapping[str, torch.Tensor],
    *,
    spp: int = 16,
    spp_grad: int | None = None,
    seed: int = 0,
    method: str = "auto",
) -> torch.Tensor:
    """The image (height, width, 3) of a scene whose parameters have `values`, differentiable by them.

    The scene itself stays as it is. Image and gradient use independent samples, `spp` and `spp_grad` (default
    `spp`) per pixel: the gradient of a function of the image is unbiased if the seed is new in every step, apart
    from a nonlinearity of the function's derivative.

    Gradients by a rotation vector are those by a further turn: use `Retracted` or `Parameters.retract` for
    steps.
    """
    if not values:
        raise ValueError("values is empty: name at least one parameter")
    options = {"spp": spp, "spp_grad": spp if spp_grad is None else spp_grad, "seed": seed, "method": method}
    return _Render.apply(scene, list(values), options, *values.values())  # type: ignore[no-any-return]


class Retracted:
    """A PyTorch optimiser whose steps are taken by `Parameters.retract`: rotations are composed, and bounds are
    kept.

    `optimizer` is made for tensors of steps, which are 0 before each step:

    >>> opt = Retracted(scene, x, lambda tensors: torch.optim.Adam(tensors, lr=0.02))  # doctest: +SKIP
    """

    def __init__(self, scene: Scene, values: Mapping[str, torch.Tensor], optimizer: Any) -> None:
        self._params: Parameters = traverse(scene.copy())
        self._values = dict(values)
        self._steps = {name: torch.zeros_like(value, requires_grad=True) for name, value in values.items()}
        self.optimizer: torch.optim.Optimizer = optimizer(list(self._steps.values()))

    def zero_grad(self) -> None:
        """Clears the gradients."""
        for tensor in self._values.values():
            tensor.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Takes a step down the gradients of the values."""
        for name, value in self._values.items():
            self._steps[name].zero_()
            self._steps[name].grad = None if value.grad is None else value.grad.clone()
        self.optimizer.step()
        arrays = {name: value.detach().cpu().double().numpy() for name, value in self._values.items()}
        self._params.update(arrays)
        steps = {name: step.detach().cpu().double().numpy() for name, step in self._steps.items()}
        self._params.retract(steps)
        for name, value in self._values.items():
            value.copy_(torch.from_numpy(self._params[name]).to(value.dtype))

