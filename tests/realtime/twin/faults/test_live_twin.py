"""The live twin on short voyages: it follows, learns, names faults, goes on, and says so where it cannot tell."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.identify import StudyError
from seatrial.identify.filters.augmented import augmented
from seatrial.identify.filters.kalman import Extended, trace
from seatrial.identify.filters.measurement import Antenna, Heading, Rate
from seatrial.identify.nuisance import CURRENT
from seatrial.realtime.twin.faults.alarms import Judge
from seatrial.realtime.twin.faults.stuck import FOLLOWS, JAMMED, SLOW, Repeats, Steering
from seatrial.realtime.twin.faults.suspects import JUMP, Evidence, Suspect, threshold
from seatrial.realtime.twin.likely import FACTORS, likeliest
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.saved import learnt, load_state, save_state
from seatrial.realtime.twin.settings import usual
from seatrial.realtime.twin.tally import Tally
from seatrial.ships.files import load
from voyages import NOISE, Voyage, coaster

AT = 615.0


@pytest.fixture(scope="module")
def ship():
    return coaster()


def sailed(voyage: Voyage, estimator: str = "ekf", free: tuple[str, ...] = ("hull.R_0",)) -> Live:
    """A twin after the voyage."""
    live = twin(voyage, estimator, free)
    for (t, read), _ in voyage.rows():
        live.feed(t, read)
    return live


def twin(voyage: Voyage, estimator: str = "ekf", free: tuple[str, ...] = ("hull.R_0",)) -> Live:
    """A twin before the voyage."""
    settings = usual(voyage.ship, list(NOISE), noise=NOISE, free=free, estimator=estimator)
    return Live(voyage.ship, settings, ("delta", "delta_cmd"))


@pytest.mark.slow
def test_further_states_are_those_of_the_filter(ship) -> None:
    """With the states that the offline filter has too, both move and read alike."""
    sensors = (Antenna(0.5), Heading(0.01), Rate(0.001))
    ours, theirs = augmented(ship, (*CURRENT, "hull.R_0"), sensors, {}), trace(ship, (*CURRENT, "hull.R_0"), sensors)
    z = np.array([1.0, 2.0, 0.3, 3.0, 0.1, 0.01, 0.2, -0.1, 0.02])
    acting = np.zeros(10)
    acting[:2] = 2.0, 0.2
    for a, b in ((ours.model.step(z, acting, 0.5), theirs.step(z, acting, 0.5)),
                 (ours.model.read(z, acting), theirs.read(z, acting))):  # fmt: skip
        for one, other in zip(a, b, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-14)
    engine = Extended(ours.model, np.zeros(9), 0.5)
    assert engine.predict(z, np.eye(9), acting, 0.5).mean.shape == (9,)


@pytest.mark.slow
def test_slow_forces_push_and_biases_are_read(ship) -> None:
    traced = augmented(ship, ("slow.u", "bias.r"), (Antenna(0.5), Rate(0.001)), {"slow.u": 100.0})
    z, acting = np.zeros(8), np.zeros(10)
    z[3], z[6], z[7] = 3.0, 0.01, 0.002
    pushed, calm = (traced.onward(one, acting, 1.0)[0] for one in (z, np.where(np.arange(8) == 6, 0.0, z)))
    assert pushed[3] - calm[3] == pytest.approx(0.01, rel=0.02)
    assert pushed[6] == pytest.approx(0.01 * math.exp(-0.01), rel=1e-6)
    assert traced.model.read(z, acting)[0][2] == pytest.approx(0.002)
    with pytest.raises(StudyError, match=r"slow\.u"):
        augmented(ship, ("slow.uu",), (Rate(0.001),), {})


@pytest.mark.long
def test_it_follows_without_an_alarm_and_its_innovations_are_as_stated(ship) -> None:
    voyage = Voyage(ship, 0.5, current=lambda t: (0.3, -0.2), bias=0.0005)
    live = sailed(voyage)
    assert live.alarms == []
    hour = live.tally.hours[0]
    low, high = hour.band(0.999)
    assert low < hour.mean < high
    assert live.follower is not None
    for name, true in zip((*CURRENT, "bias.r"), (0.3, -0.2, 0.0005), strict=True):
        value, sd = live.follower.value(name)
        assert abs(value - true) < 4.0 * sd < 0.2
    score = live.trust.scores[30.0]
    assert score.count > 15
    assert score.rms < score.rival
    assert score.held > 0.75


@pytest.mark.long
@pytest.mark.parametrize(("fault", "cause"), [
    ("gnss jump", "position jumped"), ("lost propeller", "n_P without its thrust"), ("log stuck", "log frozen"),
])  # fmt: skip
def test_faults_are_named_within_a_minute(ship, fault: str, cause: str) -> None:
    live = sailed(Voyage(ship, (AT + 60.0) / 3600.0, fault=fault, at=AT))
    assert [one.cause for one in live.alarms] == [cause]
    assert 0.0 < live.alarms[0].named - AT <= 60.0


@pytest.mark.slow
def test_a_rudder_whose_angle_is_logged_with_the_wrong_sign_is_named_and_lived_with(ship) -> None:
    """From the first turn on it is taken as it acts, and the readings are as likely as ever."""
    live = twin(Voyage(ship, 0.4))
    for (t, read), _ in Voyage(ship, 0.4).rows():
        live.feed(t, read | {name: -read[name] for name in ("delta", "delta_cmd")})
    (alarm,) = live.alarms
    assert alarm.cause == "delta of the wrong sign"
    assert 600.0 < alarm.named < 660.0
    assert live.follower is not None
    assert abs(live.follower.value("hull.R_0")[0] / float(ship.model.hull.R_0) - 1.0) < 0.1


@pytest.mark.slow
def test_a_killed_twin_goes_on_with_the_same_numbers(ship, tmp_path: Path) -> None:
    voyage, kept = Voyage(ship, 0.06), tmp_path / "twin.json"
    rows = [row for row, _ in voyage.rows()]
    whole, first, second = twin(voyage), twin(voyage), twin(voyage)
    for t, read in rows:
        whole.feed(t, read)
    for t, read in rows[:120]:
        first.feed(t, read)
    save_state(first, kept)
    begun = load_state(second, kept)
    for t, read in rows[120:]:
        assert t > begun
        second.feed(t, read)
    assert whole.follower is not None
    assert second.follower is not None
    np.testing.assert_array_equal(whole.follower.mean, second.follower.mean)
    with pytest.raises(StudyError, match="another ship, log or choice"):
        load_state(twin(voyage, free=()), kept)
    kept.write_text("{}")
    with pytest.raises(StudyError, match=r"twin\.json: .*seatrial-twin/4.*; remove it, or give another folder"):
        load_state(twin(voyage), kept)


@pytest.mark.long
def test_what_it_learnt_is_a_ship_with_its_source(ship) -> None:
    live = sailed(Voyage(ship, 0.2, R_0=lambda t: 1.2))
    found = learnt(live, "a.csv")
    assert float(found.model.hull.R_0) > float(ship.model.hull.R_0)
    assert found.entries["hull.R_0"].source.startswith("live twin on a.csv to t = ")
    assert found.entries["hull.R_0"].sigma is not None


@pytest.mark.long
def test_moving_horizon_follows_as_well(ship) -> None:
    voyage = Voyage(ship, 0.06)
    ekf, mhe = sailed(voyage), sailed(voyage, "mhe")
    assert ekf.follower is not None
    assert mhe.follower is not None
    sd = np.sqrt(np.diagonal(ekf.follower.cov))
    assert (np.abs(ekf.follower.mean - mhe.follower.mean) < 0.5 * sd + 1e-9).all()
    assert not np.array_equal(ekf.follower.mean, mhe.follower.mean)


@pytest.mark.slow
def test_gaps_late_rows_and_a_clock_set_back_end_nothing(ship) -> None:
    voyage = Voyage(ship, 0.2)
    live = twin(voyage)
    rows = [row for row, _ in voyage.rows()]
    for t, read in rows[:200]:
        live.feed(t, read)
    assert not live.feed(rows[198][0], rows[198][1])
    assert live.counts.late == 1
    live.feed(rows[200][0], {"n_P": rows[200][1]["n_P"]})  # no reading at all
    assert live.feed(*rows[500])
    assert live.counts.gaps == 1
    before = live.follower.value("hull.R_0") if live.follower else None
    assert live.feed(10.0, rows[501][1])
    assert live.counts.restarts == 1
    assert live.alarms[-1].cause == "the clock was set back"
    assert live.follower is not None
    assert before is not None
    assert live.follower.value("hull.R_0")[0] == before[0]
    assert np.isfinite(live.follower.mean).all()


@pytest.mark.parametrize("wrong", [{"n_P": 2.0}, {"psi": 1.0, "x": 0.0, "y": 0.0}])
@pytest.mark.slow
def test_without_all_of_it_nothing_begins(ship, wrong: dict[str, float]) -> None:
    live = twin(Voyage(ship, 0.1))
    assert not live.feed(0.0, wrong)
    assert live.follower is None
    assert live.counts.waiting == 1


def test_settings_refuse_what_they_cannot_use(ship) -> None:
    with pytest.raises(StudyError, match="heading and position"):
        usual(ship, ["x", "y", "r"])
    with pytest.raises(StudyError, match=r"hull\.R_0"):
        usual(ship, list(NOISE), free=("hull.R0",))
    with pytest.raises(StudyError, match="ekf or mhe"):
        usual(ship, list(NOISE), estimator="kf")
    arx = load("kvlcc2_l7_arx")
    with pytest.raises(StudyError, match="discrete time"):
        Live(arx, usual(arx, list(NOISE)))


@pytest.mark.slow
def test_a_log_too_short_for_a_forecast_is_judged_by_its_innovations(ship) -> None:
    rows = [row for row, _ in Voyage(ship, 60.0 / 3600.0).rows()]
    settings = usual(ship, list(NOISE), noise=NOISE)
    found, factors = likeliest(ship, settings, rows)
    assert found == factors.applied(settings)
    assert factors.motion in FACTORS


@pytest.mark.long
@pytest.mark.parametrize(("stated", "sea", "wanted"), [(0.25, 0.0, 4.0), (1.0, 1.0, 1.0), (1.0, 10.0, 1.0)])
def test_jitter_goes_to_the_sensors_and_the_sea_to_the_motion(ship, stated: float, sea: float, wanted: float) -> None:
    """Noise stated four times too small is found; a rough sea is not taken for it."""
    rows = [row for row, _ in Voyage(ship, 0.25, sea=sea).rows()]
    settings = usual(ship, list(NOISE), noise={name: stated * sd for name, sd in NOISE.items()})
    _, factors = likeliest(ship, settings, rows)
    assert factors.noise == wanted
    assert factors.motion >= 3.0 if sea > 1.0 else factors.motion <= 1.0


def test_patterns_free_what_is_not_zero(ship) -> None:
    some = usual(ship, list(NOISE), noise=NOISE, free=("hull.R_*", "rudder.*"))
    assert "hull.R_0" in some.free
    assert all(path.startswith(("hull.R_", "rudder.")) for path in some.free)
    assert all(some.process[path] > 0.0 for path in some.free)
    with pytest.raises(StudyError, match=r"no parameter 'keel\.\*'"):
        usual(ship, list(NOISE), noise=NOISE, free=("keel.*",))


def test_a_share_says_how_uncertain_a_parameter_is_at_first(ship) -> None:
    some = usual(ship, list(NOISE), noise=NOISE, free=("hull.*=0.3", "hull.R_0=0.05", "rudder.t_R"))
    size = {path: abs(float(values(ship.model)[path])) for path in some.free}
    shares = {path: some.start[path] / size[path] for path in some.free}
    assert shares.pop("hull.R_0") == pytest.approx(0.05)
    assert shares.pop("rudder.t_R") == pytest.approx(0.1)
    assert list(shares.values()) == pytest.approx([0.3] * len(shares))
    for wrong in ("0", "-1", "much", "", "nan"):
        with pytest.raises(StudyError, match=rf"--free hull.R_0={wrong}: '{wrong}' is not a share"):
            usual(ship, list(NOISE), noise=NOISE, free=(f"hull.R_0={wrong}",))


def test_repeats_count_against_the_habit_of_the_log() -> None:
    noisy, coarse, rng = Repeats(), Repeats(), np.random.default_rng(0)
    for k in range(200):
        noisy.note(k, {"psi": rng.standard_normal()})
        coarse.note(k, {"psi": round(0.5 * rng.standard_normal())})
    for k in range(200, 212):
        noisy.note(k, {"psi": 0.5})
        coarse.note(k, {"psi": 0.0})
    assert noisy.stuck("psi") == 200.0
    assert coarse.stuck("psi") is None


@pytest.mark.parametrize(("share", "word"), [(0.0, JAMMED), (0.3, SLOW), (1.0, FOLLOWS)])
def test_a_rudder_is_judged_by_what_its_order_calls_for(share: float, word: str) -> None:
    steering = Steering("delta", rate=0.05, lag=0.0)
    angle = 0.0
    steering.note(-1.0, {"delta": 0.0, "delta_cmd": 0.0})
    for k in range(12):
        steering.note(float(k), {"delta": angle, "delta_cmd": 0.6})
        angle = min(angle + 0.05 * share, 0.6)
    verdict = steering.verdict()
    assert verdict is not None
    assert verdict[0] == word
    still = Steering("delta", 0.05, 0.0)
    for k in range(12):
        still.note(float(k), {"delta": 0.1, "delta_cmd": 0.1})
    assert still.verdict() is None


@pytest.mark.parametrize("off", [math.radians(5.0), math.radians(-5.0)])
def test_a_sensor_that_stands_beside_the_rudder_is_no_jam(off: float) -> None:
    """From the beginning, and from the middle on, whether the order stays or moves."""
    for begins in (0, 60):
        steering, angle, said = Steering("delta", rate=0.04, lag=0.0), 0.0, set[str]()
        for k in range(120):
            order = 0.0 if k < 20 or 70 <= k < 95 else 0.3
            steering.note(float(k), {"delta": angle + (off if k >= begins else 0.0), "delta_cmd": order})
            angle += min(max(order - angle, -0.04), 0.04)
            found = steering.verdict()
            said |= {found[0]} if found else set()
        assert said <= {FOLLOWS}


def test_a_rudder_that_is_quicker_than_its_ship_file_says_follows() -> None:
    """Hard over within a second, several times what the rate allows."""
    steering = Steering("delta", rate=0.06, lag=0.0)
    for k in range(12):
        order = -0.35 if k >= 2 else 0.0
        steering.note(float(k), {"delta": -0.35 if k >= 3 else 0.0, "delta_cmd": order})
        assert steering.verdict() is None or steering.verdict()[0] == FOLLOWS  # type: ignore[index]


def test_a_fault_is_named_when_it_is_clear_and_large_enough() -> None:
    def evidence(cause: str, score: float, size: float = 5.0) -> Evidence:
        return Evidence(Suspect(cause, JUMP, (cause,), (10.0,), "m"), score, 0.0, (size,), (0.1,))

    judge = Judge(threshold(10, 5.0, 0.2))
    assert judge.named(0.0, [evidence("a", 60.0), evidence("b", 20.0)]) is None  # maybe an outlier
    named = judge.named(3.0, [evidence("a", 60.0), evidence("b", 20.0)])
    assert named is not None
    assert named[0].suspect.cause == "a"
    assert named[1] == ()
    judge.clear()
    close = [evidence("a", 60.0), evidence("b", 58.0)]
    assert judge.named(0.0, close) is None
    assert judge.named(10.0, close) is None
    named = judge.named(21.0, close)
    assert named is not None
    assert named[1] == ("b",)
    assert judge.named(30.0, [evidence("a", 60.0, size=0.01)]) is None


def test_hours_are_held_against_their_band() -> None:
    tally = Tally()
    for k in range(2000):
        tally.note(float(k), 3.0, 3)
    assert tally.hours[0].inside()
    assert tally.level == 1.0
    for k in range(2000):
        tally.note(3600.0 + k, 12.0, 3)
    assert not tally.hours[1].inside()
    assert tally.level > 2.0


@pytest.mark.long
def test_an_unlogged_wrong_model_is_called_that(ship) -> None:
    """A rudder that turns the ship the other way, its order unknown: no sensor is to blame."""
    voyage = Voyage(ship, 0.35)
    settings = replace(usual(ship, list(NOISE), noise=NOISE), settle=60.0)
    live = Live(ship, settings)
    for (t, read), _ in voyage.rows():
        live.feed(t, {**read, "delta": -read["delta"]})
    assert "delta of the wrong sign" in {one.cause for one in live.alarms}
    assert live.follower is not None
    assert np.isfinite(live.follower.mean).all()
