"""Kinds of craft that two thrusts steer: turns, zigzags and spins of a catamaran of the library without its orders."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.kinds import recognised
from seatrial.data.kinds.signals import driven
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

L_PP = 2.0
FULL, DEGREE = math.radians(35.0), math.radians(1.0)
EXCHANGED = "it turns against its thrusts: are port and starboard exchanged, or their signs?"


def sailed(policy: Turning | Zigzag, seconds: float) -> Trial:
    """The motion and the revolutions of both sides, without the demand."""
    return bare(simulate(load("otter"), policy, duration=seconds, dt=0.1))


def bare(trial: Trial) -> Trial:
    kept = {name: values for name, values in trial.channels.items() if not name.endswith("_cmd")}
    return replace(trial, channels=kept, meta={"L_pp": L_PP})


def exchanged(trial: Trial) -> Trial:
    return trial.having(n_port=trial["n_starboard"], n_starboard=trial["n_port"])


def spun(side: float, way: float = 0.0) -> Trial:
    """About its own middle at .8 rad/s for 8 s, thrusts 80 % ahead and astern; rest before and after."""
    t = np.arange(0.0, 30.0, 0.1)
    works = (t > 10.0) & (t < 18.0)
    r = side * 0.8 * works
    psi = np.cumsum(0.1 * r)
    x, y = np.cumsum(0.1 * way * works * np.cos(psi)), np.cumsum(0.1 * way * works * np.sin(psi))
    u = way * works
    table = {"x": x, "y": y, "psi": psi, "u": u, "v_m": 0.0 * t, "r": r}
    return Trial("spin", t, {**table, "f_port": side * 20.0 * works, "f_starboard": -side * 20.0 * works}, {},
                 {"L_pp": L_PP})  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("side", [1, -1])
def test_a_zigzag_by_thrusts_has_its_demand_and_its_headings(side: int) -> None:
    """Motors of 1 s take the heading beyond the 20 deg of the order: the truth is the heading where the order turns."""
    trial = simulate(load("otter"), Zigzag(8.0, 0.4 * FULL, 20.0 * DEGREE, side), duration=80.0, dt=0.1)
    found = recognised(bare(trial))
    assert (found.name, found.by_thrust, found.settings["side"]) == ("zigzag", True, side)
    half = 0.5 * np.ptp(np.quantile(trial["n_port"] - trial["n_starboard"], [0.05, 0.95]))
    most = np.quantile(np.abs([trial["n_port"], trial["n_starboard"]]), 0.99)
    assert found.settings["rudder"] / FULL == pytest.approx(half / (2.0 * most), rel=0.1)
    assert f"{100.0 * found.settings['rudder'] / FULL:.0f}%/" in found.label
    turned = np.flatnonzero(np.diff(np.sign(trial["delta_cmd"])) != 0)[2:]
    middle = np.abs(trial["psi"][turned])
    assert found.settings["heading"] == pytest.approx(float(np.mean(middle)), abs=5.0 * DEGREE)
    assert EXCHANGED not in found.doubts
    assert EXCHANGED in recognised(exchanged(bare(trial))).doubts


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turn_by_thrusts_is_one_after_a_rest_too(side: float) -> None:
    turn = sailed(Turning(8.0, side * 0.5 * FULL), 60.0)
    found = recognised(turn)
    assert (found.name, found.settings["side"], found.doubts) == ("turning", side, ())
    wrong = recognised(exchanged(turn))
    assert (wrong.name, EXCHANGED in wrong.doubts) == ("turning", True)
    still = {name: np.concatenate([np.full(900, values[0] * (name in ("x", "y", "psi"))), values])
             for name, values in turn.channels.items()}  # fmt: skip
    rested = replace(turn, t=0.1 * np.arange(still["x"].size), channels=still)
    assert recognised(rested).name == "turning"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_spin_is_a_turn_about_the_own_middle_by_opposed_thrusts(side: float) -> None:
    """A radius of .4 L is .8 m, at .8 rad/s a speed of .64 m/s."""
    found = recognised(spun(side))
    assert (found.name, found.settings, found.doubts) == ("spinning", {"side": side}, ())
    assert recognised(spun(side, 0.6)).name == "spinning"
    assert recognised(spun(side, 0.7)).name == "turning"
    wrong = spun(side).having(f_port=spun(side)["f_starboard"], f_starboard=spun(side)["f_port"])
    assert EXCHANGED in recognised(wrong).doubts
    unknown = replace(spun(side), meta={})
    assert recognised(unknown).name == "turning", "without a length no radius is small"


def test_thrusts_by_number_and_thrusts_to_one_side_are_no_pair() -> None:
    spin = spun(1.0)
    named = {**{n: v for n, v in spin.channels.items() if not n.startswith("f_")},
             "f_1": spin["f_port"], "f_2": spin["f_starboard"]}  # fmt: skip
    assert not recognised(replace(spin, channels=named)).by_thrust
    shafts = {**{n: v for n, v in named.items() if not n.startswith("f_")}, "n_P_1": spin["f_port"],
              "n_P_2": spin["f_starboard"]}  # fmt: skip
    assert recognised(replace(spin, channels=shafts)).name == "spinning", "shafts are numbered from port"
    with_rudder = spin.having(delta=np.zeros(spin.t.size))
    assert not recognised(with_rudder).by_thrust


def test_a_craft_that_thrusts_steer_is_looked_at_while_it_is_driven() -> None:
    """From a tenth of the time before the first thrust to half of it behind the last; motors that idle do not count."""
    trial = spun(1.0)
    works = trial.t[trial["f_port"] != 0.0]
    span = works[-1] - works[0]
    idle = trial.having(f_port=trial["f_port"] + 0.01 * np.sin(trial.t), f_starboard=trial["f_starboard"] + 0.01)
    for one in (trial, idle):
        kept = driven(one).t
        right = trial.t[(trial.t >= works[0] - 0.1 * span) & (trial.t <= works[-1] + 0.5 * span)]
        assert np.array_equal(kept, right)
    steered = trial.having(delta=0.1 * np.sin(trial.t))
    assert driven(steered) is steered
    alone = Trial("a", trial.t, {"n_P": np.ones(len(trial))})
    assert driven(alone) is alone
