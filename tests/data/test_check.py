from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.check import check, check_set
from seatrial.data.formats import frt_esso, simman
from seatrial.data.prepare import froude_scaled, resample, to_earth
from seatrial.data.trialfile import write_trial


def earth(t):
    u, v = to_earth(t["u"], t["v_m"], t["psi"])
    return t.having(u=u, v_m=v)


def tail(t):
    return t.having(**{n: np.where(t.t > 150, np.nan, v) for n, v in t.channels.items()})


def poked(t, name, rows, value):
    values = t[name].copy()
    values[rows] = value if value is not None else values[rows][0]
    return t.having(**{name: values})


FAULTS = {
    "earth": (earth, "error", "north and east, not surge"),
    "rudder": (lambda t: t.having(delta=-t["delta"]), "error", "rudder sign"),
    "sway": (lambda t: t.having(v_m=-t["v_m"]), "error", "v_m counts to port"),
    "model called ship": (lambda t: replace(t, meta={"L_pp": 325.0}), "error", "turns too sharply"),
    "ship called model": (lambda t: replace(t, meta={"L_pp": 0.03}), "error", "too fast for its length"),
    "step": (lambda t: replace(t, t=t.t / 1.1), "error", "time step is not the true one"),
    "knots": (lambda t: t.having(u=t["u"] * 1.94, v_m=t["v_m"] * 1.944), "error", "u, v_m are in kn"),
    "clock": (lambda t: replace(t, t=np.floor(t.t)), "error", "time repeats"),
    "quantised": (lambda t: replace(t, t=t.t + (np.arange(len(t)) % 7 == 0) * 0.08), "warning", "quantised"),
    "leap": (lambda t: t.rows(np.r_[0:500, 600 : len(t)]), "warning", "missing samples"),
    "coarse": (lambda t: t.having(x=np.round(t["x"] / 2) * 2), "warning", "coarse"),
    "wind true": (lambda t: t.having(gamma_T=t["gamma_T"] + np.pi), "error", "wind direction is 'to'"),
    "wind felt": (lambda t: t.having(gamma_A=t["gamma_A"] + np.pi), "error", "wind direction is 'to'"),
    "wrapped": (lambda t: t.having(psi=np.mod(t["psi"] - 0.5, 2 * np.pi)), "info", "heading wraps"),
    "gap": (lambda t: poked(t, "u", slice(40, 50), np.nan), "info", "gaps"),
    "gap of an input": (lambda t: poked(t, "delta", slice(40, 50), np.nan), "warning", "gaps"),
    "large gap": (lambda t: poked(t, "u", slice(40, -40), np.nan), "warning", "gaps"),
    "tail": (tail, "warning", "rows without data"),
    "frozen": (lambda t: poked(t, "r", slice(400, 500), None), "warning", "frozen sensor"),
    "slow gps": (lambda t: t.having(x=np.repeat(t["x"][::2], 2)), "warning", "repeated values"),
    "degrees rudder": (lambda t: t.having(delta=np.degrees(t["delta"])), "error", "rudder is in degrees"),
    "degrees psi": (lambda t: t.having(psi=np.degrees(t["psi"])), "error", "psi is in deg"),
    "degrees r": (lambda t: t.having(r=np.degrees(t["r"])), "error", "r is in deg/s"),
    "deg/min r": (lambda t: t.having(r=t["r"] * 3437.7), "error", "r is in deg/min"),
    "metres": (lambda t: t.having(x=t["x"] / 1000, y=t["y"] / 1000), "error", "x, y are in km"),
    "mirror": (lambda t: t.having(r=-t["r"]), "error", "r counts to port"),
    "uneven": (lambda t: replace(t, t=t.t + 0.04 * (np.arange(len(t)) % 2)), "warning", "uneven steps"),
    "degrees alpha": (lambda t: t.having(alpha_1=10 * np.sign(np.sin(t.t / 9))), "error", "thrust is in degrees"),
    "short": (lambda t: t.rows(slice(0, 5)), "error", "too short"),
}  # fmt: skip


@pytest.mark.slow
def test_a_right_trial_has_no_findings(made):
    assert check(made) == ()


@pytest.mark.slow
@pytest.mark.parametrize("case", FAULTS)
def test_each_fault_is_found(made, case):
    spoil, severity, words = FAULTS[case]
    found = [f for f in check(spoil(made)) if words in f.what]
    assert found, [str(f) for f in check(spoil(made))]
    assert found[0].severity == severity
    assert any(c.isdigit() for c in found[0].evidence)
    assert found[0].remedy


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "culprit"), [(lambda t: {"psi": np.degrees(t["psi"])}, "psi"), (lambda t: {"r": t["r"] / 57.3}, "r")]
)
def test_heading_and_rate_that_disagree_are_judged_by_the_track(made, spoil, culprit):
    [finding] = check(made.having(**spoil(made)))
    assert finding.channels == (culprit,)
    assert finding.kind == "unit"
    bare = replace(made, channels={n: made.having(**spoil(made))[n] for n in ("psi", "r")})
    [finding] = check(bare)  # from the two alone nobody can tell
    assert set(finding.channels) == {"psi", "r"}


@pytest.mark.slow
def test_a_rate_of_the_wrong_sign_is_no_wrong_rudder(made):
    found = check(made.having(r=-made["r"]))
    assert [(f.kind, f.channels) for f in found] == [("sign", ("r",))]
    alone = made.having(r=-made["r"])
    bare = replace(alone, channels={n: alone[n] for n in ("u", "r", "delta")})
    [finding] = check(bare)  # without a heading it may be the one or the other
    assert finding.what.startswith("rudder sign, or that of r")


def rounded(t, **steps):
    return t.having(**{name: np.round(t[name] / step) * step for name, step in steps.items()})


def at_sea(t):
    """The same run by Froude's law as a ship of 300 m would make it."""
    return froude_scaled(t, 100.0)


@pytest.mark.slow
def test_steps_of_ordinary_instruments_are_one_note(made):
    """A compass to half a degree, a log to a tenth of a knot, a turn indicator to a degree a minute: any bridge."""
    told = rounded(at_sea(made), psi=np.radians(0.5), u=0.0514, r=np.radians(1.0) / 60, U_T=0.514)
    coarse = [f for f in check(told) if "steps" in f.what]
    assert [f.severity for f in coarse] == ["info"]
    assert set(coarse[0].channels) <= {"psi", "u", "r", "U_T"}
    assert [f.severity for f in check(rounded(at_sea(made), U_T=1.0)) if f.what == "coarse steps"] == ["warning"]
    # the same receiver aboard the model is coarse
    assert [f.channels for f in check(rounded(made, x=0.15)) if f.what == "coarse steps"] == [("x",)]


@pytest.mark.slow
def test_one_gap_is_told_once(made):
    """A receiver and what is made of it fall out together, each at its own rate."""
    slow = thinned(made, 5, "x", "y")
    lost = (made.t > 60.0) & (made.t < 75.0)
    gone = slow.having(**{n: np.where(lost, np.nan, slow[n]) for n in ("x", "y", "psi", "u", "v_m")})
    gaps = [f for f in check(gone) if f.what == "gaps"]
    assert [f.channels for f in gaps] == [("x", "y", "psi", "u", "v_m")]
    assert "in 1 gap of up to 15" in gaps[0].evidence
    twice = poked(gone, "r", slice(100, 120), np.nan)  # another one is another one
    assert len([f for f in check(twice) if f.what == "gaps"]) == 2


def thinned(t, every, *names):
    at = np.arange(len(t)) % every
    return t.having(**{name: np.where(at, np.nan, t[name]) for name in names})


@pytest.mark.slow
def test_slower_instruments_are_one_note(made):
    (finding,) = check(thinned(made, 5, "U_A", "gamma_A"))
    assert finding.severity == "info"
    assert finding.where.endswith(": U_A, gamma_A")
    assert finding.what == f"sampled at {0.2 / made.dt:.3g} Hz"


def test_one_that_a_slower_instrument_leaves_out_is_a_gap(made):
    found = check(poked(thinned(made, 5, "U_A"), "U_A", slice(100, 111), np.nan))
    assert [(f.severity, f.what) for f in found] == [("warning", "gaps")]


def straight_then_turn():
    """A ship without noise: straight on for 40 s, then in a steady turn for as long."""
    t = np.arange(0.0, 80.0, 0.2)
    turning = np.maximum(t - 40.0, 0.0)
    u, v, r = 5.0, np.where(t > 40.0, -1.0, 0.0), np.where(t > 40.0, 0.02, 0.0)
    psi = 0.7 + 0.02 * turning
    aside = np.sin(psi) - np.sin(0.7), np.cos(0.7) - np.cos(psi)
    ahead = 5.0 * np.minimum(t, 40.0)
    x = ahead * np.cos(0.7) + (u * aside[0] + 1.0 * aside[1]) / 0.02
    y = ahead * np.sin(0.7) + (u * aside[1] - 1.0 * aside[0]) / 0.02
    channels = {"x": x, "y": y, "psi": psi, "u": np.full(t.size, u), "v_m": v, "r": r}
    return Trial("run", t, channels, {}, {"L_pp": 100.0})


def test_a_steady_run_without_noise_is_told_once_as_a_note():
    trial = straight_then_turn()
    [finding] = check(trial)
    assert finding.severity == "info"
    assert finding.where == "run: psi, u, v_m, r"
    assert "agree to 0.03 %" in finding.evidence
    slow = trial.having(u=np.where(np.arange(len(trial)) % 2, np.nan, trial["u"]))  # a log slower than the rows
    assert not [f for f in check(slow) if f.what in ("frozen sensor", "repeated values")]


def noisy(t):
    random = np.random.default_rng(1)
    sizes = {"x": 0.02, "y": 0.02, "u": 0.01, "v_m": 0.01}
    return t.having(**{name: t[name] + size * random.standard_normal(len(t)) for name, size in sizes.items()})


@pytest.mark.parametrize(
    ("spoil", "channels"),
    [
        (lambda t: poked(t, "psi", slice(250, 350), None), {"psi"}),
        (lambda t: poked(t, "r", slice(150, 350), None), {"r"}),
        (lambda t: poked(t, "x", slice(50, 150), None), {"x"}),
        (noisy, {"psi", "r"}),  # what else moves was measured, so these were too
        (lambda t: t.having(r=np.gradient(t["psi"], t.t)), {"psi"}),  # r is no second witness
    ],
)
def test_a_frozen_sensor_disagrees_with_the_others(spoil, channels):
    found = {f.where.removeprefix("run: ") for f in check(spoil(straight_then_turn())) if f.key in ("frozen", "zeros")}
    assert channels <= found


def test_overlap_between_training_and_test(made):
    part = replace(made.rows(slice(100, 300)), name="cut")
    [finding] = check_set([made], [part])
    assert finding.severity == "error"
    assert "200 rows" in finding.evidence
    other = replace(made.having(x=made["x"] + 0.1), name="other")
    assert check_set([made], [other]) == ()


def test_overlap_is_found_among_many_in_time_that_grows_with_them(made, monkeypatch):
    """Each recording is turned into keys once, however many there are on the other side."""
    many = [replace(made.rows(slice(k, k + 400)).having(x=made["x"][:400] + 1e3 * k), name=f"r{k}") for k in range(40)]
    calls: list[str] = []
    stack = Trial.stack
    monkeypatch.setattr(Trial, "stack", lambda self, *names: calls.append(self.name) or stack(self, *names))
    again = [replace(trial.rows(slice(50, 250)), name=f"again_{trial.name}") for trial in many]
    found = check_set(many, again)
    assert [f.trials for f in found] == [(one.name, other.name) for one, other in zip(many, again, strict=True)]
    assert all("200 rows are the same, 100 %" in f.evidence for f in found)
    assert len(calls) == 80


@pytest.mark.slow
def test_names_of_trials_are_fields_and_no_prose(made, tmp_path, capsys):
    """A trial called `port and starboard` is found under its own name."""
    for folder, name in (("train", "first and last"), ("test", "port and starboard")):
        (tmp_path / folder).mkdir()
        write_trial(made, tmp_path / folder / f"{name}.csv")
    assert main(["check", str(tmp_path / "test"), "--against", str(tmp_path / "train"), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["trials"]["port and starboard"]
    [finding] = [f for f in found if f["kind"] == "overlap"]
    assert finding["trials"] == ["first and last", "port and starboard"]


@pytest.mark.slow
def test_values_beyond_everything_and_a_clock_of_years_do_no_harm(made):
    [finding] = check(poked(made, "x", slice(7, 8), 1e308))
    assert (finding.severity, finding.what) == ("error", "beyond anything measured")
    years = replace(made.having(U_G=np.full(len(made), 0.5)), t=np.append(made.t[:-1], 9e9))
    assert "missing samples" in [f.what for f in check(years)]
    with pytest.raises(DataError, match="rows; cut it, or take longer steps"):
        resample(years, 0.1)


@pytest.mark.long
def test_esso_has_no_errors(data_file):
    trials = [frt_esso.read(p) for p in sorted(data_file("esso_osaka_frt", "data").glob("*/*.csv"))]
    errors = [str(f) for trial in trials for f in check(trial) if f.severity == "error"]
    assert errors == []
    cut = [t for t in trials if t.name == "turn_cut_14-Sep-2020_15_58_08"]
    rest = [t for t in trials if t.name != cut[0].name]
    [overlap] = check_set(rest, cut)
    assert overlap.where.startswith("turn_14-Sep-2020_15_58_08")


@pytest.mark.long
def test_simman_read_rightly_has_no_errors_and_raw_has(data_file):
    for folder in ("kvlcc2_hsva_simman2008", "kvlcc2_marin_simman2008"):
        files = sorted(data_file(folder, "raw").glob("*.dat"))
        assert files
        for path in files:
            trial = simman.read(path)
            assert [f for f in check(trial) if f.severity == "error"] == []
            raw: Trial = earth(trial).having(delta=-trial["delta"])
            words = " ".join(f.what for f in check(raw) if f.severity == "error")
            assert "north and east" in words
            # the rudder needs u going ahead: told once the velocities are right
            turned = check(trial.having(delta=-trial["delta"]))
            assert any("rudder sign" in f.what and f.severity == "error" for f in turned)


@pytest.mark.slow
@pytest.mark.parametrize("delta", [0.6, -0.6, 0.2])
def test_a_held_rudder_is_judged_by_the_turn_it_makes(delta):
    """A turn recorded from the execute on: the rudder hardly moves, only the sign of r tells."""
    t = np.arange(0.0, 120.0, 0.1)
    r = np.sign(delta) * 0.05 * (1 - np.exp(-t / 4)) * (0.6 + 0.4 * np.exp(-t / 20))
    psi = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * 0.1)])
    u = 0.5 + 0.5 * np.exp(-t / 20)
    rudder = delta * np.clip(t / 2.0, 0.0, 1.0)
    dx, dy = u * np.cos(psi), u * np.sin(psi)
    x, y = (np.concatenate([[0.0], np.cumsum(0.05 * (v[1:] + v[:-1]))]) for v in (dx, dy))
    trial = Trial("turn", t, {"x": x, "y": y, "psi": psi, "u": u, "v_m": 0 * t, "r": r, "delta": rudder})
    assert not [f for f in check(trial) if "rudder sign" in f.what]
    wrong = [f for f in check(trial.having(delta=-rudder)) if "rudder sign" in f.what]
    assert [f.severity for f in wrong] == ["error"]


def turning(t: Trial, degrees: bool, rate: float = 0.3, most: float = 9.0) -> Trial:
    """A thruster that turns to and fro at a steady rate [rad/s] up to `most` [rad]."""
    angle = most * (1 - np.abs((rate * t.t / most) % 2 - 1))
    return t.having(alpha_1=np.degrees(angle) if degrees else angle)


@pytest.mark.slow
def test_a_thruster_that_goes_round_is_not_in_degrees(made):
    [finding] = [f for f in check(turning(made, degrees=False)) if "alpha_1" in f.where]
    assert (finding.severity, finding.what) == ("info", "direction beyond one turn")
    for most in (0.2, 0.5, 9.0):
        found = [f for f in check(turning(made, True, most=most)) if "alpha_1" in f.where]
        assert [f.severity for f in found] == ["error"]
    declared = replace(turning(made, True), units={"alpha_1": "deg"})
    assert [f for f in check(declared) if "alpha_1" in f.where] == []
    steps = made.having(alpha_1_cmd=np.pi * np.sign(np.sin(made.t / 9)))
    assert [f for f in check(steps) if "alpha_1" in f.where] == []


@pytest.mark.slow
def test_a_berthing_coasts_with_its_propeller_near_rest(made):
    """Half of the log coasts; revolutions are of another unit only if the greatest are."""
    driven = np.where(made.t < 60.0, 8.0, np.where(made.t < 170.0, 0.02, -6.0))
    berthing = replace(made.having(n_P=driven), meta={"L_pp": 3.0})
    assert not [f for f in check(berthing) if f.channels == ("n_P",) and f.severity == "error"]
    for factor in (1.0 / 60.0, 60.0):
        steady = replace(made.having(n_P=np.full(len(made), 8.0 * factor)), meta={"L_pp": 3.0})
        assert [f.kind for f in check(steady) if f.channels == ("n_P",)] == ["unit"]
    coasting = check(berthing.having(n_P=driven / 60.0))
    assert [f.kind for f in coasting if f.channels == ("n_P",)] == ["unit"]


def test_a_heading_rounded_on_a_straight_course_is_no_slow_sensor():
    rng, t = np.random.default_rng(2), np.arange(600.0)
    heading = np.radians(np.round(rng.normal(40.0, 0.1, t.size), 1))
    u = rng.normal(8.0, 0.03, t.size)
    channels = {"x": np.cumsum(u) * np.cos(0.698), "y": np.cumsum(u) * np.sin(0.698), "psi": heading, "u": u}
    assert np.mean(np.diff(heading) == 0) > 0.25
    assert not [f for f in check(Trial("straight", t, channels)) if f.what == "repeated values"]


@pytest.mark.slow
def test_noise_of_fixes_is_no_distance(made: Trial) -> None:
    """At 10 Hz the noise of a receiver is as large as what the ship moves; a clock that is wrong is still seen."""
    hand = np.random.default_rng(1)
    x, y = (made[name] + 0.03 * hand.standard_normal(len(made)) for name in ("x", "y"))
    logged = made.having(x=x, y=y, U_G=np.hypot(made["u"], made["v_m"]))
    assert not [one for one in check(logged) if one.key == "time_scale"]
    slow = replace(logged, t=0.9 * logged.t).having(u=0.9 * logged["u"], v_m=0.9 * logged["v_m"])
    assert [one for one in check(slow) if one.key in ("time_scale", "scale", "log_scale")]
