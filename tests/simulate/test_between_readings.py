"""How a control moves between its readings: along a line, held, or round the circle, in replay, fit and twin."""

from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.data import Trial
from seatrial.data.prepare import between_readings, interpolate_gaps, resample
from seatrial.environment import CHANNELS
from seatrial.identify.noise import between_rows, input_noise
from seatrial.identify.record import Record, even
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.twin.faults.acting import Acting
from seatrial.ships.files import load
from seatrial.simulate.replay import inputs, prepared, replay, unread
from seatrial.simulate.run import simulate
from seatrial.simulate.steering import steered

SHIP = load("kvlcc2_l7")
N_P = 9.0
STATES = ("x", "y", "psi", "u", "v_m", "r")


def zigzag(duration: float = 40.0) -> Trial:
    return simulate(SHIP, Zigzag(N_P, 0.35, 0.35), speed=1.1, duration=duration, dt=0.1, name="zigzag")


def thinned(trial: Trial, every: int, *names: str) -> Trial:
    on = np.arange(len(trial)) % every == 0
    return trial.having(**{name: np.where(on, trial[name], np.nan) for name in names})


def area(trial: Trial, name: str, a: float, b: float) -> float:
    """Integral of the piecewise line through the readings of a channel, by brute force on a fine grid."""
    good = np.isfinite(trial[name])
    t = np.linspace(a, b, 20_001)
    return float(np.trapezoid(np.interp(t, trial.t[good], trial[name][good]), t))


def test_a_slow_rudder_acts_as_the_line_between_its_readings() -> None:
    log = zigzag()
    slow = thinned(log, 10, "delta")
    line = np.interp(log.t, log.t[::10], log["delta"][::10])
    np.testing.assert_array_equal(inputs(slow, SHIP.model), inputs(log.having(delta=line), SHIP.model))
    np.testing.assert_array_equal(inputs(log, SHIP.model)[:-1, 1], 0.5 * (log["delta"][1:] + log["delta"][:-1]))


def test_a_slow_rudder_delays_no_prediction() -> None:
    """Readings that hold for half a second come .2 s late, and the rate of turn with them; on lines they do not."""
    log = zigzag(60.0)

    def late(told: Trial) -> float:
        rate = np.gradient(log["r"], log.t)
        return -float(rate @ (told["r"] - log["r"]) / (rate @ rate))

    held = log.having(delta=log["delta"][5 * (np.arange(len(log)) // 5)])
    assert late(replay(SHIP, held)) == pytest.approx(0.2, abs=0.05)
    assert abs(late(replay(SHIP, thinned(log, 5, "delta")))) < 0.03


def test_lost_rows_leave_the_rudder_on_its_line() -> None:
    """A ramp over a lost row acts with a quarter and three quarters of its rise in the two steps of the prediction."""
    log = zigzag()
    kept = np.delete(np.arange(len(log)), [*range(7, len(log) - 2, 11)])
    told = replay(SHIP, log.rows(kept))
    np.testing.assert_allclose(told["psi"], log["psi"][kept], atol=2e-4)
    part = even(log.rows(kept), 0.1, SHIP.model)
    np.testing.assert_allclose(inputs(part, SHIP.model)[:, 1], inputs(log, SHIP.model)[:, 1], atol=0.025 * 15.8 / 57.3)
    assert np.isnan(part["psi"]).sum() == len(log) - len(kept)


def test_a_prediction_on_uneven_rows_takes_the_mean_of_the_line_over_each_of_its_steps() -> None:
    log = zigzag()
    rng = np.random.default_rng(3)
    rows = np.sort(rng.choice(len(log), 150, replace=False))
    rows[0] = 0
    some = log.rows(rows)
    ready = prepared(SHIP, some, restart=None)
    ramping = np.flatnonzero(np.diff(ready.lanes[0, :-1, 1]))
    assert ramping.size > 20
    for k in ramping[:30]:
        a = float(ready.t[0] + k * ready.dt)
        assert ready.lanes[0, k, 1] * ready.dt == pytest.approx(area(some, "delta", a, a + ready.dt), abs=1e-7)


def test_an_order_is_held() -> None:
    log = zigzag()
    slow = thinned(log, 10, "delta")
    slow = replace(slow, meta={**slow.meta, "held": ["delta"]})
    held = log["delta"][10 * (np.arange(len(log)) // 10)]
    np.testing.assert_array_equal(inputs(slow, SHIP.model)[:, 1], held)
    uneven = slow.rows(np.delete(np.arange(len(log)), [13, 14, 30, 77]))
    np.testing.assert_allclose(inputs(even(uneven, 0.1, SHIP.model), SHIP.model)[:-1, 1], held[:-1], atol=1e-9)


def test_a_held_order_on_other_steps_acts_with_its_mean() -> None:
    t = np.arange(0.0, 20.05, 0.1)
    delta = np.where(t < 5.25, 0.0, 0.3)
    part = even(Trial("log", t, {**dict.fromkeys(STATES, t * 0.0), "n_P": t * 0.0 + 9, "delta": delta},
                      meta={"held": ["delta"]}), 1.0, SHIP.model)  # fmt: skip
    expected = np.where(part.t < 5, 0.0, 0.3)
    expected[5] = 0.3 * 0.7
    np.testing.assert_allclose(part["delta"], expected, atol=1e-9)


def test_an_azimuth_turns_the_shorter_way() -> None:
    t = np.arange(5.0)
    alpha = np.array([3.0, np.nan, np.nan, np.nan, -3.0])
    step = (2.0 * np.pi - 6.0) / 4.0
    wanted = 3.0 + step * t
    np.testing.assert_allclose(between_readings("alpha_1", t, alpha, t, held=False), wanted)
    assert between_readings("delta", t, alpha, t, held=False)[2] == 0.0
    log = Trial("log", t, {"alpha_1": alpha}, units={"alpha_1": "rad"})
    np.testing.assert_allclose(interpolate_gaps(log, 10.0)["alpha_1"][1:4], wanted[1:4])
    two = Trial("log", t, {"alpha_1": np.array([3.0, -3.0, 3.0, -3.0, 3.0])}, units={"alpha_1": "rad"})
    np.testing.assert_allclose(np.cos(resample(two, 0.5)["alpha_1"]) < -0.98, True)


def test_a_tug_whose_azimuths_pass_astern_acts_as_one_whose_angles_are_continuous() -> None:
    ship = load("milliampere")
    names = [name for name in ship.model.controls if name.startswith("alpha")]
    t = np.arange(0.0, 10.0, 0.5)
    smooth = {name: np.pi + 0.3 * np.sin(t + k) for k, name in enumerate(names)}
    others = {name: np.ones(t.size) for name in ship.model.controls if name not in names}
    wrapped = {name: np.angle(np.exp(1j * values)) for name, values in smooth.items()}
    units = dict.fromkeys(names, "rad")
    one, two = (inputs(Trial("tug", t, {**others, **some}, units=units | dict.fromkeys(others, "1/s")), ship.model)
                for some in (smooth, wrapped))  # fmt: skip
    for k, name in enumerate(ship.model.controls):
        if name in names:
            np.testing.assert_allclose(np.cos(one[:, k] - two[:, k]), 1.0, atol=1e-12)


def test_the_twin_takes_the_same_means() -> None:
    log = zigzag()
    slow = steered(thinned(log, 10, "delta"), SHIP.model)
    acting, means = Acting(SHIP.model, ()), inputs(thinned(log, 10, "delta"), SHIP.model)
    acting.heed({"n_P": slow["n_P"][0], "delta": slow["delta"][0]}, None)
    for k in range(1, len(log)):
        before = acting.now.copy()
        acting.heed({"n_P": slow["n_P"][k], "delta": slow["delta"][k]}, None)
        np.testing.assert_allclose(acting.between(before), means[k - 1], atol=1e-12)


def test_the_twin_means_an_azimuth_round_the_circle() -> None:
    ship = load("milliampere")
    k = next(k for k, name in enumerate(ship.model.controls) if name.startswith("alpha"))
    acting = Acting(ship.model, ())
    acting.now = np.zeros(len(ship.model.controls) + len(CHANNELS))
    before = acting.now.copy()
    before[k], acting.now[k] = 3.1, -3.1
    assert np.cos(acting.between(before)[k]) == pytest.approx(-1.0, abs=1e-6)


def test_a_network_learns_from_the_rows_between_regular_readings_and_not_from_a_gap() -> None:
    log = thinned(zigzag(), 5, "delta")
    read = log["delta"].copy()
    read[100:120] = np.nan
    gap = log.having(delta=read)
    rows = unread(gap, SHIP.model)["delta"]
    assert np.flatnonzero(rows).tolist() == list(range(96, 120))  # from the last reading to the next, and no others


def test_the_noise_of_a_slow_rudder_is_read_at_its_own_rate() -> None:
    log = zigzag(60.0)
    noisy = log.having(delta=log["delta"] + np.random.default_rng(1).normal(0.0, 0.01, len(log)))
    every = float(input_noise([noisy], SHIP.model)[1])
    assert float(input_noise([thinned(noisy, 5, "delta")], SHIP.model)[1]) == pytest.approx(every, rel=0.35)


def test_what_slow_readings_leave_open_is_that_of_the_ramp_between_them() -> None:
    """A ramp of 5 per row begins at row 23 of readings at 20, 25, ...: brute force gives what the line misses."""
    t = np.arange(60.0)
    ramp = 5.0 * np.clip(t - 23.0, 0.0, 17.0)
    read = t % 5 == 0
    line = np.interp(t, t[read], ramp[read])
    means = np.append(0.5 * (line[1:] + line[:-1]), line[-1])
    left = between_rows(means[None, :, None], np.array([0.01]), read[None, :, None])[0, :, 0]
    fine = np.linspace(20.0, 25.0, 50_001)
    missed = np.trapezoid(np.interp(fine, t[read], ramp[read]) - 5.0 * np.clip(fine - 23.0, 0.0, 17.0), fine) / 5.0
    np.testing.assert_allclose(left[20:25], missed, rtol=1e-3)
    assert set(np.flatnonzero(left)) <= {*range(20, 25), *range(35, 40), *range(40, 45)}


def test_a_record_knows_which_rows_were_read() -> None:
    slow = thinned(zigzag(), 5, "delta")
    record = Record.of(slow, SHIP.model)
    assert record.read[:, 0].all()
    np.testing.assert_array_equal(np.flatnonzero(record.read[:, 1]), np.arange(0, len(slow), 5))
    rng = np.random.default_rng(0)
    late = replace(slow, t=slow.t + np.append(0.0, rng.uniform(-0.03, 0.03, len(slow) - 1)))
    on = even(late, 0.1, SHIP.model)
    assert np.isfinite(on["delta"]).sum() >= len(slow) // 5
    good = np.isfinite(late["delta"])
    seen = np.isfinite(on["delta"])
    np.testing.assert_allclose(on["delta"][seen], np.interp(on.t, late.t[good], late["delta"][good])[seen], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_a_fit_of_a_slow_rudder_finds_the_truth_and_no_delay(lost: float) -> None:
    """One reading a second, or a tenth of the rows lost: within two deviations, and nothing is suspected."""
    import seatrial as st

    paths = ("hull.N_r", "hull.Y_v")
    truth = SHIP.having({p: f * values(SHIP.model)[p] for p, f in zip(paths, (1.1, 0.9), strict=True)})
    noise = {"psi": 0.003, "x": 0.02, "y": 0.02, "u": 0.01, "v_m": 0.01, "r": 0.002}
    rng = np.random.default_rng(5)
    logs: list[Trial] = []
    for k, policy in enumerate((Zigzag(N_P, 0.35, 0.35), Turning(delta=0.61, n_P=N_P))):
        log = simulate(truth, policy, speed=1.1, duration=60.0, dt=0.1, name=f"log_{k}")
        read = np.random.default_rng(k)
        log = log.having(**{name: log[name] + read.normal(0.0, sd, len(log)) for name, sd in noise.items()})
        some = np.sort(rng.choice(len(log), round(0.9 * len(log)), replace=False)) if lost else slice(None)
        logs.append(log.rows(some) if lost else thinned(log, 5, "delta"))
    fit = st.fit(st.Problem(SHIP, logs, st.near(SHIP, *paths, ratio=0.5)))
    for row in fit.summary().to_frame().to_dicts():
        true = values(truth.model)[row["parameter"]]
        assert abs(row["estimate"] / true - 1.0) < 0.003 or abs(row["estimate"] - true) < 2.0 * row["sigma"]
        assert abs(row["estimate"] - true) < 3.0 * row["sigma"]
    assert "delay of delta" not in str(fit.summary())
