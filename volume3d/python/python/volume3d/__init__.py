"""Images and their unbiased derivatives with respect to geometry, by warped-area sampling.

>>> import volume3d as v3
>>> scene = v3.load_file("table.xml", size=(64, 48))            # doctest: +SKIP
>>> params = v3.traverse(scene)                                 # doctest: +SKIP
>>> image = v3.render(scene, spp=64)                            # doctest: +SKIP
>>> along = v3.forward(scene, {"block.translation": [1, 0, 0]}, spp=64)   # doctest: +SKIP
>>> gradient = v3.reverse(scene, params, adjoint, spp=16)       # doctest: +SKIP

========================  =====================================================================
`load_file`               scene from a Mitsuba XML file
`load_string`             scene from text
`scene_from_arrays`       scene from meshes, materials and lights as arrays
`traverse`                parameters of a scene, by name
`render`                  image of a scene, with its standard error
`forward`                 derivative of every pixel along a change of parameters
`reverse`                 gradient of a number by all parameters, from its derivative by the image
`Views`                   pictures with cameras, of NeRF, COLMAP, DTU and Mitsuba files
`Fit`                     fit of parameters to pictures
`compare`                 comparison of somebody else's gradient with ours
`check`                   comparison of a gradient with central finite differences
`lint`                    problems of a scene for gradients, with advice
`tune`                    bias, noise and time of every method, and the best for a time or an error
`volume3d.plot`           images and signed gradient images by Matplotlib
`volume3d.torch`          renderer as a differentiable function of PyTorch
`volume3d.jax`            renderer as a differentiable function of JAX
========================  =====================================================================

Images are arrays of shape (height, width, 3) of linear RGB, rows from the top. Lengths are in scene units,
angles of rotation vectors in radians, fields of view in degrees. All exceptions are subclasses of `Error`.
"""

from ._camera import Camera
from ._compare import Comparison, compare
from ._core import (
    Error,
    FitError,
    GradientError,
    InternalError,
    ParameterError,
    SceneError,
    __version__,
    num_threads,
    set_num_threads,
)
from ._estimate import METHODS, forward, render, reverse
from ._fit import Adam, Fit, Penalty
from ._parameters import Parameters, traverse
from ._results import Gradient, GradientImage, Rendering
from ._scene import Mesh, Scene, load_file, load_string, read_image, scene_from_arrays, write_image
from ._study import Advice, Check, Finding, Setting, Slope, Tuning, check, lint, tune
from ._views import View, Views

__all__ = [
    "METHODS",
    "Adam",
    "Advice",
    "Camera",
    "Check",
    "Comparison",
    "Error",
    "Finding",
    "Fit",
    "FitError",
    "Gradient",
    "GradientError",
    "GradientImage",
    "InternalError",
    "Mesh",
    "ParameterError",
    "Parameters",
    "Penalty",
    "Rendering",
    "Scene",
    "SceneError",
    "Setting",
    "Slope",
    "Tuning",
    "View",
    "Views",
    "__version__",
    "check",
    "compare",
    "forward",
    "lint",
    "load_file",
    "load_string",
    "num_threads",
    "read_image",
    "render",
    "reverse",
    "scene_from_arrays",
    "set_num_threads",
    "traverse",
    "tune",
    "write_image",
]
