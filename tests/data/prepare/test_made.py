"""Channels that are made from others: told apart from measurements by whose noise they hold, and counted once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import Array, DataError, Trial
from seatrial.data.check import check
from seatrial.data.importing import import_log
from seatrial.data.prepare import Step, derived, marked, measured, mended, read_steps, steps_text, unsaid
from seatrial.data.prepare.made import _Around
from seatrial.data.prepare.smooth import smooth
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.identify.noise import noise
from seatrial.simulate.begun import begun, untold

NOISE = {"x": 0.5, "y": 0.5, "psi": 1.7e-3, "u": 0.02, "v_m": 0.02, "r": 1e-4}


def sailed(dt: float = 1.0, rows: int = 500, seed: int = 0, noisy: float = 1.0) -> Trial:
    """A ship that weaves with a period of 80 rows; each channel with the noise of an instrument of its own."""
    fine, random = np.arange(0.0, rows * dt, dt / 20.0), np.random.default_rng(seed)
    w = 2.0 * np.pi / (80.0 * dt)
    r = 0.4 * w * np.sin(w * fine) + 0.15 * w * np.sin(2.7 * w * fine + 1.0)
    psi = np.cumsum(r) * dt / 20.0
    u, v = 5.0 + 0.2 * np.sin(0.5 * w * fine), -30.0 * r
    x = np.cumsum(u * np.cos(psi) - v * np.sin(psi)) * dt / 20.0
    y = np.cumsum(u * np.sin(psi) + v * np.cos(psi)) * dt / 20.0
    true = {"x": x, "y": y, "psi": psi, "u": u, "v_m": v, "r": r}
    read = {name: values[::20] + noisy * NOISE[name] * random.standard_normal(rows) for name, values in true.items()}
    return Trial("sailed", np.arange(rows) * dt, {**read, "delta": -10.0 * r[::20], "n_P": np.full(rows, 2.0)})


def velocities(trial: Trial, of: str = "gradient", rows: int = 9) -> tuple[Array, Array, Array]:
    """u, v_m and r from the track and the heading, by central differences, those to the next row, or with a mean."""

    def rate(values: Array) -> Array:
        if of == "forward":
            return np.append(np.diff(values), np.nan) / trial.dt
        plain = np.gradient(values, trial.t)
        return plain if of == "gradient" else np.convolve(plain, np.full(rows, 1.0 / rows), "same")

    north, east, psi = rate(trial["x"]), rate(trial["y"]), trial["psi"]
    return (north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi), rate(psi))


@pytest.mark.parametrize("dt", [0.1, 1.0])
@pytest.mark.parametrize("of", ["gradient", "forward", "mean"])
def test_rates_of_a_logger_hold_the_noise_of_their_sources(dt: float, of: str) -> None:
    log = sailed(dt)
    u, v, r = velocities(log, of)
    found = {one.name: one for one in unsaid(log.having(u=u, v_m=v, r=r))}
    assert {name: one.of for name, one in found.items()} == {
        "u": ("x", "y", "psi"), "v_m": ("x", "y", "psi"), "r": ("psi",),
    }  # fmt: skip
    assert all(one.left < 1e-6 * one.least for one in found.values())
    assert all(("filter" in one.words) == (of == "mean") for one in found.values())
    # one channel made, another measured: only the former
    assert [one.name for one in unsaid(log.having(v_m=v))] == ["v_m"]
    assert [one.name for one in unsaid(log.having(r=r))] == ["r"]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_instruments_are_no_derivation_however_good(dt: float, seed: int) -> None:
    log = sailed(dt, seed=seed)
    assert not [*unsaid(log)]
    clean = sailed(dt, seed=seed + 100)
    perfect = {name: clean[name] - NOISE[name] * np.random.default_rng(seed + 100).standard_normal(500)
               for name in ("x",)}  # fmt: skip
    assert not [*unsaid(log.having(**perfect))]
    rounded = {name: np.round(log[name], 4) for name in ("psi", "r", "x", "y", "u", "v_m")}
    assert not [*unsaid(log.having(**rounded))]


def test_the_noise_of_the_source_through_a_difference_is_what_it_leaves_of_a_measurement() -> None:
    """Central differences leave sigma / (sqrt(2) dt) of a rate that an own gyro read."""
    log = sailed(rows=2000)
    _, _, r = velocities(log)
    [one] = unsaid(log.having(r=r))
    assert one.least == pytest.approx(NOISE["psi"] / np.sqrt(2.0), rel=0.1)


def test_rows_at_odd_times_and_with_gaps_tell_it_too() -> None:
    log = sailed()
    kept = np.random.default_rng(2).uniform(size=len(log)) > 0.1
    some = log.rows(kept)
    made = np.append(np.diff(some["psi"]) / np.diff(some.t), np.nan)
    made[50:60] = np.nan
    assert [one.name for one in unsaid(some.having(r=made))] == ["r"]
    assert not [*unsaid(some)]
    assert not [*unsaid(some.rows(slice(0, 20)).having(r=made[:20]))]  # too few to judge


def test_rounding_hides_no_difference_of_a_fine_heading() -> None:
    """A heading to 0.001 deg, whose noise is below a share of its spread: what is left is the rounding of the rate."""
    log = sailed(rows=1000, noisy=0.0)
    fine = np.round(np.degrees(log["psi"]), 3)
    assert 1e-3 / np.sqrt(12.0) < 2e-4 * np.std(fine)
    made = np.round(np.append(np.diff(fine), np.nan), 3)
    assert [one.name for one in unsaid(log.having(psi=np.radians(fine), r=np.radians(made)))] == ["r"]
    own = np.round(np.degrees(log["r"]), 3)  # what a gyro would have printed of the same
    assert not [*unsaid(log.having(psi=np.radians(fine), r=np.radians(own)))]


@pytest.mark.slow
@pytest.mark.parametrize("share", [1e-6, 3e-4])
def test_a_few_slips_however_small_hide_no_difference_of_a_fine_heading(share: float) -> None:
    log = sailed(noisy=1e-3)
    r = velocities(log)[2]
    r[np.random.default_rng(1).choice(r.size, 12, replace=False)] += share * float(np.sqrt(np.mean(r**2)))
    assert [one.name for one in unsaid(log.having(r=r))] == ["r"]


def test_check_tells_it_and_its_remedy_marks_it(tmp_path: Path) -> None:
    log = sailed()
    log = log.having(r=velocities(log)[2])
    [one] = [one for one in check(log) if one.key == "derived"]
    assert one.channels == ("r",)
    assert "made from psi" in one.what
    file = tmp_path / "steps.toml"
    file.write_text(steps_text([("it", one.steps)]), encoding="utf-8")
    [mended_log] = mended(log, read_steps(file))
    assert derived(mended_log) == {"r": "psi"}
    assert not [one for one in check(mended_log) if one.key == "derived"]
    file.write_text('schema = "seatrial-steps/1"\n[[steps]]\ndo = "mark"\nchannels = ["r"]\n', encoding="utf-8")
    with pytest.raises(DataError, match=r"steps\[0\].names: give one for each channel \(1\), not 0"):
        read_steps(file)


@pytest.mark.slow
def test_steps_that_make_channels_mark_them() -> None:
    log = sailed()
    [whole] = mended(log, [Step(do="derive", channels=("v_m", "r"))])
    assert derived(whole) == {"v_m": "x, y, psi", "r": "psi"}
    [track] = mended(log, [Step(do="from_track", channels=("u",))])
    assert derived(track) == {"v_m": "x, y, psi"}
    [turned] = mended(log, [Step(do="rebuild", channels=("psi",))])
    assert derived(turned) == {"psi": "r"}
    [renamed] = mended(whole, [Step(do="rename", channels=("r",), names=("r_gyro",))])
    assert derived(renamed) == {"v_m": "x, y, psi", "r_gyro": "psi"}


@pytest.mark.slow
def test_a_smoothed_heading_weighs_as_its_sensor_does() -> None:
    log = sailed(rows=300)
    made = smooth(log)
    assert derived(made) == {"u": "x, y, psi", "v_m": "x, y, psi", "r": "psi"}
    assert noise([made]) == pytest.approx({name: NOISE[name] for name in ("x", "y", "psi")}, rel=0.2)
    both = smooth(log, velocities=True)
    assert derived(both) == {}
    assert noise([both])["r"] == pytest.approx(NOISE["r"], rel=0.5)


def test_marks_are_kept_by_files_and_refused_if_they_say_nothing(tmp_path: Path) -> None:
    log = marked(sailed(), {"r": "psi"})
    log = replace(log, meta={**log.meta, "noise": {"x": 0.5}})
    write_trial(log, tmp_path / "a.csv")
    back = read_trial(tmp_path / "a.csv")
    assert derived(back) == {"r": "psi"}
    assert back.meta["noise"] == {"x": 0.5}
    for wrong in ({"derived": ["r"]}, {"derived": {"r": 1}}, {"noise": {"x": 0.0}}, {"noise": {"x": "0.5 m"}}):
        with pytest.raises(DataError, match=f"{next(iter(wrong))} must be channels with"):
            write_trial(replace(log, meta=wrong), tmp_path / "b.csv")
    assert not (tmp_path / "b.csv").exists()


def test_an_import_marks_what_the_logger_made_and_says_so(tmp_path: Path) -> None:
    log = sailed()
    psi = np.degrees(log["psi"]) % 360.0
    rate = np.gradient(np.degrees(log["psi"]), log.t) * 60.0
    rows = "\n".join(f"{t:g},{a:.3f},{b:.2f},{c:.2f},{d:.2f}" for t, a, b, c, d in
                     zip(log.t, psi, rate, log["u"], np.degrees(log["delta"]), strict=True))  # fmt: skip
    (tmp_path / "day.csv").write_text(f"t,HDG,ROT,SPD,RUD\n{rows}\n", encoding="utf-8")
    units = {"psi": ("HDG", "deg"), "r": ("ROT", "deg/min"), "u": ("SPD", "m/s"), "delta": ("RUD", "deg")}
    channels = "\n".join(f'{name} = {{ column = "{a}", unit = "{b}" }}' for name, (a, b) in units.items())
    text = f'schema = "seatrial-mapping/1"\ntime = {{ column = "t", unit = "s" }}\n[channels]\n{channels}\n'
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    [written] = import_log("csv", tmp_path / "day.csv", tmp_path / "out", tmp_path / "m.toml")
    trial = read_trial(written)
    assert derived(trial) == {"r": "psi"}
    assert "made from psi" in trial.meta["sources"]["rate of turn"]
    assert any("r is differences of psi: marked as derived" in step for step in trial.meta["processing"])


def test_what_is_made_from_others_is_no_reading_but_where_a_prediction_begins() -> None:
    log = marked(sailed(), {"r": "psi"})
    assert measured(log, "psi")
    assert not measured(log, "r")
    assert not measured(log, "phi")
    assert untold(log) == ("r",)
    states, good = begun(log)
    np.testing.assert_array_equal(states[:, 5], log["r"])
    assert good.all()
    assert set(noise([log])) == {"x", "y", "psi", "u", "v_m"}
    assert set(noise([log, sailed(seed=3)])) == {"x", "y", "psi", "u", "v_m", "r"}


@pytest.mark.parametrize("reach", [2, 3])
def test_rows_around_are_those_of_a_loop(reach: int) -> None:
    log = sailed(rows=12)
    log = replace(log, t=log.t + 0.1 * np.sin(log.t))
    around, away = _Around(log, reach), [k for k in range(-reach, reach + 1) if k]
    rows = range(reach, len(log) - reach)
    psi, x, y = log["psi"], log["x"], log["y"]

    def along(name: str, a: int, b: int, at: int) -> float:
        north, east, c, s = x[b] - x[a], y[b] - y[a], np.cos(psi[at]), np.sin(psi[at])
        return {"r": psi[b] - psi[a], "u": c * north + s * east, "v_m": c * east - s * north}[name]

    for name in ("r", "u", "v_m"):
        rates = [[along(name, k, k + j, k) / (log.t[k + j] - log.t[k]) for j in away] for k in rows]
        np.testing.assert_allclose(around.rates(name), rates, rtol=1e-12)
        moved = [[along(name, k - 1, k + j, k) for j in away] for k in rows]
        np.testing.assert_allclose(around.moved(name, around.around(name), 1), moved, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(around.inner("u")[:, 0], log["u"][reach:-reach])
    assert not [*unsaid(log.rows(slice(0, 2 * reach)))]


def test_the_heading_of_a_trial_is_continuous_shared_and_read_only() -> None:
    log = Trial("a", np.arange(3.0), {"psi": np.array([3.1, -3.1, -3.0])})
    np.testing.assert_allclose(log.heading, [3.1, 2.0 * np.pi - 3.1, 2.0 * np.pi - 3.0])
    assert log.having(u=np.ones(3)).heading is log.heading
    assert log.having(psi=log["psi"] + 1.0).heading is not log.heading
    with pytest.raises(ValueError, match="read-only"):
        log.heading[0] = 0.0
    assert log["psi"][1] == -3.1
