"""Pictures by Matplotlib."""

import math

import numpy as np
import pytest

import volume3d as v3
from volume3d.plot import scale, show, show_gradient

plt = pytest.importorskip("matplotlib.pyplot", reason="Matplotlib is not installed")


@pytest.fixture(autouse=True)
def without_windows():
    plt.switch_backend("Agg")
    yield
    plt.close("all")


def grey(values):
    return np.repeat(np.asarray(values, float)[None, :, None], 3, axis=2)


def test_signed_colours_are_those_of_signed_files():
    picture = show_gradient(grey([-2, 0, 2, 9, math.nan]), limit=2).images[0]
    colours = picture.to_rgba(picture.get_array(), bytes=True)[0, :, :3]
    # The ends of Brewer's RdBu, clipped; NaN is yellow.
    np.testing.assert_array_equal(
        colours, [[5, 48, 97], [255, 255, 255], [103, 0, 31], [103, 0, 31], [255, 210, 0]]
    )


def test_the_scale_is_a_quantile_and_the_colour_bar_says_so():
    gradient = grey([0] * 1000 + list(range(1, 1001)))
    assert scale(gradient) == 995 and scale(0 * gradient) == 0
    assert scale(gradient, 10 * gradient) == 9900
    axes = show_gradient(gradient)
    assert axes.images[0].get_clim() == (-995, 995)
    assert "99.5 %" in axes.figure.axes[1].get_ylabel()
    assert show_gradient(np.zeros((2, 3)), limit=3, label="standard errors").images[0].get_clim() == (-3, 3)


def test_images_are_shown_as_srgb(scene):
    image = v3.render(scene, spp=4)
    axes = show(image, title="I")
    assert axes.get_title() == "I" and axes.images[0].get_array().shape == image.shape
    # Linear 0.5 is 188 of 255.
    shown = show(np.full((2, 2, 3), 0.5)).images[0].get_array()
    np.testing.assert_allclose(shown, 188 / 255, rtol=0, atol=0.003)


def test_mistakes_are_named():
    with pytest.raises(ValueError, match="shape"):
        show(np.ones((4, 4)))
    with pytest.raises(ValueError, match="limit"):
        show_gradient(np.ones((4, 4, 3)), limit=0)
