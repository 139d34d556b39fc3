"""The garden of strangers: its logs hold what truly happened, its forms differ as they say, and its bars."""

from __future__ import annotations

import json
import math
import tomllib
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from garden.others import ESSO
from garden.ships import held_speed, revolutions
from seatrial.core.files import read_toml
from seatrial.ships.estimate import estimate
from strangers.logs import DEG, FAULTS, JITTER, heavy, lasting, read, sheet, trials, unseen, weather, written
from strangers.run import Outcome, _is, figures, followed, one, recorded, table
from strangers.ships import BY_NAME, JUDGES, STRANGERS, Alike, carried

QUICK = ("mmg_8", "mmg_24")
"""Ships of the slow tier, one without a fault and one with."""


def test_there_are_twenty_ships_of_six_forms_and_every_fault_is_planted() -> None:
    lengths = [one.ship.length for one in STRANGERS]
    assert len(BY_NAME) == len(STRANGERS) + len(JUDGES)
    assert len(STRANGERS) >= 20
    assert min(lengths) <= 8.0
    assert max(lengths) >= 330.0
    assert len({one.form for one in STRANGERS}) == 6
    planted = Counter(one.fault for one in STRANGERS)
    assert set(planted) == {"", *FAULTS}
    assert planted[""] >= len(STRANGERS) / 2


def test_particulars_are_those_of_the_truth(tmp_path: Path) -> None:
    """The mass that the estimate makes of the data sheet is that of the ship that sails."""
    for name in ("mmg_42", "twin_120", "roll_175"):
        stranger = BY_NAME[name]
        made = estimate(sheet(stranger, tmp_path / f"{name}.toml")).ship
        assert made.L_pp == stranger.ship.length
        body = read_toml(sheet(stranger, tmp_path / f"{name}.toml"))["particulars"]
        mass = stranger.ship.rho * stranger.ship.volume
        assert stranger.ship.rho * body["C_b"] * body["L_pp"] * body["B"] * body["d"] == pytest.approx(mass)


@pytest.mark.slow
def test_a_ship_alike_turns_on_a_circle_of_as_many_lengths_at_the_speed_of_froude() -> None:
    other = replace(BY_NAME["crossflow_100"], ship=Alike(ESSO, "x", 75.0))
    model = replace(other, ship=Alike(ESSO, "y", 3.0))
    assert revolutions(other.ship, other.ship.speed) == pytest.approx(revolutions(ESSO, ESSO.speed) / 5.0, rel=1e-6)
    big, small = unseen(other), unseen(model)
    assert {key: big[key] / 75.0 for key in big} == pytest.approx({key: small[key] / 3.0 for key in small}, rel=1e-4)


def test_every_ship_holds_its_speed_and_heels_outwards_in_a_turn_only_where_it_rolls() -> None:
    for stranger in STRANGERS:
        n = revolutions(stranger.ship, stranger.ship.speed)
        assert held_speed(stranger.ship, n) == pytest.approx(stranger.ship.speed, rel=1e-6)
    ship = BY_NAME["roll_175"].ship
    rates = ship.rates(8.0, -0.5, 0.01, ship.steered(0.2, 1.8), (8.0, -0.5), 0.0, 0.0)
    assert rates[3] == 0.0
    assert rates[4] < 0.0  # to starboard it turns, to port it heels
    ahead = (8.0, 0.0, 0.0, ship.steered(0.0, 1.8), (8.0, 0.0))
    upright, heeled = (ship.rates(*ahead, phi, 0.0)[2] for phi in (0.0, -0.1))
    assert heeled > upright


def test_noise_that_lasts_has_its_size_and_forgets_in_its_time() -> None:
    t = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 40000))
    noise = lasting(np.random.default_rng(2), t, 0.4, 20.0)
    # some 40000 s hold 1000 independent values: the deviation of a variance is 4.5 %
    assert np.std(noise) == pytest.approx(0.4, rel=0.1)
    lag = 20
    kept = float(np.mean(noise[lag:] * noise[:-lag]) / np.mean(noise**2))
    assert kept == pytest.approx(math.exp(-1.0), abs=0.08)


def test_poor_instruments_have_heavy_tails_and_a_receiver_that_is_late() -> None:
    noise = heavy(np.random.default_rng(4), 200_000)
    assert np.mean(np.abs(noise)) == pytest.approx(2.0 / math.pi, rel=0.02)  # 2 sqrt(3)/pi of t3, over sqrt(3)
    assert np.mean(np.abs(noise) > 4.0) == pytest.approx(0.0062, abs=0.001)  # of a normal density .00006
    assert all(one.harsh for one in JUDGES)
    assert not any(one.harsh for one in STRANGERS)
    assert not {one.seed for one in JUDGES} & {one.seed for one in STRANGERS}


@pytest.mark.slow
def test_poor_fixes_wander_by_their_size_and_lag_behind() -> None:
    stranger = BY_NAME["mmg_15"]
    trial = trials(stranger.name)[-1]
    t = np.arange(0.0, trial.duration)
    ahead: list[float] = []
    wander: list[float] = []
    for seed in range(400):
        said, true = read(stranger, trial, t, np.random.default_rng(seed)), trial.motion.at(t)
        off = np.array([said[name] - true[name] for name in ("x", "y")])
        track = np.array([np.cos(true["psi"]), np.sin(true["psi"])])
        ahead.append(float(np.mean((off * track).sum(axis=0) / true["u"])))
        wander.append(float(np.mean(off**2)))
    speed = float(np.mean(trial.motion.at(t)["u"]))
    # a log of a minute or two holds about one independent value: a mean of four hundred knows a lag to .04 s
    far = 4.0 * 1.5 / speed / math.sqrt(400.0)
    assert far < 0.5 * JITTER
    assert np.mean(ahead) == pytest.approx(-0.5 * JITTER, abs=far)
    assert math.sqrt(np.mean(wander)) == pytest.approx(1.5 * math.sqrt(1.04), rel=0.1)


@pytest.mark.slow
def test_instruments_say_what_happened_and_a_fault_is_what_it_says() -> None:
    stranger = BY_NAME["mmg_24"]
    trial = trials(stranger.name)[1]
    t = np.arange(0.0, trial.duration)
    wrong = read(stranger, trial, t, np.random.default_rng(3))
    right = read(replace(stranger, fault=""), trial, t, np.random.default_rng(3))
    np.testing.assert_allclose(wrong["psi"] - right["psi"], 4.0 * DEG, atol=1e-12)
    assert all(np.array_equal(wrong[name], right[name]) for name in right if name != "psi")
    true = trial.motion.at(t)
    assert np.std(right["r"] - true["r"]) == pytest.approx(0.01 * DEG, rel=0.2)
    over = np.hypot(np.diff(true["x"]), np.diff(true["y"]))
    assert np.max(np.abs(over - np.interp(t[:-1] + 0.5, t, right["sog"]))) < 0.2
    # apparent wind with the ship's own motion taken off is the true wind
    w, course = weather(stranger), true["psi"] + right["gamma_A"]
    north = right["U_A"] * np.cos(course) - np.gradient(true["x"], t)
    east = right["U_A"] * np.sin(course) - np.gradient(true["y"], t)
    assert np.mean(north) == pytest.approx(w.wind * math.cos(w.wind_from), abs=0.2)
    assert np.mean(east) == pytest.approx(w.wind * math.sin(w.wind_from), abs=0.2)


@pytest.mark.slow
def test_a_log_has_stamps_degrees_and_knots_a_rudder_to_port_and_lost_rows(tmp_path: Path) -> None:
    stranger = BY_NAME["mmg_8"]
    file = written(stranger, tmp_path / "logs") / "turn_25.csv"
    head, *lines = file.read_text(encoding="utf-8").splitlines()
    rows = [dict(zip(head.split(","), line.split(","), strict=True)) for line in lines]
    assert rows[0]["Timestamp"].endswith("Z")
    [trial] = [one for one in trials(stranger.name) if one.name == "turn_25"]
    assert 0.94 < len(rows) / (trial.duration + 1.0) < 1.0
    assert min(float(row["Rudder angle [deg]"]) for row in rows) == pytest.approx(-25.0, abs=1.0)
    true = trial.motion.at(np.array([trial.duration]))
    north = (float(rows[-1]["Latitude [deg]"]) - 54.2) * 111_300.0  # m of a degree at 54 north, within a thousandth
    assert north == pytest.approx(float(true["x"][0]), abs=2.0)


@pytest.mark.slow
def test_the_unseen_turn_is_near_that_of_small_steps_of_euler() -> None:
    stranger = BY_NAME["mmg_42"]
    ship, dt = stranger.ship, 0.01
    n = revolutions(ship, ship.speed)
    x = y = psi = v = r = delta = 0.0
    u, found = ship.speed, {}
    while psi < math.pi:
        delta = min(delta + ship.rudder_rate * dt, 35.0 * DEG)
        du, dv, dr = ship.rates(u, v, r, (n, delta), (u, v))
        north, east = u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi)
        x, y, psi = x + dt * north, y + dt * east, psi + dt * r
        u, v, r = u + dt * du, v + dt * dv, r + dt * dr
        if psi >= 0.5 * math.pi:
            found.setdefault("advance", x)
    found["tactical_diameter"] = y
    assert unseen(stranger) == pytest.approx(found, rel=2e-3)


def _outcome(**changes: object) -> Outcome:
    base = Outcome("a", "rudder_offset", off={"identified": {"p": 1.0, "q": -2.5}, "weak": {"s": 0.1}},
                   blamed=("offset.delta_1", "scale.u"), turn={"advance": 0.01, "tactical_diameter": -0.06},
                   inside={"advance": True, "tactical_diameter": False}, held_out=(0.2, 0.5), seconds=3.0)  # fmt: skip
    return replace(base, **changes)


def test_what_is_counted() -> None:
    o = _outcome()
    assert o.named
    assert o.innocent == ("scale.u",)
    assert not o.near
    assert _outcome(turn={"advance": -0.05, "tactical_diameter": 0.0}).near
    assert o.counts(("identified",)) == (1, 2)
    assert not _outcome(blamed=("scale.u",)).named
    assert _outcome(blamed=(), found=("rudder_offset:delta",)).named
    assert _is("bias.psi", ("heading_bias",))
    text = "\n".join(figures([o, _outcome(fault="", blamed=()), Outcome("b", "", refused="no")]))
    assert "3 ships, 1 refused" in text
    assert "right: 1 of 2" in text
    assert "planted faults named: 1 of 1" in text
    assert "inside the bands: 2 of 4" in text
    assert "refused: no" in table([Outcome("b", "", refused="no")])


def test_outcomes_are_kept_with_their_command_and_figures() -> None:
    told = json.loads(recorded([_outcome(), Outcome("b", "", refused="no")], ["a", "b"]))
    assert told["command"] == "PYTHONPATH=src:tests python -m strangers.run a b"
    assert told["figures"][0].startswith("2 ships, 1 refused")
    assert [o["name"] for o in told["outcomes"]] == ["a", "b"]
    assert told["outcomes"][0]["off"]["weak"] == {"s": 0.1}


def test_the_resistance_of_a_model_is_carried_to_a_ship_by_friction() -> None:
    """KVLCC2: .022 of the 7 m model is .0136 at 320 m (S over L d 4.0), and the same at 7 m."""
    assert carried(0.022, 7.0, 1.18, 4.0) == 0.022
    assert carried(0.022, 320.0, 7.97, 4.0) == pytest.approx(0.0136, rel=0.1)
    assert carried(0.022, 20.0, 2.0, 4.0) > carried(0.022, 100.0, 4.5, 4.0)


STUDY = """[data]
root = "trials"

[free]
"hull.R_0" = { low = 0.0 }

[nuisance] # a current
common = { "current.north" = 0.5 } # SI units

[estimator]
"""


@pytest.mark.parametrize(("advice", "table", "entry"), [
    ('estimate the error: common = { "offset.delta" = inf } in [nuisance] of the study', "nuisance",
     {"common": {"current.north": 0.5, "offset.delta": math.inf}}),
    ('widen the prior: "hull.R_0" = { sigma = 0.009 } in [free] of the study', "free",
     {"hull.R_0": {"low": 0.0, "sigma": 0.009}}),
    ('free it: "hull.X_vv" = { prior = 0.3 } in [free] of the study', "free",
     {"hull.R_0": {"low": 0.0}, "hull.X_vv": {"prior": 0.3}}),
    ('correct the log of a, or leave it out: exclude = ["a"] in [data] of the study', "data",
     {"root": "trials", "exclude": ["a"]}),
])  # fmt: skip
def test_an_advice_is_followed_by_its_line(advice: str, table: str, entry: dict[str, object]) -> None:
    done = tomllib.loads(followed(STUDY, advice))
    assert done == {**tomllib.loads(STUDY), table: entry}
    assert followed(followed(STUDY, advice), advice) == ""  # what is there already is no advice
    assert followed(STUDY, "look for a term of the model") == ""
    bare = STUDY.partition("[nuisance]")[0]
    assert tomllib.loads(followed(bare, advice))[table]


def test_an_advice_is_worse_by_the_error_before_it() -> None:
    assert _outcome(followed=(0.2, 0.22, 0.1)).worsened == 1
    assert "advice followed: 3, of which made it worse: 1" in "\n".join(figures([_outcome(followed=(0.2, 0.22, 0.1))]))


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_a_stranger_is_better_known_after_three_commands(name: str, tmp_path: Path) -> None:
    """A wind that no particulars tell, and a heading 4 deg off, are not given to the hull: the unseen turn is right."""
    outcome = one(BY_NAME[name], tmp_path)
    assert not outcome.refused
    assert outcome.held_out[0] < outcome.held_out[1], table([outcome])
    assert outcome.near, table([outcome])
    assert outcome.inside, table([outcome])
    assert outcome.named or not outcome.fault


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in BY_NAME if name not in QUICK])
def test_no_stranger_is_made_worse_and_none_refused_but_for_its_fault(name: str, tmp_path: Path) -> None:
    outcome = one(BY_NAME[name], tmp_path)
    if outcome.refused:
        assert outcome.fault, outcome.refused
        return
    assert outcome.held_out[0] < outcome.held_out[1], table([outcome])
