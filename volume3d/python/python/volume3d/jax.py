"""The renderer as a differentiable function of JAX, also within `jax.jit`.

>>> from volume3d.jax import renderer                                # doctest: +SKIP
>>> image = renderer(scene, spp=16)                                  # doctest: +SKIP
>>> loss = lambda x, seed: ((image(x, seed) - target) ** 2).mean()   # doctest: +SKIP
>>> jax.grad(loss)({"block.translation": jnp.zeros(3)}, 0)           # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ._estimate import render, reverse
from ._parameters import traverse
from ._scene import Scene

__all__ = ["renderer"]


def renderer(
    scene: Scene, *, spp: int = 16, spp_grad: int | None = None, method: str = "auto"
) -> Callable[[dict[str, Any], Any], Any]:
    """A function of values by name and a seed that returns the image (height, width, 3), differentiable by the
    values in reverse mode.

    The scene itself stays as it is. Image and gradient use independent samples, `spp` and `spp_grad` (default
    `spp`) per pixel. Gradients by a rotation vector are those by a further turn: take steps by
    `Parameters.retract`.
    """
    scene = scene.copy()
    shape = jax.ShapeDtypeStruct(scene.shape, jnp.float32)

    def at(values: dict[str, Any]) -> Scene:
        moved = scene.copy()
        traverse(moved).update({name: np.asarray(value, np.float64) for name, value in values.items()})
        return moved

    def image_of(values: dict[str, Any], seed: Any) -> Any:
        return render(at(values), spp=spp, seed=int(seed)).image.astype(np.float32)

    def gradient_of(values: dict[str, Any], seed: Any, adjoint: Any) -> dict[str, Any]:
        found = reverse(
            at(values),
            list(values),
            np.asarray(adjoint, np.float64),
            spp=spp if spp_grad is None else spp_grad,
            seed=int(seed),
            method=method,
        )
        return {name: found[name].astype(np.asarray(value).dtype) for name, value in values.items()}

    @jax.custom_vjp
    def image(values: dict[str, Any], seed: Any) -> Any:
        return jax.pure_callback(image_of, shape, values, seed)

    def ahead(values: dict[str, Any], seed: Any) -> Any:
        return image(values, seed), (values, seed)

    def back(saved: Any, adjoint: Any) -> Any:
        values, seed = saved
        shapes = {name: jax.ShapeDtypeStruct(jnp.shape(v), jnp.result_type(v)) for name, v in values.items()}
        return jax.pure_callback(gradient_of, shapes, values, seed, adjoint), None

    image.defvjp(ahead, back)
    return image  # type: ignore[no-any-return]
