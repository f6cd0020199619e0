"""Scenes of the tests."""

import numpy as np
import pytest

import volume3d as v3

SQUARE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def lit_square(size=(24, 20)):
    """A square before a wall that it shades, lit by a lamp and a grey sky."""
    turned = np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]])
    return v3.scene_from_arrays(
        {
            "square": v3.Mesh(0.4 * SQUARE + [0, 0, 0.5], HALVES, material="paint"),
            "wall": v3.Mesh(3 * SQUARE, HALVES, material="paper"),
            "lamp": v3.Mesh(0.3 * SQUARE @ turned + [0.8, 0.6, 3], HALVES, radiance=12),
        },
        origin=[0, 0, 4],
        target=[0, 0, 0],
        fov=30,
        size=size,
        materials={
            "paint": {"type": "diffuse", "reflectance": [0.8, 0.3, 0.2]},
            "paper": {"type": "diffuse", "reflectance": 0.6},
        },
        sky=0.2,
        max_depth=2,
    )


@pytest.fixture
def scene():
    return lit_square()
