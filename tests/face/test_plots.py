"""Pictures: where things are drawn, in which unit, and what cannot be drawn."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

import matplotlib
import numpy as np
import pytest

import seatrial as st
from seatrial.data import DataError
from seatrial.face import plots

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.figure import Figure

L, B = 100.0, 20.0


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    pyplot.close("all")


def straight(psi: float = 0.0, way: float = 600.0, **meta: object) -> st.Trial:
    """A ship that goes straight on at a heading."""
    t = np.linspace(0.0, 100.0, 101)
    along = way * t / 100.0
    channels = {"x": along * math.cos(psi), "y": along * math.sin(psi), "psi": np.full(101, psi),
                "u": np.full(101, way / 100.0), "delta": np.full(101, 0.1), "n_P": np.full(101, 1.5)}  # fmt: skip
    return st.Trial("run", t, channels, meta={"L_pp": L, **meta})


def outlines(ax: object) -> list[np.ndarray]:
    """Corners of the outlines, shape (corners, 2): east, north."""
    return [patch.get_xy()[:-1] for patch in ax.patches]  # type: ignore[attr-defined]


@pytest.mark.slow
def test_a_track_is_north_up_at_equal_scale_with_units() -> None:
    ax = straight().plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("east y [m]", "north x [m]")
    assert ax.get_aspect() == 1.0
    east, north = ax.lines[0].get_data()
    assert (east[-1], north[-1]) == (0.0, 600.0)
    assert [text.get_text() for text in ax.texts if text.get_text()] == ["N"]
    ax.figure.draw_without_rendering()
    (low, high), (left, right) = ax.get_ylim(), ax.get_xlim()
    box = ax.get_window_extent()
    assert (high - low) / box.height == pytest.approx((right - left) / box.width, rel=1e-3)


@pytest.mark.parametrize("psi", [0.0, math.pi / 2, math.radians(-120.0)])
def test_an_outline_lies_along_the_heading_bow_ahead(psi: float) -> None:
    ax = straight(psi).plot(outlines=2)
    corners = outlines(ax)[0]
    ahead = corners @ np.array([math.sin(psi), math.cos(psi)])
    aside = corners @ np.array([math.cos(psi), -math.sin(psi)])
    assert (ahead.max(), ahead.min()) == (pytest.approx(0.5 * L), pytest.approx(-0.5 * L))
    assert aside.max() == pytest.approx(-aside.min())
    assert aside[np.argmax(ahead)] == pytest.approx(0.0, abs=1e-9)  # the bow is pointed, the stern is not
    assert np.ptp(aside) == pytest.approx(L / 6.0)


@pytest.mark.slow
def test_outlines_are_true_or_say_that_they_are_not() -> None:
    near, far = straight().plot(), straight(way=6000.0).plot()
    assert near.get_legend().get_texts()[-1].get_text() == "outline, true size"
    assert far.get_legend().get_texts()[-1].get_text() == "outline, 3 times its size"
    assert np.ptp(outlines(far)[0][:, 1]) == pytest.approx(3.0 * L)
    assert not outlines(straight().plot(outlines=0))
    assert not outlines(st.Trial("no length", straight().t, straight().channels).plot())


def test_a_run_has_the_breadth_of_its_ship() -> None:
    ship = st.load("kvlcc2_l7")
    run = ship.simulate(st.Turning(), dt=0.1)
    first = outlines(run.plot(outlines=2))[0]
    assert np.ptp(first[:, 0]) == pytest.approx(1.27, rel=0.01)  # its file
    assert np.ptp(first[:, 1]) == pytest.approx(7.0, rel=1e-6)


def test_axes_of_the_caller_are_drawn_on_and_stay_the_callers() -> None:
    ax = Figure().add_subplot()
    assert straight().plot(ax, label="first") is ax
    straight(0.3).plot(ax, label="second")
    assert ax.get_legend() is None
    assert [h.get_label() for h in ax.get_legend_handles_labels()[0]] == ["first", "second"]
    assert not pyplot.get_fignums()
    axes = Figure().subplots(2)
    assert straight().plot_series("u", "psi", axes=axes)[0] is axes[0]
    with pytest.raises(DataError, match="1 axes for 2 rows"):
        straight().plot_series("u", "psi", axes=ax)


def test_series_are_in_degrees_with_units() -> None:
    trial = straight(math.radians(30.0))
    top, low = trial.plot_series(("psi", "delta"), "u")
    assert (top.get_ylabel(), low.get_ylabel(), low.get_xlabel()) == ("psi, delta [deg]", "u [m/s]", "time t [s]")
    assert top.lines[0].get_ydata()[0] == pytest.approx(30.0)
    assert [ax.get_ylabel() for ax in trial.plot_series()] == ["psi [deg]", "u [m/s]", "delta [deg]", "n_P [1/s]"]


def test_the_style_of_the_caller_is_left_alone() -> None:
    before = dict(matplotlib.rcParams)
    straight().plot()
    assert dict(matplotlib.rcParams) == before


def test_without_the_library_new_axes_name_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r"pip install 'seatrial\[plots\]'"):
        plots._made(1, (4.0, 3.0))


def test_what_cannot_be_drawn_is_told() -> None:
    trial = straight()
    with pytest.raises(DataError, match=r"psi \[rad\], u \[m/s\] in one row"):
        trial.plot_series(("psi", "u"))
    with pytest.raises(DataError, match="no channel 'phi'"):
        trial.plot_series("phi")
    with pytest.raises(DataError, match="no position x, y; plot_series"):
        st.Trial("dry", trial.t, {"u": trial["u"]}).plot()
    with pytest.raises(DataError, match="no row has a position"):
        trial.having(x=np.full(101, np.nan)).plot()


def test_a_prediction_is_drawn_with_a_gap_at_each_restart() -> None:
    """No line joins where one prediction ends and the measured state from which the next begins."""
    t = np.arange(0.0, 10.0, 0.5)
    leap = np.where(t < 4.0, t, t + 50.0)
    trial = st.Trial("a", t, {"x": leap, "y": 0.0 * t, "psi": 0.0 * t}, meta={"restart": 4.0})
    drawn = trial.plot(outlines=0).lines[0].get_xydata()
    broken = np.flatnonzero(np.isnan(drawn[:, 1]))
    assert broken.tolist() == [8, 17]
    assert np.nanmax(np.abs(np.diff(drawn[:, 1]))) == pytest.approx(0.5)
    [ax] = trial.plot_series("x")
    assert np.nanmax(np.abs(np.diff(ax.lines[0].get_ydata()))) == pytest.approx(0.5)
