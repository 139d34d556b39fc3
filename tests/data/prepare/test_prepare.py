from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError, Trial, prepare
from seatrial.data.prepare.smooth import _back, _forward, _model, sensor_noise, smooth


def test_resample_is_exact_on_straight_lines_and_keeps_gaps(made):
    line = made.having(x=3.0 * made.t, psi=np.mod(0.7 * made.t, 2 * np.pi))
    for dt in (0.05, 0.3):
        out = prepare.resample(line, dt)
        assert np.allclose(out["x"], 3.0 * out.t, atol=1e-9)
        assert np.allclose(out["psi"], 0.7 * out.t, atol=1e-9)
    gap = line.having(x=np.where((line.t > 5) & (line.t < 6), np.nan, line["x"]))
    out = prepare.resample(gap, 0.25)
    assert np.isnan(out["x"][(out.t > 5.05) & (out.t < 5.95)]).all()
    with pytest.raises(DataError, match="above zero"):
        prepare.resample(made, 0)


@pytest.mark.parametrize("dt", [0.1, 0.25, 1.0])
def test_rows_that_were_not_logged_are_not_made_up(made, dt):
    """Twenty seconds without rows are a gap, as twenty seconds of empty rows are."""
    line = made.having(x=3.0 * made.t)
    torn = line.rows((line.t < 50.05) | (line.t > 69.95))
    out = prepare.resample(torn, dt)
    inside = (out.t > 50.05) & (out.t < 69.95)
    assert inside.sum() > 15
    assert np.isnan(out["x"][inside]).all()
    assert np.isfinite(out["x"][~inside]).all()
    assert out["x"][~inside] == pytest.approx(3.0 * out.t[~inside])
    empty = line.having(x=np.where((line.t > 50.05) & (line.t < 69.95), np.nan, line["x"]))
    assert (np.isnan(prepare.resample(empty, dt)["x"]) == np.isnan(out["x"])).all()


def test_cut_and_segments_and_gaps(made):
    assert prepare.cut(made, 10, 20).t[[0, -1]] == pytest.approx([10, 20])
    with pytest.raises(DataError, match="covers 0 to"):
        prepare.cut(made, 1e5, 2e5)
    gap = made.having(u=np.where((made.t > 49.95) & (made.t < 50.55), np.nan, made["u"]))
    parts = prepare.segments(gap, ["u"], 10.0)
    assert [p.name for p in parts] == ["made_1", "made_2"]
    assert sum(map(len, parts)) == prepare.complete(gap, ["u"]).sum()
    assert prepare.segments(gap, ["x"]) == (gap,)
    assert np.isnan(prepare.interpolate_gaps(gap, 0.3)["u"]).any()
    filled = prepare.interpolate_gaps(gap, 1.0)
    assert np.allclose(filled["u"], made["u"], atol=1e-2)
    tail = made.having(**{n: np.where(made.t > 150, np.nan, v) for n, v in made.channels.items()})
    assert prepare.drop_trailing_gaps(tail).t[-1] == pytest.approx(150)


def test_a_gap_as_long_as_allowed_is_filled_a_longer_one_is_not():
    """From the last good sample to the next: three rows of a quarter second are missing, so one second."""
    t = 0.25 * np.arange(40)
    gap = Trial("g", t, {"u": np.where((t > 2.0) & (t < 3.0), np.nan, 1.0 + 0.1 * t)})
    assert prepare.interpolate_gaps(gap, 1.0)["u"] == pytest.approx(1.0 + 0.1 * t)
    kept = prepare.interpolate_gaps(gap, 0.999)["u"]
    assert (np.isnan(kept) == np.isnan(gap["u"])).all()


@pytest.mark.parametrize("step", [0.1, 2.0])
def test_white_jerk_over_two_steps_is_that_over_one_of_twice_the_length(step):
    """What the smoother adds to its uncertainty does not depend on how often the log was sampled."""
    move, blur = _model(step, 0.7)
    moved, blurred = _model(2 * step, 0.7)
    assert moved == pytest.approx(move @ move)
    assert blurred == pytest.approx(move @ blur @ move.T + blur)
    assert blur[2, 2] == pytest.approx(0.7 * step), "the acceleration walks with the intensity of the jerk"


def test_the_smoother_is_batch_least_squares():
    """A dozen readings at uneven times, with a gap: the normal equations of the whole track, solved at once."""
    rng, count = np.random.default_rng(4), 12
    t = np.cumsum(rng.uniform(0.3, 1.2, count))
    z = np.column_stack([np.sin(0.4 * t), 0.4 * np.cos(0.4 * t)]) + rng.normal(size=(count, 2)) * (0.05, 0.02)
    z[5], z[7, 1] = np.nan, np.nan
    r, q = (0.05**2, 0.02**2), 0.01
    reach = float(np.nanstd(z[:, 0])) + 0.05
    normal, right = np.zeros((3 * count, 3 * count)), np.zeros(3 * count)
    normal[:3, :3] = np.diag([0.1 / r[0], reach**-2.0, reach**-2.0])
    right[0] = 0.1 / r[0] * z[0, 0]
    for k in range(1, count):
        move, blur = _model(float(t[k] - t[k - 1]), q)
        step = np.hstack([-move, np.eye(3)])
        pair = slice(3 * k - 3, 3 * k + 3)
        normal[pair, pair] += step.T @ np.linalg.inv(blur) @ step
    for k, i in np.argwhere(np.isfinite(z)):
        normal[3 * k + i, 3 * k + i] += 1.0 / r[i]
        right[3 * k + i] += z[k, i] / r[i]
    found = _back(t, *_forward(t, z, r, q)[1:])
    assert found[0].ravel() == pytest.approx(np.linalg.solve(normal, right), abs=1e-9)
    assert found[1].ravel() == pytest.approx(np.diag(np.linalg.inv(normal)), rel=1e-9)


def test_split_is_by_whole_trials(made):
    from dataclasses import replace

    trials = [replace(made, name=n) for n in ("turn_1", "turn_2", "zig_1")]
    data = prepare.split(trials, ["zig_*"], ["turn_2"])
    assert [t.name for t in (*data.train, *data.validation, *data.test)] == ["turn_1", "zig_1", "turn_2"]
    with pytest.raises(DataError, match=r"pattern 'zag_1'.*near: zig_1"):
        prepare.split(trials, ["zag_1"])
    with pytest.raises(DataError, match="keep it in one"):
        prepare.split(trials, ["turn_*"], ["turn_2"])


def test_froude_scaling_there_and_back(made):
    ship = prepare.froude_scaled(made, 100.0)
    assert ship.meta["L_pp"] == pytest.approx(300)
    assert ship["u"] == pytest.approx(10 * made["u"])
    assert ship["r"] == pytest.approx(made["r"] / 10)
    assert prepare.froude_scaled(ship, 0.01).t == pytest.approx(made.t)


@pytest.mark.long
@pytest.mark.parametrize("with_gap", [False, True])
def test_smoother_beats_differences(made, with_gap):
    made = prepare.cut(made, 0, 100)
    rng = np.random.default_rng(0)
    noisy = made.having(**{
        n: made[n] + s * rng.normal(size=len(made)) for n, s in (("x", 0.02), ("y", 0.02), ("psi", 0.01))
    })  # fmt: skip
    if with_gap:
        noisy = noisy.having(x=np.where((made.t > 30) & (made.t < 31), np.nan, noisy["x"]))
    out = smooth(noisy)
    good = np.isfinite(out["u"])
    assert good.all() != with_gap
    raw = prepare.to_body(*(np.gradient(noisy[n], made.t) for n in ("x", "y")), noisy["psi"])
    raw = {"u": raw[0], "v_m": raw[1], "r": np.gradient(noisy["psi"], made.t)}
    for name, crude in raw.items():
        fine = good & np.isfinite(crude)
        error = np.sqrt(np.mean((out[name] - made[name])[fine] ** 2))
        assert error < np.sqrt(np.mean((crude - made[name])[fine] ** 2)) / 3
        # the stated uncertainty is the true one, within a factor
        assert 0.3 < error / np.sqrt(np.mean(out[f"{name}_sd"][fine] ** 2)) < 3
    assert sensor_noise(noisy["y"]) == pytest.approx(0.02, rel=0.15)
    with pytest.raises(DataError, match="above zero"):
        smooth(noisy, {"x": 0.0})


@pytest.mark.parametrize("noise", [{"psi": 6.0}, {"r": 2.0}])
def test_noise_that_was_meant_in_degrees_is_refused(made, noise):
    with pytest.raises(DataError, match=r"no instrument is so poor, 0\.5 is the most: is it in degrees"):
        smooth(made, noise)
