"""What a first study takes from the recordings: errors of a compass, and a heading that was smoothed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.data import Trial
from seatrial.ships.files import load
from seatrial.study.drafting.draft import _free
from seatrial.study.drafting.instruments import deviation, smoothed
from seatrial.study.drafting.text import OWN

DEG = math.pi / 180.0


def sailed(
    *, compass: float = 0.0, at: float = 0.0, current: tuple[float, float] = (0.0, 0.0), speeds: bool = True
) -> Trial:
    """Circles of a craft without leeway, its speed rising and falling, read with noise.

    Args:
        compass: amplitude of what the compass reads too much [rad], largest on the heading `at`.
        current: north and east [m/s].
        speeds: whether the speed changes.
    """
    rng, dt = np.random.default_rng(4), 0.2
    t = dt * np.arange(3000)
    psi, U = 0.1 * t, 2.0 + (1.2 * np.sin(0.037 * t) if speeds else 0.0 * t)
    north, east = U * np.cos(psi) + current[0], U * np.sin(psi) + current[1]
    read = psi + compass * np.cos(psi - at) + rng.normal(0.0, 0.002, t.size)
    u, v = north * np.cos(read) + east * np.sin(read), east * np.cos(read) - north * np.sin(read)
    noise = rng.normal(0.0, 0.05, (5, t.size))
    return Trial("log", t, {
        "x": np.cumsum(north) * dt + noise[0], "y": np.cumsum(east) * dt + noise[1], "psi": read, "u": u + noise[2],
        "v_m": v + noise[3], "r": 0.1 + 0.02 * noise[4]})  # fmt: skip


@pytest.mark.parametrize("at", [0.0, 50.0 * DEG, 200.0 * DEG])
@pytest.mark.parametrize("current", [(0.0, 0.0), (0.2, -0.1)])
def test_the_amplitude_of_a_deviation_is_found_beside_a_current(at: float, current: tuple[float, float]) -> None:
    """To first order: what is left is the product of the deviation and the current, over the speed."""
    found = deviation([sailed(compass=8.0 * DEG, at=at, current=current)])
    assert found == pytest.approx(8.0 * DEG, rel=0.02 + math.hypot(*current) / 2.0)


def test_going_astern_the_compass_is_the_same() -> None:
    ahead = sailed(compass=8.0 * DEG)
    back = replace(ahead, channels={**ahead.channels, "u": -ahead["u"], "v_m": -ahead["v_m"]})
    assert deviation([ahead, back]) == pytest.approx(8.0 * DEG, rel=0.05)


@pytest.mark.parametrize("log", [
    sailed(), sailed(current=(0.5, 0.3)), sailed(compass=1.0 * DEG), sailed(compass=8.0 * DEG, speeds=False),
    sailed(compass=8.0 * DEG).rows(slice(0, 90)),  # less than one part of the circle
])  # fmt: skip
def test_what_a_current_explains_or_is_too_small_is_no_deviation(log: Trial) -> None:
    assert deviation([log]) == 0.0


def filtered(log: Trial, rows: int) -> Trial:
    """The heading as means over so many rows, twice, as a logger smooths it."""
    psi, mean = log["psi"], np.ones(rows) / rows
    for _ in range(3):
        psi = np.convolve(np.pad(psi, rows // 2, mode="reflect", reflect_type="odd"), mean, "valid")
    return replace(log, channels={**log.channels, "psi": psi})


def test_a_smoothed_heading_lets_track_and_heading_count_as_a_model_can_be_right() -> None:
    log = sailed()
    assert smoothed([log], 10.0) == {}
    found = smoothed([filtered(log, 25)], 10.0)
    assert set(found) == {"x", "y", "psi"}  # speeds and rates of such a log are made of these
    assert found["psi"] == pytest.approx(0.005 * 0.1 * 10.0, rel=0.01)  # half a per cent of a radian
    assert smoothed([filtered(log, 25)], 4.0) == {}  # 0.4 rad: the carriage of a tank reads as finely
    for name in ("x", "y"):  # one scale for both: the mean speed and its swing, over the root of two
        assert found[name] == pytest.approx(math.hypot(0.05, 0.005 * 2.15 * 10.0 / math.sqrt(2.0)), rel=0.1)


def test_thrusters_that_work_are_free_as_far_as_the_recordings_show() -> None:
    boat, t = load("blueboat"), np.arange(100.0)
    both = Trial("log", t, {"throttle_port": 0.5 * np.sin(t), "throttle_starboard": np.full(100, 0.3)})
    free = {path: prior for _, prior, paths in _free(boat, [both], ()) for path in paths}
    assert free["thrusters.port.T_1"] == free["thrusters.starboard.astern"] == OWN  # its file has their sigmas
    ahead = replace(both, channels={name: np.abs(values) for name, values in both.channels.items()})
    assert not any(path.endswith(("astern", "against")) for _, _, paths in _free(boat, [ahead], ()) for path in paths)
    one = replace(both, channels={**both.channels, "throttle_port": np.zeros(100)})
    assert not any("port" in path for _, _, paths in _free(boat, [one], ()) for path in paths)


def test_own_priors_are_written_one_by_one_where_a_pattern_takes_numbers_without_them() -> None:
    boat, t = load("blueboat"), np.arange(100.0)
    log = Trial("log", t, {"throttle_port": 0.5 * np.sin(t), "throttle_starboard": 0.5 * np.cos(t)})
    entries = {pattern: paths for pattern, _, paths in _free(boat, [log], ())}
    assert entries["damping.X_uu"] == ("damping.X_uu",)
    assert values(boat.model)["damping.X_uuu"] == 0.0
    assert "damping.X_*" not in entries
    assert entries["thrusters.*.T_[12]"] == tuple(
        f"thrusters.{side}.T_{k}" for side in ("port", "starboard") for k in (1, 2)
    )
