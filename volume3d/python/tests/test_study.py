"""`check`, `lint` and `tune`."""

import numpy as np
import pytest

import volume3d as v3
from conftest import HALVES, SQUARE, lit_square

ALONG = {"square.translation": [1.0, 0.5, 0.0]}


def test_check_tells_right_from_wrong(scene):
    seen = []
    found = v3.check(scene, ALONG, spp=1024, method="edge", seed=1, progress=lambda *steps: seen.append(steps))
    assert found.agrees and found.within <= 0.1 and found.method == "edge", found
    assert seen[-1] == (6 * 16, 6 * 16)
    assert len(found.slopes) == 5 and found.slopes[0].bias == np.inf
    assert [s.step for s in found.slopes] == sorted((s.step for s in found.slopes), reverse=True)
    assert "agrees within" in repr(found)
    interior = v3.check(scene, ALONG, spp=256, method="interior", seed=1)
    assert interior.verdict == "differs" and interior.by > 0.3, interior


def test_check_says_what_would_decide(scene):
    found = v3.check(scene, ALONG, spp=16, method="edge", steps=[0.02, 0.01])
    assert found.verdict == "open" and found.within > 0.1 and not found.agrees
    assert found.spp_needed is None or found.spp_needed > 16
    hidden = lit_square()
    found = v3.check(hidden, {"lamp.rotation": [0.0, 0.0, 0.0]}, spp=16, method="warped-area")
    assert found.verdict == "nothing changes" and found.within is None


def test_check_refuses_what_it_cannot_compare(scene):
    with pytest.raises(v3.GradientError, match="the reference of a check"):
        v3.check(scene, ALONG, method="finite-difference")
    with pytest.raises(v3.GradientError, match="closest first"):
        v3.check(scene, ALONG, method="edges")
    with pytest.raises(v3.ParameterError, match="empty"):
        v3.check(scene, {})
    with pytest.raises(ValueError, match="positive"):
        v3.check(scene, ALONG, steps=[0.1, 0.0])
    dark = {"paint.reflectance": [-1.0, -1.0, -1.0]}
    v3.traverse(scene).update({"paint.reflectance": [0.0, 0.3, 0.2]})
    found = v3.check(scene, dark, spp=64)
    assert any("backward" in warning or "forward" in warning for warning in found.warnings), found.warnings


def test_lint_lists_findings_by_shape(scene):
    found = v3.lint(scene)
    assert not any(finding.is_wrong for finding in found)
    borders = [finding for finding in found if finding.kind == "mesh" and finding.shapes == ("square",)]
    assert any("border edges" in finding.message and "close" in finding.advice for finding in borders)
    assert str(found[0]).startswith("hint: ")
    table = lit_square()
    touching = v3.scene_from_arrays(
        {"a": v3.Mesh(SQUARE, HALVES), "b": v3.Mesh(0.5 * SQUARE, HALVES)},
        origin=[0, 0, 4], target=[0, 0, 0], size=(8, 8), sky=1,
    )
    contacts = [finding for finding in v3.lint(touching) if finding.kind == "contact"]
    assert contacts and set(contacts[0].shapes) == {"a", "b"} and not contacts[0].is_wrong
    parted = [f for f in v3.lint(touching, {"b.translation": [0, 0, 1.0]}) if f.kind == "contact"]
    assert parted and parted[0].is_wrong
    assert not [f for f in v3.lint(touching, {"b.translation": [1.0, 0, 0]}) if f.is_wrong]
    assert not [f for f in v3.lint(table, ALONG) if f.is_wrong]
    unlit = v3.scene_from_arrays({"a": v3.Mesh(SQUARE, HALVES)}, origin=[0, 0, 4], target=[0, 0, 0], size=(8, 8))
    assert [f.shapes for f in v3.lint(unlit) if f.kind == "unlit"] == [()]


def test_tune_finds_what_is_biased_and_recommends_what_is_not(scene):
    seen = []
    tuning = v3.tune(scene, ALONG, spp=16, seed=3, progress=lambda *steps: seen.append(steps))
    by_method = {s.method: s for s in tuning.settings if s.step is None}
    assert set(by_method) == set(v3.METHODS) - {"finite-difference"}
    assert {s.step for s in tuning.settings if s.method == "finite-difference"} - {None}
    interior, edge = by_method["interior"], by_method["edge"]
    assert interior.bias_is_resolved and interior.slope < 1 - 4 * interior.slope_stderr and not interior.unbiased
    assert edge.unbiased and abs(edge.slope - 1) < 4 * edge.slope_stderr < 0.8 and edge.spp == 16
    assert seen[-1][0] > 0 and tuning.seconds > 0
    assert "interior" in repr(tuning) and "reference" in repr(tuning)
    assert tuning.filters["tent"] == 1.0
    best = tuning.best(error=0.1)
    assert best.method in v3.METHODS and best.error <= 0.1
    along = v3.forward(scene, ALONG, **best.options)
    assert along.gradient.any()
    assert tuning.best(error=1e-9) is None and tuning.best(seconds=1e-9) is None
    assert tuning.best(seconds=10.0).error < 0.2
    again = v3.tune(scene, ALONG, spp=16, seed=3)
    assert [s.noise for s in again.settings] == pytest.approx([s.noise for s in tuning.settings], rel=0, nan_ok=True)


def test_tune_lists_refusals_and_says_what_cannot_be_tuned(scene):
    for options in ({}, {"seconds": 1, "error": 1}):
        with pytest.raises(ValueError, match="either"):
            v3.tune(scene, {"paint.reflectance": [1.0, 1, 1]}, spp=1).best(**options)
    with pytest.raises(ValueError, match="positive"):
        v3.tune(scene, ALONG, seconds=0)
    with pytest.raises(v3.GradientError, match="exactly 0"):
        v3.tune(scene, {"lamp.rotation": [0.0, 0.0, 0.0]}, spp=1)
    with pytest.raises(v3.GradientError, match="nothing was measured|hides the gradient"):
        v3.tune(scene, ALONG, seconds=1e-9)


def test_a_study_is_cancelled_by_its_callback(scene):
    def cancel(done, total):
        raise RuntimeError("enough")

    for study in (v3.check, v3.tune):
        with pytest.raises(RuntimeError, match="enough"):
            study(scene.seen(size=(128, 128)), ALONG, spp=1 << 16, progress=cancel)
