"""A heading that is off lends a symmetric ship a drift; turns, rudders, currents and one-sided trials do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check import check_folder
from seatrial.data.check.symmetry import Sideways, Swung, sideways, swung, symmetry_faults
from seatrial.data.prepare import mended

DEG = math.radians(1.0)


def sailed(
    course: float, *, bias: float = 0.0, sides: tuple[float, ...] = (1.0, -1.0), lopsided: float = 0.0,
    compass: float = 0.0, deviates: tuple[float, float] = (0.0, 0.0), speed: float = 5.0, seed: int = 0,
    name: str = "a",
) -> Trial:  # fmt: skip
    """A zigzag of a hull of odd but not linear sway and yaw, in a current of .4 m/s.

    Args:
        bias: of the heading that turned the velocity over ground into u and v_m [rad].
        sides: the rudder, in turn, of 15 deg to starboard.
        lopsided: drift of the hull itself, straight ahead [rad].
        compass: bias of the logged heading alone [rad].
        deviates: its deviation, on northerly and on easterly courses, that turned the velocity too [rad].
        speed: straight ahead [m/s].
    """
    dt, every, rng = 0.1, 10, np.random.default_rng(seed)
    u, v, r, psi, x, y, d = speed, 0.0, 0.0, course, 0.0, 0.0, 0.0
    rows: list[tuple[float, ...]] = []
    for k in range(6000):
        ordered = 0.0 if k < 300 else 15.0 * DEG * sides[(k // 400) % len(sides)]
        d += float(np.clip(ordered - d, -3.0 * DEG * dt, 3.0 * DEG * dt))
        r += dt * (0.035 * d - r - 900.0 * r**3) / 9.0
        slip = -30.0 * r - 400.0 * r * abs(r) - 0.15 * u * d - lopsided * u
        v += dt * (slip - v) / 5.0
        u += dt * (speed - u - 900.0 * r * r) / 40.0
        psi += dt * r
        c, s = math.cos(psi), math.sin(psi)
        north, east = u * c - v * s + 0.3, u * s + v * c - 0.26
        x, y = x + dt * north, y + dt * east
        if k % every == 0:
            turned = psi + bias + deviates[0] * c + deviates[1] * s
            to = math.cos(turned), math.sin(turned)
            rows.append((x, y, turned + compass, north * to[0] + east * to[1], east * to[0] - north * to[1], r, d))
    table = np.array(rows) + rng.standard_normal((len(rows), 7)) * [0.1, 0.1, 1e-3, 0.02, 0.02, 2e-4, 1e-3]
    names = ("x", "y", "psi", "u", "v_m", "r", "delta")
    return Trial(name, np.arange(len(rows)) * dt * every, dict(zip(names, table.T, strict=True)), {}, {"L_pp": 60.0})


def swings(**given: float | tuple[float, float]) -> list[Trial]:
    """The same on three courses, each at full and at half speed: at one of them a current is no deviation."""
    return [sailed(0.3 + 2.1 * (k // 2), seed=k, name="abcdef"[k], speed=(5.0, 2.5)[k % 2], **given)  # type: ignore[arg-type]
            for k in range(6)]  # fmt: skip


def folder(**given: float | tuple[float, float]) -> list[Trial]:
    return [sailed(0.3 + 1.7 * k, seed=k, name="abc"[k], **given) for k in range(3)]  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("bias", [-4.0 * DEG, 0.0, 3.0 * DEG])
def test_a_heading_that_turned_the_speeds_shows_as_a_drift_of_its_size(bias: float) -> None:
    found = sideways(folder(bias=bias))
    assert found is not None
    assert found.error < 0.2 * DEG
    # an odd hull that no polynomial has exactly: some tenths of a degree
    assert found.angle == pytest.approx(bias, abs=0.4 * DEG)
    assert found.told == (bias != 0.0)


@pytest.mark.slow
def test_a_compass_that_is_off_alone_lends_no_drift() -> None:
    found = sideways(folder(compass=4.0 * DEG))
    assert found is not None
    assert not found.told


@pytest.mark.slow
def test_error_bars_hold() -> None:
    found = [sideways([sailed(0.3 + k + 2.0 * j, seed=20 + 20 * j + k) for j in range(3)]) for k in range(10)]
    off = np.array([one.angle / math.hypot(one.error, 0.2 * DEG) for one in found if one])
    assert off.size == 10
    assert float(np.mean(off**2)) < 2.0


@pytest.mark.slow
def test_trials_to_one_side_or_without_what_it_takes_say_nothing() -> None:
    assert sideways([sailed(0.3)]) is None  # on one course a current across it is the same
    steady = sailed(0.0, sides=(1.0,)).rows(slice(120, 600))
    found = sideways([steady])
    assert found is None or not found.told
    whole = sailed(0.0)
    for gone in ("v_m", "psi", "r", "delta"):
        rest = Trial("a", whole.t, {n: c for n, c in whole.channels.items() if n != gone}, {}, {})
        assert sideways([rest]) is None
    assert sideways([whole.rows(slice(0, 90))]) is None
    assert sideways([]) is None


@pytest.mark.slow
def test_several_rudders_count_by_their_mean() -> None:
    some = folder(bias=3.0 * DEG)
    two = [Trial("a", one.t, {**{n: c for n, c in one.channels.items() if n != "delta"},
                              "delta_1": one["delta"] + 0.1, "delta_2": one["delta"] - 0.1}, {}, {})
           for one in some]  # fmt: skip
    single, double = sideways(some), sideways(two)
    assert single is not None
    assert double is not None
    assert double.angle == pytest.approx(single.angle)


@pytest.mark.parametrize(("angle", "error", "told"), [
    (1.6, 0.19, True), (-1.6, 0.19, True), (1.6, 0.21, False), (1.4, 0.01, False)])  # fmt: skip
def test_a_drift_is_told_beyond_chance_and_what_trim_and_propellers_do(angle: float, error: float, told: bool) -> None:
    assert Sideways(angle * DEG, error * DEG).told == told


@pytest.mark.slow
@pytest.mark.parametrize(
    ("north", "east", "bias"), [(0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (4.0, 0.0, 0.0), (0.0, -5.0, 0.0), (-3.0, 3.0, 2.0)]
)
def test_a_deviation_shows_by_what_changes_with_the_course_whatever_the_hull(
    north: float, east: float, bias: float
) -> None:
    found = swung(swings(deviates=(north * DEG, east * DEG), bias=bias * DEG))
    assert found is not None
    # the current over the speed is left to second order, beside the hull that no polynomial has
    near = 0.5 * DEG + 0.1 * math.hypot(north, east) * DEG
    assert found.north == pytest.approx(north * DEG, abs=near)
    assert found.east == pytest.approx(east * DEG, abs=near)
    assert found.told == (math.hypot(north, east) > 0.0)


@pytest.mark.slow
def test_a_deviation_needs_neither_a_rudder_nor_way_ahead() -> None:
    """A run told backwards goes astern: every velocity changes its sign, hull and compass are the same."""
    ahead = [one.having(delta=np.full(len(one), np.nan)) for one in swings(deviates=(4.0 * DEG, 0.0))]
    found = swung(ahead)
    back = swung([one.having(u=-one["u"], v_m=-one["v_m"], r=-one["r"]) for one in ahead])
    assert found is not None
    assert back is not None
    for some in (found, back):
        assert some.north == pytest.approx(4.0 * DEG, abs=0.9 * DEG)
        assert some.east == pytest.approx(0.0, abs=0.5 * DEG)
        assert some.told


@pytest.mark.slow
def test_the_sway_of_turns_that_all_begin_on_one_course_is_no_deviation() -> None:
    """Then the heading tells how long a turn has lasted; even a hull that is no polynomial says nothing false."""
    for sides in ((1.0, -1.0), (1.0,), (-1.0, -1.0, 1.0)):
        found = swung([sailed(0.4, sides=sides, seed=k, name="abc"[k]) for k in range(3)])
        assert found is None or not found.told
    # on every course at one speed a current is the same as a deviation
    assert swung(folder(deviates=(4.0 * DEG, 0.0))) is None
    assert swung([]) is None
    assert swung([sailed(0.3).rows(slice(0, 90))]) is None


@pytest.mark.parametrize(("size", "deviates", "told"), [(2.1, 8.1, True), (2.1, 7.9, False), (1.9, 20.0, False)])
@pytest.mark.parametrize("at", [0.0, 1.0, 4.0])
def test_a_deviation_is_told_by_its_size_and_its_error(size: float, deviates: float, told: bool, at: float) -> None:
    found = Swung(size * DEG * math.cos(at), size * DEG * math.sin(at), deviates)
    assert found.size == pytest.approx(size * DEG)
    assert found.told == told


@pytest.mark.slow
def test_check_names_the_heading_once_and_its_steps_mend_the_log() -> None:
    wrong, right = folder(bias=4.0 * DEG), folder()
    told = [one for one in check_folder(wrong) if one.key == "heading_bias"]
    assert len(told) == 1
    assert told[0].channels == ("psi",)
    assert "by which u and v_m were turned too" in told[0].what
    assert "to port on every course" in told[0].evidence
    [again] = mended(wrong[0], told[0].steps)
    for name in ("psi", "u", "v_m"):
        assert float(np.median(again[name] - right[0][name])) == pytest.approx(0.0, abs=0.5 * DEG * 5.0)
    assert not [one for one in check_folder(right) if one.key == "heading_bias"]
    [fault] = symmetry_faults(wrong)
    assert fault.where == "psi"


def _one_zigzag(bias: float, **more: float) -> Trial:
    """Five minutes on about one course, the speeds made with the heading, no rate of turn on record."""
    trial = sailed(0.6, bias=bias, seed=3, **more)  # type: ignore[arg-type]
    part = trial.rows(trial.t < 300.0)
    return Trial("one", part.t, {name: part[name] for name in part.channels if name != "r"}, {}, part.meta)


@pytest.mark.parametrize(("bias", "told"), [(12.0 * DEG, True), (-13.0 * DEG, True), (0.0, False)])
def test_a_drift_of_one_zigzag_is_the_heading_or_a_current(bias: float, told: bool) -> None:
    """The current of .4 m/s sets the ship by 4 or 5 deg, which is not told; with the error of the heading it is."""
    found = [one for one in symmetry_faults([_one_zigzag(bias)]) if one.key == "heading_bias"]
    assert bool(found) == told
    if told:
        size = float(found[0].evidence.partition(" ")[0])
        assert size == pytest.approx(abs(bias) / DEG, abs=6.0)
        assert f"deg to {'port' if bias > 0 else 'starboard'} of its heading" in found[0].what
        assert not list(symmetry_faults([_one_zigzag(bias)], drifts=True))


def test_a_drift_of_turns_to_one_side_is_not_told() -> None:
    assert not list(symmetry_faults([_one_zigzag(12.0 * DEG, sides=(1.0, 1.0))]))  # type: ignore[arg-type]
