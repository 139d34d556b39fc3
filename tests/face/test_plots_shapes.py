"""The shape of figures, the order of rows, and where the residuals of several trials stand."""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.face import plots

matplotlib.use("Agg")
from matplotlib import pyplot


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    pyplot.close("all")


@pytest.mark.parametrize(
    ("north", "east", "ratio"),
    [(100.0, 100.0, 1.0), (100.0, 130.0, 1.3), (100.0, 95.0, 0.95), (500.0, 1.0, 0.9), (1.0, 500.0, 1.6)],
)
def test_a_figure_has_the_shape_of_its_track_within_limits(north: float, east: float, ratio: float) -> None:
    width, height = plots._shape(np.array([0.0, north]), np.array([3.0, 3.0 + east]))
    assert width / height == pytest.approx(ratio)
    assert max(width, height) == pytest.approx(6.4)


def test_rows_are_motion_then_controls_of_one_unit_together() -> None:
    names = ("n_P", "delta_1", "r", "delta_2", "delta_1_cmd", "u", "alpha_1", "f_1", "psi", "U_T")
    units = {"delta_1": "rad", "delta_2": "rad", "alpha_1": "rad", "f_1": "N"}
    trial = Trial("x", np.arange(3.0), {name: np.zeros(3) for name in names}, units)
    rows = plots._usual(trial)
    assert rows == [("psi",), ("u",), ("r",), ("n_P",), ("delta_1", "delta_2", "alpha_1"), ("f_1",)]


def residuals(names: tuple[str, ...], lengths: tuple[float, ...]) -> Any:
    """Residuals that rise with the time in their own trial, whose clocks begin anywhere."""
    found = {}
    for k, (name, length) in enumerate(zip(names, lengths, strict=True)):
        t = 100.0 * k + np.linspace(0.0, length, 5)
        found[name] = SimpleNamespace(t=t, values={"psi": 0.1 * (t - t[0]), **({"u": 0.0 * t} if k else {})})
    told = SimpleNamespace(noise=math.radians(0.5), size=1.234)
    return SimpleNamespace(channels={"psi": told, "u": SimpleNamespace(noise=0.02, size=3.0)}, residuals=found)


def test_residuals_stand_one_trial_after_the_other() -> None:
    found = residuals(("a", "b"), (40.0, 60.0))
    heading, speed = plots.residuals(found)
    dots = [line for line in heading.lines if line.get_marker() == "."]
    np.testing.assert_allclose(dots[0].get_xdata(), np.linspace(0.0, 40.0, 5))
    np.testing.assert_allclose(dots[1].get_xdata(), 40.0 + np.linspace(0.0, 60.0, 5))
    np.testing.assert_allclose(dots[1].get_ydata(), 0.1 * np.linspace(0.0, 60.0, 5))
    assert len([line for line in speed.lines if line.get_marker() == "."]) == 1
    rules = [line.get_xdata()[0] for line in heading.lines if line.get_marker() != "."]
    assert rules == [0.0, 40.0]
    box = heading.patches[0].get_extents() if heading.patches[0].get_transform() is None else heading.patches[0]
    assert (box.get_y(), box.get_y() + box.get_height()) == (-2.0, 2.0)
    said = [text.get_text() for text in heading.texts]
    assert "sensor noise 0.5 deg, residuals 1.2 times" in said
    assert {"a", "b"} <= set(said)
    assert "sensor noise 0.02 m/s, residuals 3 times" in [text.get_text() for text in speed.texts]


@pytest.mark.parametrize(
    ("names", "lengths", "shown"),
    [
        (("turn", "zigzag"), (50.0, 50.0), {"turn": 0.0, "zigzag": 50.0}),
        (("turn", "z" * 39), (50.0, 50.0), {"turn": 0.0, "z" * 39: 50.0}),
        (("turn", "z" * 41), (50.0, 50.0), {"1": 0.0, "2": 50.0}),
        (("turn", "zigzag"), (99.0, 1.0), {}),
        (("turn", "zigzag"), (98.0, 2.0), {"1": 0.0, "2": 98.0}),
    ],
)
def test_trials_are_named_where_their_names_have_room(names: Any, lengths: Any, shown: dict[str, float]) -> None:
    """80 letters over the whole width, in proportion to the length of each trial."""
    found = residuals(names, lengths)
    assert plots._named(plots._places(found), found) == pytest.approx(shown)


def test_outlines_stand_at_even_distances_along_the_way() -> None:
    """A ship that slows down: five outlines at quarters of the way, not of the time."""
    t = np.linspace(0.0, 10.0, 1001)
    way = 1000.0 * (1.0 - (1.0 - t / 10.0) ** 2)
    trial = Trial("x", t, {"x": way, "y": 0.0 * t, "psi": 0.0 * t}, meta={"L_pp": 100.0})
    ax = plots.track(trial, outlines=5)
    middles = sorted(0.5 * (patch.get_xy()[:, 1].min() + patch.get_xy()[:, 1].max()) for patch in ax.patches)
    np.testing.assert_allclose(middles, [0.0, 250.0, 500.0, 750.0, 1000.0], atol=6.0)
    breadths = [np.ptp(patch.get_xy()[:, 0]) for patch in ax.patches]
    np.testing.assert_allclose(breadths, 100.0 / 6.0)
    labels = [text.get_text() for text in ax.get_legend().get_texts() if "outline" in text.get_text()]
    assert labels == ["outline, true size"]
    far = plots.track(Trial("y", t, {"x": 7.0 * way, "y": 0.0 * t, "psi": 0.0 * t}, meta={"L_pp": 100.0}), outlines=2)
    assert np.ptp(far.patches[0].get_xy()[:, 1]) == pytest.approx(400.0), "a twentieth of 7000 m is 350 m: four times"
