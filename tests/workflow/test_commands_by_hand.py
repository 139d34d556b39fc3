"""What commands put together, by hand: antennas of a twin, noise of a design, tables of a plant, limits."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuator
from seatrial.belief.fit_first import Beginning
from seatrial.core.errors import RequestError
from seatrial.core.files import toml_of
from seatrial.core.parameters import read
from seatrial.data import DataError, Trial
from seatrial.data.sidecar import UNPLACED
from seatrial.data.trialfile import write_trial
from seatrial.identify.components.servo import ServoFit
from seatrial.identify.components.thrust_map import ThrustMap
from seatrial.models import STATES
from seatrial.realtime.afloat import reporter
from seatrial.realtime.links import wiring
from seatrial.realtime.range.reports import REPORTED
from seatrial.ships.files import load
from seatrial.workflow import Silent, comparing, demo, identify, judging, plant, seaway
from seatrial.workflow.afloat.scenes import alone, varied
from seatrial.workflow.asked import Around, Bands, Departure, InWaves, Predicting
from seatrial.workflow.comparing import purpose_of, scales_asked
from seatrial.workflow.contributing.published import Published, Reproduced, _found, published, shown
from seatrial.workflow.data import _damage, convert, guess_mapping, importing, mend
from seatrial.workflow.live import twin as following
from seatrial.workflow.plant import Slave, read_pull
from seatrial.workflow.request import banded
from seatrial.workflow.seaway.making import _keels

DEG = math.pi / 180.0
L7 = load("kvlcc2_l7")


class StopError(Exception):
    """Raised where a test has seen enough."""


@pytest.mark.parametrize(("stated", "of_the_log", "used"), [
    ("3,-2", (7.0, 1.0), (3.0, -2.0)), (None, (7.0, 1.0), (7.0, 1.0)), (None, None, None), ("3,-2", None, (3.0, -2.0)),
])  # fmt: skip
def test_a_twin_takes_the_antenna_that_is_stated_else_that_of_the_log(
    stated: str | None, of_the_log: Any, used: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Any] = []

    def usual(ship: Any, channels: Any, **given: Any) -> Any:
        seen.append(given["antenna"])
        raise StopError

    monkeypatch.setattr(following, "usual", usual)
    log = following._Log("a", ("x",), {}, lambda: iter(()), of_the_log)
    monkeypatch.setattr(following, "_log", lambda *_: log)
    with pytest.raises(StopError):
        following.twin(L7, nmea="a.nmea", antenna=stated)
    assert seen == [used]


def moving(name: str, seconds: float = 4.0, **meta: Any) -> Trial:
    t = 10.0 + np.arange(0.0, seconds + 0.5, 1.0)
    channels = {n: np.full(len(t), v) for n, v in (("x", 0.0), ("y", 0.0), ("psi", 0.1), ("u", 1.0), ("v_m", 0.0),
                                                   ("r", 0.0), ("n_P", 10.0), ("delta", 0.1))}  # fmt: skip
    return Trial(name, t, channels, meta=meta)


def test_trials_of_a_twin_follow_each_other_ten_lengths_of_way_apart() -> None:
    trials = (moving("a", 4.0), moving("b", 2.0))
    at = [t for t, _ in following._one_after_another(L7, trials, ())]
    gap = 10.0 * L7.L_pp / L7.speed
    assert at == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0, *(trials[0].duration + gap + k for k in range(3))])


@pytest.mark.slow
def test_a_trial_whose_antenna_nobody_placed_has_none_for_the_twin(tmp_path: Path) -> None:
    for placed, antenna in ((True, (0.0, 0.0)), (False, None)):
        write_trial(moving("a", processing=[] if placed else [UNPLACED]), tmp_path / "a.csv")
        log = following._log(L7, None, None, tmp_path / "a.csv", None, 10.0, print)
        assert log.antenna == antenna
        assert (log.name, log.live) == ("a.csv", False)
    for given in ((None, None, None), ("a", None, tmp_path / "a.csv"), ("a", tmp_path / "a", None)):
        with pytest.raises(RequestError, match="give one log"):
            following._log(L7, *given, None, 10.0, print)


def test_controls_that_act_at_once_are_held() -> None:
    at_once = replace(L7.actuators.of("delta"), rate=math.inf, lag=0.0)
    assert following._at_once(L7) == tuple(n for n in ("n_P", "delta") if L7.actuators.of(n).at_once)
    ship = replace(L7, actuators=replace(L7.actuators, by_name={**L7.actuators.by_name, "rudder": at_once}))
    assert "delta" in following._at_once(ship)


def test_a_noise_of_a_design_is_in_degrees_where_it_is_an_angle() -> None:
    assert judging._noise("x=0.5, psi=2,r=0.1,u=0.03") \
        == pytest.approx({"x": 0.5, "psi": 2.0 * DEG, "r": 0.1 * DEG, "u": 0.03})
    assert judging._in_words({"x": 0.5, "psi": 2.0 * DEG, "r": 0.1 * DEG}) == "x 0.5 m, psi 2 deg, r 0.1 deg/s"
    for text, told in (("z=1", "no channel 'z'"), ("x=a", "'x=a' is no deviation; write x=0.1"), ("x", "no deviation"),
                       ("x=0", "--noise is 0"), ("x=-1", "--noise is -1")):  # fmt: skip
        with pytest.raises(RequestError, match=told):
            judging._noise(text)


def test_options_of_bands_need_bands() -> None:
    for draws, extrapolate, option in ((10, False, "--draws"), (None, True, "--extrapolate"), (10, True, "--draws")):
        with pytest.raises(RequestError, match=f"{option} needs --bands"):
            banded(Bands(None, draws, extrapolate))
    assert not banded(Bands())
    assert banded(Bands(95.0, 10, True))


def test_an_open_water_test_replaces_the_thrust_of_the_propeller(tmp_path: Path) -> None:
    """K_T = .5 - .3 J - .1 J^2 at four J; a row with a gap is left out."""
    table = tmp_path / "ow.csv"
    rows = [(J, 0.5 - 0.3 * J - 0.1 * J * J) for J in (0.0, 0.2, 0.4, 0.6, 0.8)]
    for heads in ("J,Kt", "J [-],K_T [-]", "eta,J,KT"):
        first = "0," if heads.startswith("eta") else ""
        table.write_text("\n".join([heads, *(f"{first}{J},{K}" for J, K in rows), f"{first}1.0,"]) + "\n")
        made = judging._with_propeller(L7, table)
        assert [float(read(made.model, f"propeller.k_{k}")) for k in range(3)] == pytest.approx([0.5, -0.3, -0.1])
        assert made.entries["propeller.k_1"].source == "open-water test ow.csv"
    for heads in ("J,K", "J,J,Kt", "Kt,Q"):
        table.write_text(heads + "\n" + ",".join("1" * len(heads.split(","))) + "\n")
        with pytest.raises(DataError, match="an open-water test has one J and one K_T"):
            judging._with_propeller(L7, table)


@pytest.mark.parametrize(("more", "told"), [
    ({"form_factor": -0.01}, "--form-factor is -0.01; it is from 0 to 1"), ({"form_factor": 1.01}, "from 0 to 1"),
    ({"roughness": 0.011}, "--roughness is 0.011; it is from 0 to 0.01"), ({"roughness": -1e-6}, "--roughness"),
    ({"density": 0.0}, "--density is 0"),
])  # fmt: skip
def test_a_scale_that_cannot_be_is_refused(more: dict[str, float], told: str) -> None:
    with pytest.raises(RequestError, match=told):
        judging.scale(L7, 320.0, **more)
    with pytest.raises(RequestError, match="--to-length is 0"):
        judging.scale(L7, 0.0)


@pytest.mark.slow
def test_a_recommendation_is_for_a_purpose_that_is_known() -> None:
    with pytest.raises(RequestError, match="no purpose 'fishing'; known: "):
        judging.recommend("fishing")


@pytest.mark.parametrize("given", [{"hull": True}, {"dt": 0.1}, {"fmi": 2}, {"platforms": "linux64"}])
def test_options_of_a_slave_need_its_file(given: dict[str, Any]) -> None:
    (name,) = given
    usual: dict[str, Any] = {"path": None, "fmi": None, "hull": False, "dt": None, "platforms": None}
    with pytest.raises(RequestError, match=f"--{name} is of the co-simulation slave"):
        plant._slave(**(usual | given))
    assert plant._slave(**usual) is None


def test_a_slave_is_what_is_asked_for(tmp_path: Path) -> None:
    from seatrial.exchange.fmi.fmu import VERSIONS

    file = tmp_path / "a.fmu"
    assert plant._slave(file, None, False, None, None) == Slave(file, False, None, VERSIONS[0], ())
    assert plant._slave(file, VERSIONS[-1], True, 0.1, " linux64, ") \
        == Slave(file, True, 0.1, VERSIONS[-1], ("linux64",))
    for more, told in (((tmp_path / "a.zip", None, False, None, None), "ends in .fmu"),
                       ((file, 7, False, None, None), "--fmi is 7; known: "),
                       ((file, None, False, -0.1, None), "--dt is -0.1"),
                       ((file, None, False, None, "amiga"), "--platforms: ")):  # fmt: skip
        with pytest.raises(RequestError, match=told):
            plant._slave(*more)


def test_an_export_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "folder.py").mkdir()
    python, casadi = tmp_path / "a.py", tmp_path / "a.casadi"
    for given, told in (((None, None, None, None), "export to what"), ((python, None, python, None), "name one file"),
                        ((None, None, tmp_path / "a.txt", None), "ends in .py"),
                        ((None, None, tmp_path / "no" / "a.py", None), "no such folder"),
                        ((None, None, tmp_path / "folder.py", None), "is a folder"),
                        ((None, None, None, Slave(tmp_path / "no" / "a.fmu")), "no such folder")):  # fmt: skip
        with pytest.raises(RequestError, match=told):
            plant._check(*given)
    plant._check(casadi, None, python, None)
    plant._check(None, tmp_path / "c", None, None)
    plant._check(None, None, None, Slave(tmp_path / "a.fmu"))


def test_a_bollard_pull_is_read_in_si_a_thruster_a_column(tmp_path: Path) -> None:
    table = tmp_path / "pull.csv"
    table.write_text("n [rpm],n_2 [1/s],T_1 [kN],T_2 [N]\n60,1,0.5,10\n120,2,,20\n180,3,4.5,30\n")
    found = read_pull(table)
    assert found["1"][0].tolist() == pytest.approx([1.0, 3.0])
    assert found["1"][1].tolist() == pytest.approx([500.0, 4500.0])
    assert found["2"][0].tolist() == [1.0, 2.0, 3.0]
    assert found["2"][1].tolist() == [10.0, 20.0, 30.0]
    table.write_text("n [1/s],T [N]\n1,5\n")
    assert list(read_pull(table)) == ["1"]
    for text, told in (("n [1/s],T_1 [m]\n1,1\n", "column 'T_1 .m.': write revolutions as"),
                       ("n [N],T_1 [N]\n1,1\n", "column 'n .N.'"),
                       ("n [1/s],n [1/s],T_1 [N]\n1,1,1\n", "named twice"), ("n [1/s],T_1 [N]\n", "no rows below"),
                       ("n_1 [1/s],T_2 [N]\n1,1\n", "no revolutions; add n .1/s. or n_2"),
                       ("n [1/s],T_1 [N]\n1,\n", "no row has both"), ("n [1/s]\n1\n", "no thrust; add a column"),
                       ("Q [N]\n1\n", "column 'Q .N.'")):  # fmt: skip
        table.write_text(text)
        with pytest.raises(DataError, match=told):
            read_pull(table)


def test_tables_of_thrust_and_servos_are_read_back_as_they_were_fitted() -> None:
    variance = np.diag([0.0, 0.04, 0.09, 0.0, 0.0, 0.0])
    one = ThrustMap("1", np.array([0.0, 1.5, 2.5, 0.0, 0.0, 0.0]), variance, 0.7, -5.0, 12.0, 0.999, 0.1, (), 9)
    made = toml_of(plant._map_toml(one, 'a"b.csv'))
    own = made["thrusters"]["1"]
    assert (own["c_1"]["value"], own["c_1"]["unit"], own["c_1"]["sigma"]) == (1.5, "N s", pytest.approx(0.2))
    assert (own["c_2"]["value"], own["c_2"]["unit"], own["c_2"]["sigma"]) == (2.5, "N s^2", pytest.approx(0.3))
    assert not {"c_0", "c_3"} & set(own)
    assert (own["n_max"]["value"], own["astern"]["value"]) == (12.0, 0.7)
    assert own["astern"]["source"].startswith("bollard pull, a'b.csv: 9 rows")
    assert (made["actuators"]["n_1"]["low"]["value"], made["actuators"]["n_1"]["high"]["value"]) == (-5.0, 12.0)
    ahead = toml_of(plant._map_toml(replace(one, n_low=0.0), "t"))
    assert ahead["thrusters"]["1"]["astern"]["source"] == "assumed: not tested astern"
    force = toml_of(plant._map_toml(replace(one, covariance=np.diag([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])), "t"))
    assert force["thrusters"]["1"]["c_0"]["unit"] == "N"

    servo = ServoFit("delta", Actuator(rate=0.05, lag=0.4), {"rate": 0.001, "lag": math.nan, "offset": 0.1}, 0.1, 0.01,
                     0.99, 500)  # fmt: skip
    rudder = toml_of(plant._servo_toml(servo))["actuators"]["rudder"]
    assert (rudder["rate"]["value"], rudder["rate"]["unit"], rudder["rate"]["sigma"]) == (0.05, "rad/s", 0.001)
    assert (rudder["lag"]["value"], rudder["lag"]["unit"]) == (0.4, "s")
    assert "sigma" not in rudder["lag"]
    assert not {"dead_time", "type", "offset"} & set(rudder)
    assert "alpha_1" in toml_of(plant._servo_toml(replace(servo, control="alpha_1")))["actuators"]


def test_only_a_file_of_the_same_command_is_replaced(tmp_path: Path) -> None:
    out = tmp_path / "a.toml"
    plant._write(out, "[thrusters.1]\n[actuators.n_1]\n", lambda _: None)
    assert plant._ours(out, "thrusters")
    assert not plant._ours(out, "actuators")
    plant._write(out, "[actuators.rudder]\n", lambda _: None)
    assert plant._ours(out, "actuators")
    assert not plant._ours(out, "thrusters")
    plant._writable(out, "actuators")
    plant._writable(None, "actuators")
    out.write_text("[actuators.rudder]\n")
    with pytest.raises(RequestError, match="this command did not write it"):
        plant._writable(out, "actuators")
    out.write_text(f"{plant._HEADING}\n[")
    assert not plant._ours(out, "actuators")


def test_a_purpose_has_its_limits_or_those_that_are_given() -> None:
    from seatrial.choosing.purposes import PURPOSES

    usual = next(one for one in PURPOSES if one.accuracy)
    assert purpose_of(usual.key, None) == usual
    first = usual.accuracy[0]
    made = purpose_of(usual.key, f" {first.key}=12.5 ")
    assert (made.accuracy[0].size, made.accuracy[0].source) == (12.5, "as asked for by --limit")
    assert made.accuracy[1:] == usual.accuracy[1:]
    for text in ("0", "-1", "inf", "nan", "a", ""):
        with pytest.raises(RequestError, match=f"write {first.key}="):
            purpose_of(usual.key, f"{first.key}={text}")
    with pytest.raises(RequestError, match="--limit: no limit 'weight'"):
        purpose_of(usual.key, "weight=1")
    with pytest.raises(RequestError, match="--for is 'fishing'; errors are judged for: "):
        purpose_of("fishing", None)


def test_errors_are_divided_by_what_is_given_for_all_states_else_by_the_spread() -> None:
    from seatrial.validate.metrics import ESSO_OSAKA_SIGMA, scales, spread

    one, given = moving("a"), {name: 1.0 + k for k, name in enumerate(STATES)}
    rising = one.having(x=one.t, y=2.0 * one.t, psi=0.1 * one.t, u=0.2 * one.t, v_m=0.3 * one.t, r=0.4 * one.t)
    assert scales([rising], given) == given
    assert scales([rising], {"x": 1.0}) == scales([rising], None) == spread([rising])
    basin = replace(rising, meta={"source": "FRT-DS-ESSO, basin"})
    assert scales([basin], None) is ESSO_OSAKA_SIGMA
    assert scales([basin, rising], None) == spread([basin, rising])
    assert scales_asked([rising], None) == (spread([rising]), "the spread of these trials")
    assert scales_asked([basin], None)[1] == "those of the common evaluator of this set"


def test_names_of_many_trials_are_cut() -> None:
    assert comparing._named(list("abcd")) == "a, b, c, d"
    assert comparing._named(list("abcde")) == "a, b, c and 2 more"


def begun(size: float, **found: tuple[float, float]) -> list[str]:
    values = {name.replace("_", ".", 1): value for name, (value, _) in found.items()}
    sigmas = {name.replace("_", ".", 1): sigma for name, (_, sigma) in found.items()}
    return comparing._begun_words(L7, Beginning(moving("a"), 14.0, np.zeros(6), values, sigmas, size), 4.0)


def test_what_the_first_seconds_say_is_told_beyond_two_sigma() -> None:
    from seatrial.identify.diagnosis.channels import LARGE

    known = {"current_north": (0.0, 0.1), "current_east": (0.3, 0.1), "bias_u": (0.019, 0.01)}
    (line,) = begun(1.0, **known)
    assert line == "a: from its first 4 s: a current of 0.3 m/s towards 90 deg"
    (line,) = begun(1.0, **{**known, "current_north": (0.05, 0.1)})  # both components, where one is clear
    assert "towards 80.5 deg" in line
    (line,) = begun(1.0, **{**known, "bias_u": (-0.021, 0.01)})
    assert "a current of 0.3" in line
    assert "ahead" in line or "bias" in line
    (line,) = begun(1.0, **{**known, "current_east": (0.19, 0.1)})
    assert line == "a: from its first 4 s: no current and no bias beyond 2 sigma"
    assert len(begun(1.01 * LARGE, **known)) == 2
    assert "part of what was estimated is its own error" in begun(1.01 * LARGE, **known)[1]
    (line,) = begun(1.01 * LARGE, current_north=(0.0, 0.1))
    assert "no current and no bias is estimated" in line
    assert len(begun(0.99 * LARGE, **known)) == 1


def test_a_prediction_has_a_history_or_fits_first_and_a_model_in_continuous_time() -> None:
    assert comparing.carrier_of(L7, Predicting(fit_first=5.0)) is None
    with pytest.raises(RequestError, match="--fit-first already estimates"):
        comparing.carrier_of(L7, Predicting(history=5.0, fit_first=5.0))
    with pytest.raises(RequestError, match="is a model in discrete time"):
        comparing.carrier_of(load("kvlcc2_l7_arx"), Predicting(history=5.0))
    assert comparing.carrier_of(L7, Predicting(history=5.0)) is not None


def test_a_fit_is_beside_the_ship_that_it_began_from() -> None:
    """Rebuilt from its provenance; called published where the library has it with the same numbers."""
    made = {"provenance": {"ship": "kvlcc2_l7", "began": {"hull.N_r": float(read(L7.model, "hull.N_r"))}}}
    fitted = replace(L7.having({"hull.N_r": -0.06}), name="mine", notes=made)
    models = comparing._models(fitted, None)
    assert list(models) == ["fitted", "published"]
    assert models["fitted"] is fitted
    assert float(read(models["published"].model, "hull.N_r")) == float(read(L7.model, "hull.N_r"))
    other = replace(fitted, notes={"provenance": {"ship": "kvlcc2_l7", "began": {"hull.N_r": -0.07}}})
    assert list(comparing._models(other, None)) == ["fitted", "untuned"]
    assert float(read(comparing._models(other, None)["untuned"].model, "hull.N_r")) == -0.07
    old = replace(fitted, notes={"provenance": {"ship": "kvlcc2_l7"}})
    assert comparing._models(old, None)["published"].model == load("kvlcc2_l7").model
    assert list(comparing._models(replace(old, notes={"provenance": {"ship": "nowhere"}}), None)) == ["fitted"]
    assert list(comparing._models(L7, None)) == ["published"]
    assert list(comparing._models(replace(L7, name="mine"), None)) == ["mine"]
    assert list(comparing._models(replace(L7, name="mariner"), None)) == ["mariner"]  # another structure
    assert comparing._models(L7, fitted)["untuned"] is fitted


def test_how_much_is_done_already_is_said() -> None:
    lines: list[str] = []

    class Sink(Silent):
        def note(self, line: str) -> None:
            lines.append(line)

    for done, count in ((1, 1), (3, 3), (2, 3), (0, 3)):
        identify._note_done(done, count, Path("run"), Sink())
    assert [line.partition(",")[0] for line in lines] \
        == ["run: this study is done already", "run: every fit is done already", "run: 2 of 3 fits are done already"]


def test_a_run_resumes_from_a_fit_or_a_checkpoint(tmp_path: Path) -> None:
    assert not identify.resumes(tmp_path)
    (tmp_path / "a").mkdir()
    for name, goes_on in (("other.npz", False), ("checkpoint.start-1.npz", True), ("fit.json", True)):
        (tmp_path / "a" / name).write_text("")
        assert identify.resumes(tmp_path) is goes_on
        (tmp_path / "a" / name).unlink()


def test_the_demo_logs_twenty_seconds_of_straight_approach() -> None:
    t = np.arange(0.0, 1.0, 0.1)
    names = ("x", "y", "psi", "u", "v_m", "r", "n_P", "n_P_cmd", "delta")
    run = demo._with_approach(Trial("a", t, {n: np.full(10, 5.0) for n in names}), 1.2, 10.0)
    before = run.t < -0.05
    assert run.t[0] == -20.0
    assert np.diff(run.t) == pytest.approx(0.1)
    assert before.sum() == 200
    assert run["x"][before] == pytest.approx(1.2 * run.t[before])
    for name, value in (("u", 1.2), ("n_P", 10.0), ("n_P_cmd", 10.0), ("y", 0.0), ("delta", 0.0), ("r", 0.0)):
        assert run[name][before] == pytest.approx(value)
        assert run[name][~before].tolist() == [5.0] * 10


def test_damage_of_a_log_is_counted() -> None:
    assert _damage({"all": 90, "invalid": 3, "untimed": 0}) == "3 of 90 lines are no valid sentence and are left out"
    assert _damage({"all": 90, "untimed": 4}) == "4 sentences have no time and are left out"
    assert " and 4 sentences" in _damage({"all": 90, "invalid": 3, "untimed": 4})
    assert _damage({"all": 90}) == ""


def test_an_import_names_what_is_missing(tmp_path: Path) -> None:
    assert importing("csv", tmp_path, tmp_path / "o") == ("csv", tmp_path, tmp_path / "o")
    for format, source in ((None, tmp_path), ("csv", None)):
        with pytest.raises(RequestError, match="give FORMAT and SRC"):
            importing(format, source, tmp_path)
    with pytest.raises(RequestError, match="give the folder for the trial files"):
        importing("csv", tmp_path, None)
    with pytest.raises(RequestError, match="stands alone: leave out csv"):
        guess_mapping(tmp_path, None, "csv")
    (tmp_path / "m.toml").write_text("")
    with pytest.raises(RequestError, match="is there already"):
        guess_mapping(tmp_path, tmp_path / "m.toml")
    with pytest.raises(RequestError, match="--to: no format 'vhs'"):
        convert([tmp_path], "vhs", tmp_path)


def test_steps_are_for_trials_that_are_there_and_names_stay_apart(tmp_path: Path) -> None:
    from seatrial.data.prepare import Step, steps_text

    (tmp_path / "logs").mkdir()
    for name in ("a", "b"):
        write_trial(moving(name, 99.0), tmp_path / "logs" / f"{name}.csv")
    steps = tmp_path / "steps.toml"

    def cut(name: str) -> list[Path]:
        step = Step(do="cut", where=((50.0, 55.0),), trials=(name,))
        steps.write_text(steps_text([("a fault", [step])]), encoding="utf-8")
        return mend([tmp_path / "logs"], steps, tmp_path / "out")

    with pytest.raises(DataError, match="no trial 'c'"):
        cut("c")
    assert not (tmp_path / "out").exists()
    assert sorted(path.stem for path in cut("a")) == ["a_1", "a_2", "b"]
    write_trial(moving("a_2"), tmp_path / "logs" / "a_2.csv")
    with pytest.raises(DataError, match="two trials would be called a_2; rename one"):
        cut("a")


def test_a_published_index_is_kept_within_its_share() -> None:
    one = Published("code", "turning", {}, "advance", 4.0, True, "L", 0.05, "s")
    for value, kept in ((4.199, True), (4.201, False), (3.801, True), (3.799, False), (math.nan, False)):
        assert Reproduced(one, value).kept is kept
    assert Reproduced(one, 5.0).ratio == 1.25
    assert math.isnan(Reproduced(replace(one, value=0.0), 5.0).ratio)
    below = replace(one, value=-4.0)
    assert Reproduced(below, -4.1).kept
    assert shown(one, 4.0) == "4 L"
    assert shown(replace(one, unit="deg"), 10.0 * DEG) == "10 deg"
    ran: Any = SimpleNamespace(policy=SimpleNamespace(indices=lambda t, L: {"advance": SimpleNamespace(value=50.0)}),
                               trial=None, ship=SimpleNamespace(L_pp=10.0), complete=True, reason=None)
    assert _found(L7, one, ran).value == 5.0
    assert _found(L7, replace(one, lengths=False), ran).value == 50.0
    with pytest.raises(RequestError, match="no index 'transfer'"):
        _found(L7, replace(one, index="transfer"), ran)
    ran.complete = False
    assert _found(L7, replace(one, index="transfer"), ran).reason == "the run did not reach it"
    ran.reason = "left its validity"
    assert _found(L7, replace(one, index="transfer"), ran).reason == "left its validity"
    assert _found(L7, one, "it failed").reason == "it failed"


def test_a_published_entry_is_in_si_or_lengths() -> None:
    def entry(**more: Any) -> Published:
        usual = {"by": "trial", "manoeuvre": "zigzag", "index": "first_overshoot", "within": 0.1, "source": "s", **more}
        (found,) = published(replace(L7, notes={"published": [usual]}))
        return found

    degrees = entry(value=10.0, unit="deg", rudder=20.0, heading=15.0)
    assert (degrees.value, degrees.lengths, degrees.unit) == (pytest.approx(10.0 * DEG), False, "deg")
    assert degrees.settings == {"rudder": 20.0, "heading": 15.0}
    lengths = entry(over_L=3.25)
    assert (lengths.value, lengths.lengths, lengths.unit, lengths.within) == (3.25, True, "L", 0.1)
    for more, told in (({}, "give over_L"), ({"value": 1.0, "over_L": 1.0}, "give over_L"),
                       ({"value": 1.0}, "no unit ''"), ({"over_L": "a"}, "value and within are numbers"),
                       ({"over_L": 1.0, "within": 0.0}, "within is 0"), ({"over_L": 1.0, "within": 1.0}, "within is 1"),
                       ({"over_L": math.inf}, "within is 0.1"),
                       ({"over_L": 1.0, "deep": 1}, "no key 'deep'"),
                       ({"over_L": 1.0, "by": "hearsay"}, "no by")):  # fmt: skip
        with pytest.raises(RequestError, match=told):
            entry(**more)
    with pytest.raises(RequestError, match="is a list of tables"):
        published(replace(L7, notes={"published": {"a": 1}}))
    with pytest.raises(RequestError, match="entry 1: not a table"):
        published(replace(L7, notes={"published": [3]}))


def test_bilge_keels_are_a_breadth_and_a_length() -> None:
    assert _keels(None) == (0.0, 0.0)
    assert _keels("0.4,60") == (0.4, 60.0)
    assert _keels("0,0") == (0.0, 0.0)
    for text in ("0.4", "a,b", "5,60", "0.4,500", "-0.1,60", "0.4,-1", "1,2,3"):
        with pytest.raises(RequestError, match=f"--keels is '{text}'"):
            _keels(text)


def test_a_sea_needs_operators_and_waves_are_given_once() -> None:
    swell = Around(waves="1,8,0")
    calm = seaway.bound_for(L7, InWaves(), 1, swell, lambda _: None)
    assert (calm.sea, calm.rao, calm.around) == (None, None, swell)
    assert calm.seen(moving("a"), lambda _: None)[1] == {}
    rao = Path("a.csv")
    for waves in (InWaves("1,8,0"), InWaves(rao=rao), InWaves(roll_damping=0.05)):
        with pytest.raises(RequestError, match="--sea and --rao go together"):
            seaway.bound_for(L7, waves, 1, Around(), lambda _: None)
    with pytest.raises(RequestError, match="leave one of --waves and --sea out"):
        seaway.bound_for(L7, InWaves("1,8,0", rao), 1, swell, lambda _: None)


def test_a_transponder_has_nine_digits_and_sentences_their_rates() -> None:
    from seatrial.realtime.on_wire import RATES, TRANSPONDER, TRANSPONDER_RATE
    from seatrial.realtime.range.stage import Stage

    for mmsi in (200_000_000, 799_999_999):
        fit = Stage(scene(Departure(place="35,139", antenna="1,2", mmsi=mmsi))).fittings
        assert (fit.mmsi, fit.antenna) == (mmsi, (1.0, 2.0))
        assert fit.stern == pytest.approx(-0.5 * L7.L_pp)
    for mmsi in (199_999_999, 800_000_000):
        with pytest.raises(RequestError, match=f"--mmsi is {mmsi}"):
            scene(Departure(mmsi=mmsi))
    plain = Stage(scene(Departure())).fittings
    assert (plain.mmsi, plain.antenna) == (0, (0.0, 0.0))
    assert Stage(scene(Departure(sensors=True))).fittings.antenna == (-0.4 * L7.L_pp, 0.0)
    assert wiring.chosen(None) == (None, REPORTED)
    assert wiring.chosen(f" hdt ,{TRANSPONDER.lower()},ttm") \
        == ({"HDT": RATES["HDT"], TRANSPONDER: TRANSPONDER_RATE}, ("TTM",))
    with pytest.raises(RequestError, match="--only: no sentence 'ABC'"):
        wiring.chosen("ABC")


def scene(departure: Departure) -> Any:
    return varied(alone(L7), departure, Around(), InWaves(), lambda _: None)


def test_a_start_has_a_place_and_one_heading() -> None:
    own = scene(Departure(start="10,-20,90", speed=0.5)).own.sailing
    assert (own.x, own.y, own.psi, own.speed) == pytest.approx((10.0, -20.0, 0.5 * math.pi, 0.5))
    assert scene(Departure(heading=30.0)).own.sailing.psi == pytest.approx(math.radians(30.0))
    with pytest.raises(RequestError, match="--start and --heading both give the heading"):
        scene(Departure(start="10,-20,90", heading=30.0))
    with pytest.raises(RequestError, match="--start is '10,90'; write X,Y,DEG"):
        scene(Departure(start="10,90"))


def test_each_event_of_a_loop_is_told_once() -> None:
    lines: list[str] = []
    report = reporter(lines.append)
    loop: Any = SimpleNamespace(report=SimpleNamespace(events={}), events=[])

    def happens(*texts: str) -> None:
        for text in texts:
            loop.events.append(SimpleNamespace(t=1.5, kind="late", text=text))
            loop.report.events["late"] = loop.report.events.get("late", 0) + 1
        report(loop)

    report(loop)
    happens("a")
    happens()
    happens("b", "c")
    assert [line.rpartition(": ")[2] for line in lines] == ["a", "b", "c"]
    assert lines[0] == "      1.5 s  late: a"
