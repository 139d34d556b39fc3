"""What a first study takes from the recordings: errors of a compass, and a heading that was smoothed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.data import Trial
from seatrial.identify.trajectory.suspects import suspects
from seatrial.ships.files import load
from seatrial.study.drafting.draft import _free
from seatrial.study.drafting.instruments import shared, smoothed
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


@pytest.mark.parametrize(("log", "told"), [
    (sailed(compass=8.0 * DEG), True), (sailed(compass=8.0 * DEG, at=200.0 * DEG, current=(0.2, -0.1)), True),
    (sailed(), False), (sailed(current=(0.5, 0.3)), False), (sailed(compass=1.0 * DEG), False),
    (sailed(compass=8.0 * DEG, speeds=False), False),  # at one speed a current is the same
    (sailed(compass=8.0 * DEG).rows(slice(0, 90)), False),  # less than one part of the circle
])  # fmt: skip
def test_a_compass_is_estimated_where_its_deviation_shows(log: Trial, told: bool) -> None:
    errors = {"bias.psi": 0.1, "deviation.north": 0.2, "deviation.east": 0.2}
    found, _ = shared([log], 2.0, 1.0)
    assert {name: found[name] for name in errors if name in found} == (errors if told else {})


def weaving(scale: float, late: float) -> Trial:
    """A craft whose course swings on an exact path, its gyro of another scale, its track late [s]."""
    t = np.arange(0.0, 600.0)
    fine = np.arange(-20.0, 601.0, 0.05)
    r = 0.02 * np.sin(fine / 21.0) + 0.015 * np.sin(fine / 37.0)
    psi, U = np.cumsum(r) * 0.05, 3.0 + 0.5 * np.sin(fine / 80.0)
    read = {"x": np.cumsum(U * np.cos(psi)) * 0.05, "y": np.cumsum(U * np.sin(psi)) * 0.05, "psi": psi, "u": U,
            "v_m": np.zeros(fine.size), "r": scale * r}  # fmt: skip
    noise, rng = {"x": 0.1, "y": 0.1, "psi": 0.002, "u": 0.02, "v_m": 0.02, "r": 2e-4}, np.random.default_rng(1)
    delays = {"x": late, "y": late}
    return Trial("log", t, {name: np.interp(t - delays.get(name, 0.0), fine, values)
                            + noise[name] * rng.standard_normal(t.size) for name, values in read.items()})  # fmt: skip


@pytest.mark.slow
def test_an_error_that_the_logs_show_is_estimated_and_told_with_its_size() -> None:
    """Wide about zero, so that the fit and not the prior has the last word on its size."""
    logs = {name: weaving(scale, late) for name, scale, late in (
        ("", 1.0, 0.0), ("scale.r", 1.08, 0.0), ("delay.position", 1.0, -2.0))}  # fmt: skip
    sizes = {"scale.r": 0.08, "delay.position": 2.0}
    for name, one in logs.items():
        found, notes = shared([one], 5.0, 2.0, suspects(load("kvlcc2_l7").model, [one]))
        assert found.keys() == ({name} if name else set())
        assert len(notes) == bool(name)
        if name:
            assert found[name] == pytest.approx(2.0 * sizes[name], rel=0.12)
            assert notes[0].startswith(f"{name}: the logs show")
            assert shared([one], 5.0, 2.0)[0] == {}, "what a model cannot have is not asked of it"


def test_a_heading_that_deviates_is_not_freed_twice() -> None:
    log = sailed(compass=8.0 * DEG)
    found, notes = shared([log], 2.0, 1.0, suspects(load("kvlcc2_l7").model, [log]))
    assert "deviation.north" in found
    assert not {"bias.psi_speed"} & found.keys()
    assert not any(one.startswith(("bias.psi:", "deviation")) for one in notes)


def test_an_antenna_far_from_midship_is_told_by_the_length_of_the_ship() -> None:
    """It pivots 12 m ahead of the tracked point, which may be midship of a ship of 30 m, and not of one of 14 m."""
    log = weaving(1.0, 0.0)
    log = log.having(v_m=log["v_m"] - 12.0 * log["r"], delta=np.sin(log.t / 30.0))
    assert shared([log], 30.0, 2.0)[1] == ()
    [note] = shared([log], 14.0, 2.0)[1]
    assert "an antenna some 6.1 m abaft of midship" in note
    assert "antenna = [ahead, to starboard]" in note


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
