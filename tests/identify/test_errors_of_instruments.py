"""Errors of instruments by geometry, constraints and least squares by closed forms, loads by rigid-body dynamics."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.data import DataError, Trial
from seatrial.data.captive import MOTION, Captive
from seatrial.identify import StudyError
from seatrial.identify.regression import captive_loads
from seatrial.identify.regression.regression import criteria, least_squares
from seatrial.identify.shooting.balance import smoothed
from seatrial.identify.shooting.constraints import Inequalities, Penalty, _damping, _masses
from seatrial.identify.trajectory.suspects import named, recorded, suspects
from seatrial.identify.vector import Vector
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
T = np.arange(40) * 0.5
PSI = 0.4 + 0.05 * T
RUN = np.column_stack([3.0 * T, T**2, PSI, 1.0 + 0.1 * T, np.sin(T), 0.05 + 0.01 * T])[None]


def every() -> dict[str, Any]:
    wind = Trial("w", T, {"U_T": 5.0 + 0.0 * T, "gamma_T": 0.0 * T, "u": 1.0 + 0.0 * T, "v_m": 0.0 * T})
    return {one.name: one for one in suspects(SHIP.model, [wind])}


@pytest.mark.parametrize(("name", "channel", "wanted", "unit", "per"), [
    ("bias.psi", 2, 1.0 + 0.0 * T, "deg", math.radians(1.0)), ("bias.u", 3, 1.0 + 0.0 * T, "m/s", 1.0),
    ("bias.v_m", 4, 1.0 + 0.0 * T, "m/s", 1.0), ("bias.r", 5, 1.0 + 0.0 * T, "deg/s", math.radians(1.0)),
    ("scale.u", 3, 1.0 + 0.1 * T, "%", 0.01), ("scale.r", 5, 0.05 + 0.01 * T, "%", 0.01),
    ("delay.psi", 2, -0.05 + 0.0 * T, "s", 1.0), ("delay.speed", 3, -0.1 + 0.0 * T, "s", 1.0),
    ("delay.r", 5, -0.01 + 0.0 * T, "s", 1.0), ("delay.position", 0, -3.0 + 0.0 * T, "s", 1.0),
    ("deviation.north", 2, np.cos(PSI), "deg", math.radians(1.0)), ("deviation.east", 2, np.sin(PSI), "deg",
        math.radians(1.0)),
    ("antenna.ahead", 0, np.cos(PSI), "m", 1.0), ("antenna.ahead", 1, np.sin(PSI), "m", 1.0),
    ("antenna.starboard", 0, -np.sin(PSI), "m", 1.0), ("antenna.starboard", 1, np.cos(PSI), "m", 1.0),
    # a point ahead of midship moves to starboard at r, one to starboard moves astern
    ("receiver.ahead", 0, np.cos(PSI), "m", 1.0), ("receiver.ahead", 4, 0.05 + 0.01 * T, "m", 1.0),
    ("receiver.starboard", 1, np.cos(PSI), "m", 1.0), ("receiver.starboard", 3, -0.05 - 0.01 * T, "m", 1.0),
    ("delay.receiver", 0, -3.0 + 0.0 * T, "s", 1.0), ("delay.receiver", 3, -0.1 + 0.0 * T, "s", 1.0),
    # a velocity over ground, told from a heading that is too large, comes more from port
    ("bias.psi_speed", 2, 1.0 + 0.0 * T, "deg", math.radians(1.0)),
    ("bias.psi_speed", 3, np.sin(T), "deg", math.radians(1.0)),
    ("bias.psi_speed", 4, -1.0 - 0.1 * T, "deg", math.radians(1.0)),
])  # fmt: skip
def test_a_sensor_reads_its_error_and_nothing_else(name: str, channel: int, wanted: Any, unit: str, per: float) -> None:
    one = every()[name]
    found = one.reads(RUN, None, 0.5)
    np.testing.assert_allclose(found[0, :, channel], wanted, atol=1e-12)
    pairs = {"antenna.ahead": {0, 1}, "antenna.starboard": {0, 1}, "delay.position": {0, 1}, "delay.speed": {3, 4},
             "receiver.ahead": {0, 1, 4}, "receiver.starboard": {0, 1, 3}, "delay.receiver": {0, 1, 3, 4},
             "bias.psi_speed": {2, 3, 4}}  # fmt: skip
    others = set(range(6)) - pairs.get(name, {channel})
    assert not found[..., sorted(others)].any()
    assert (one.unit, one.per) == (unit, pytest.approx(per))
    # its derivative along a change of the prediction, by a finite difference
    change = np.random.default_rng(1).normal(size=RUN.shape)
    h = 1e-6
    slope = (one.reads(RUN + h * change, None, 0.5) - one.reads(RUN - h * change, None, 0.5)) / (2 * h)
    np.testing.assert_allclose(one.reads(RUN, change, 0.5), slope, atol=1e-7)


def test_a_delay_is_the_reading_a_second_before_to_first_order() -> None:
    fast = every()["delay.position"].reads(RUN, None, 0.5)[0, 1:-1, 1]
    np.testing.assert_allclose(fast, -2.0 * T[1:-1])
    single = every()["delay.psi"].reads(RUN[:, :1], None, 0.5)
    assert not single.any()


def test_a_recorded_state_is_off_by_the_way_of_a_delay_and_by_a_bias() -> None:
    """One second late, a position is where the ship was a second before: by u and v_m along their axes."""
    known = every()
    state = np.array([[5.0, 6.0, 0.3, 2.0, 0.5, 0.1], [0.0, 0.0, -1.2, 1.0, -0.4, 0.0]])
    off = recorded([known[name] for name in ("delay.position", "bias.psi", "offset.delta")], state, 0.5)
    ahead, across = (np.column_stack(pair) for pair in (
        (np.cos(state[:, 2]), np.sin(state[:, 2])), (-np.sin(state[:, 2]), np.cos(state[:, 2]))))  # fmt: skip
    np.testing.assert_allclose(off[0, :, :2], -(state[:, 3:4] * ahead + state[:, 4:5] * across), atol=1e-12)
    assert not off[0, :, 2:].any()
    np.testing.assert_allclose(off[1], np.eye(6)[[2, 2]])
    assert not off[2].any()


def test_an_input_acts_its_error_in_its_own_column() -> None:
    model, known = SHIP.model, every()
    n = len(model.controls)
    series = np.random.default_rng(2).normal(size=(2, 30, n + 8))
    at = model.controls.index("delta")
    for name, wanted in (("offset.delta", -np.ones((2, 30))), ("scale.delta", -series[..., at]),
                         ("port.delta", np.maximum(-series[..., at], 0.0)),
                         ("delay.delta", np.gradient(series[..., at], 0.25, axis=1))):  # fmt: skip
        found = known[name].acts(series, 0.25)
        np.testing.assert_allclose(found[..., at], wanted)
        assert not np.delete(found, at, axis=2).any()
    assert [known[name].of_reading for name in ("port.delta", "scale.delta", "offset.delta", "delay.delta")] == [
        True, True, False, False]
    shaft = model.controls.index("n_P")
    np.testing.assert_allclose(known["scale.n_P"].acts(series, 0.25)[..., shaft], -series[..., shaft])
    assert "offset.n_P" not in known
    for name in ("current.north", "current.east"):
        found = known[name].acts(series, 0.25)
        (column,) = np.flatnonzero(found.any(axis=(0, 1)))
        np.testing.assert_allclose(found[..., column], 1.0)
        assert column >= n


def test_the_wind_is_scaled_and_turned() -> None:
    model: Any = SimpleNamespace(controls=("delta",), feels_wind=True)
    known = {one.name: one for one in suspects(model, [Trial("w", T, {"U_T": 5.0 + 0.0 * T, "gamma_T": 0.0 * T})])}
    series = np.random.default_rng(3).normal(size=(1, 30, 9))
    columns = [int(np.flatnonzero(known[f"wind.{way}"].acts(series, 1.0).any(axis=(0, 1)))[0]) for way in ("north",
        "east")]
    x, y = (series[..., k] for k in columns)
    scaled, turned = (known[n].acts(series, 1.0) for n in ("scale.wind", "direction.wind"))
    np.testing.assert_allclose(scaled[..., columns[0]], -x)
    np.testing.assert_allclose(scaled[..., columns[1]], -y)
    # a rotation: the speed stays, to first order
    np.testing.assert_allclose(turned[..., columns[0]] * x + turned[..., columns[1]] * y, 0.0, atol=1e-12)
    np.testing.assert_allclose(turned[..., columns[0]], y)
    assert "scale.wind" not in {one.name for one in suspects(model, [Trial("c", T, {"u": T})])}
    assert [one.name for one in named(model, [], ("bias.u", "bias.psi"), np.zeros(0))] == ["bias.u", "bias.psi"]
    with pytest.raises(StudyError, match=r"common names 'bias\.w'"):
        named(model, [], ("bias.w",), np.zeros(0))


# Constraints


def test_minors_of_the_mass_are_those_of_its_symmetric_part() -> None:
    M = np.random.default_rng(0).normal(size=(3, 3)) + 3.0 * np.eye(3)
    S = 0.5 * (M + M.T)
    found = _masses(M.tolist())
    assert list(found.values()) == pytest.approx([S[0, 0], np.linalg.det(S[:2, :2]), np.linalg.det(S)])
    d = SimpleNamespace(X_u=-2.0, Y_v=3.0, N_r=5.0, Y_r=0.5, N_v=0.25)
    assert list(_damping(d).values()) == [2.0, 15.0 - 0.125]


def test_a_penalty_acts_where_a_quantity_is_below_its_push() -> None:
    p = ca.SX.sym("p", 2)
    own = Inequalities._traced(p, ("a", "b"), ca.vertcat(p[0] - 1.0, 2.0 * p[0] * p[1]))
    at = np.array([0.5, 3.0])
    h, slopes = own.at(at)
    assert h.tolist() == [-0.5, 3.0]
    assert slopes.tolist() == [[1.0, 0.0], [6.0, 1.0]]
    one = Penalty(own, 100.0, np.array([0.25, 0.0]))
    rows, derivatives = one.rows(at)
    assert rows.tolist() == [7.5, 0.0]
    assert derivatives.tolist() == [[-10.0, 0.0], [0.0, 0.0]]
    assert one.pushed(at).push.tolist() == [0.75, 0.0]
    none = Penalty(Inequalities.none(SimpleNamespace(free=(1, 2))), 1.0, np.zeros(0))  # type: ignore[arg-type]
    assert none.rows(at)[1].shape == (0, 2)
    assert none.pushed(at) is none


# Least squares


def test_least_squares_have_the_covariance_of_their_noise_in_any_units() -> None:
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(60, 3)) * [1e-4, 1.0, 1e3]
    right = matrix @ [5.0, 2.0, -1e-3] + 0.1 * rng.normal(size=60)
    one = least_squares(matrix, right)
    exact, *_ = np.linalg.lstsq(matrix * [1e4, 1.0, 1e-3], right, rcond=None)
    np.testing.assert_allclose(one.values, exact * [1e4, 1.0, 1e-3], rtol=1e-9)
    left = right - matrix @ one.values
    assert one.variance == pytest.approx(left @ left / 57)
    scaled = np.linalg.inv((matrix * [1e4, 1.0, 1e-3]).T @ (matrix * [1e4, 1.0, 1e-3]))
    np.testing.assert_allclose(one.covariance, one.variance * scaled * np.outer([1e4, 1, 1e-3], [1e4, 1, 1e-3]),
        rtol=1e-6)
    np.testing.assert_allclose(one.sigma, np.sqrt(np.diag(one.covariance)))
    assert one.rows == 60
    for bad in (matrix[:3], matrix * [1, 0, 1], np.column_stack([matrix, matrix[:, 0]])):
        with pytest.raises(DataError):
            least_squares(bad, right[: len(bad)])
    assert least_squares(matrix[:4], right[:4]).rows == 4
    aic, bic = criteria(0.5, 100, 7)
    assert aic == pytest.approx(100 * math.log(0.5) + 14.0)
    assert bic == pytest.approx(100 * math.log(0.5) + 7 * math.log(100))


def test_a_quadratic_passes_a_smoother_unchanged_and_noise_shrinks() -> None:
    t = np.arange(50.0)
    curve = np.column_stack([1.0 + 0.3 * t - 0.02 * t**2, t])
    np.testing.assert_allclose(smoothed(curve, 4), curve, atol=1e-9)
    np.testing.assert_array_equal(smoothed(curve[:8], 4), curve[:8])
    np.testing.assert_array_equal(smoothed(curve, 1)[:, 1], curve[:, 1])
    noise = np.random.default_rng(0).normal(size=(20_000, 1))
    # the middle weight of a quadratic over nine points is 59/231 (Savitzky and Golay 1964)
    assert smoothed(noise, 4).std() == pytest.approx(math.sqrt(59.0 / 231.0), rel=0.03)


def test_a_vector_reaches_as_far_as_is_known() -> None:
    vector = Vector((Free("a", -2.0, -10.0, 1.0), Free("b", 1.0, prior=3.0, sigma=0.5), Free("c", 4.0), Free("d", 0.0)))
    at = np.array([-4.0, 2.0, -5.0, 0.0])
    assert vector.reach(at).tolist() == [6.0, 0.5, 5000.0, 1000.0]
    np.testing.assert_allclose(vector.held(at), np.diag([6.0**-2, 4.0, 0.0, 0.0]))
    assert vector.size(at).tolist() == [4.0, 3.0, 5.0, 0.0]
    assert [f.start for f in vector.started({"a": -99.0, "c": 9.0})] == [-10.0, 1.0, 9.0, 0.0]
    assert vector.positions(["d", "c", "b", "a"]).tolist() == [3, 2, 1, 0]
    assert vector.at_bound(np.array([1.0, 0.0, 0.0, 0.0])) == ("a",)
    assert vector.at_bound(np.array([-10.0, 0.0, 0.0, 0.0])) == ("a",)
    drawn = vector.drawn(4000, np.random.default_rng(0))
    assert drawn[:, 0].mean() == pytest.approx(-4.5, abs=0.2)
    assert drawn[:, 1].mean() == pytest.approx(1.0, abs=0.2)


# Loads of captive tests


def captive(inertia: str, length: float, **columns: Any) -> Captive:
    motion = np.zeros((3, len(MOTION)))
    motion[:, MOTION.index("u")] = 1.5
    for name, column in columns.items():
        motion[:, MOTION.index(name)] = column
    loads = {name: np.zeros(3) for name in ("X", "Y", "N")}
    return Captive("tank", motion, loads, length, 1000.0, inertia)


def at(runs: Captive) -> np.ndarray:
    found, _ = captive_loads.Predicted.of(SHIP, runs).by(("hull.Y_v",))(np.array([values(SHIP.model)["hull.Y_v"]]))
    return found.reshape(3, 3)


def test_loads_with_inertia_are_those_of_a_rigid_body_about_midship() -> None:
    """m (a_G) at the centre of gravity, and its moment about midship with the inertia there."""
    rates = {name: 0.1 * k for k, name in enumerate(MOTION[5:], start=1)}
    v, r = np.array([0.1, -0.2, 0.0]), np.array([0.05, 0.0, -0.1])
    more = {"v_m": v, "r": r, **rates}
    without, whole = at(captive("removed", SHIP.L_pp, **more)), at(captive("included", SHIP.L_pp, **more))
    du, dv, dr = (rates[name] for name in MOTION[5:])
    body = values(SHIP.model)
    m, x_G, I_zG = body["body.m"], body["body.x_G"], body["body.I_zG"]
    ahead = du - v * r - x_G * r**2
    side = dv + 1.5 * r + x_G * dr
    np.testing.assert_allclose(whole - without, [-m * ahead, -m * side, -(I_zG * dr + m * x_G * side)], rtol=1e-9,
        atol=1e-9)


def test_a_smaller_model_is_the_same_ship_by_froude() -> None:
    full = at(captive("removed", SHIP.L_pp, v_m=0.2, r=0.05))
    scale = 4.0
    small = captive("removed", SHIP.L_pp / scale, v_m=0.2 / 2.0, r=0.05 * 2.0)
    motion = small.motion.copy()
    motion[:, MOTION.index("u")] = 1.5 / 2.0
    found = at(Captive("tank", motion, small.loads, small.L_pp, 1000.0))
    rho = values(SHIP.model)["body.rho"]
    np.testing.assert_allclose(found, full * 1000.0 / rho / np.array([scale**3, scale**3, scale**4])[:, None],
        rtol=1e-9)


def test_runs_of_one_condition_err_alike_to_either_side() -> None:
    motion = np.zeros((6, len(MOTION)))
    motion[:, 0] = [1.0, 1.0, 1.0, 0.5, 1.0, 1.0]
    motion[:, MOTION.index("v_m")] = [0.1, -0.1, 0.0, 0.05, 0.0, 0.0]
    motion[:, MOTION.index("r")] = [0.0, 0.0, 0.0, 0.0, 0.05, -0.05]
    one, other, still, slow, turn, back = captive_loads.conditions(Captive("t", motion, {}, 7.0, 1000.0))
    assert one == other
    assert turn == back
    assert len({one, still, slow, turn}) == 4
    runs = Captive("t", motion, {"Y": np.zeros(6)}, 7.0, 1000.0)
    assert captive_loads.Predicted.of(SHIP, runs).group.tolist() == [1, 1, 0, 1, 1, 1]


def test_speeds_share_no_error_where_they_are_not_measured() -> None:
    speeds = {"u": 1.0 + 0.0 * T, "v_m": 0.1 * np.sin(T)}
    shared = {"bias.psi_speed", "delay.receiver", "receiver.ahead", "receiver.starboard"}

    def offered(trial: Trial) -> set[str]:
        return shared & {one.name for one in suspects(SHIP.model, [trial])}

    assert offered(Trial("a", T, speeds)) == shared
    assert offered(Trial("a", T, {"u": speeds["u"]})) == set()
    made = Trial("a", T, speeds, {}, {"derived": {"v_m": "x, y, psi"}})
    assert offered(made) == set()


def test_controls_of_one_kind_have_an_error_together() -> None:
    """What acts then is the sum of what the errors of each do."""
    model: Any = SimpleNamespace(controls=("n_P_1", "n_P_2", "delta_1", "delta_2", "n_bow"), feels_wind=False)
    known = {one.name: one for one in suspects(model, [])}
    series = np.random.default_rng(5).normal(size=(2, 30, 13))
    for name in ("scale.n_P", "delay.n_P", "offset.delta", "port.delta", "scale.delta", "delay.delta"):
        each = sum(known[f"{name}_{side}"].acts(series, 0.5) for side in (1, 2))
        np.testing.assert_allclose(known[name].acts(series, 0.5), each, err_msg=name)
        assert known[name].of_reading == known[f"{name}_1"].of_reading
    assert not {"scale.n", "scale.n_bow_1", "offset.n_P", "port.n_P"} & set(known)
    assert [known[name].words for name in ("offset.delta", "offset.delta_1", "scale.n_bow")] == [
        "an offset of each delta", "an offset of delta_1", "a scale error of n_bow"]
    single: Any = SimpleNamespace(controls=("n_P", "delta"), feels_wind=False)
    names = [one.name for one in suspects(single, [])]
    assert len(names) == len(set(names))
