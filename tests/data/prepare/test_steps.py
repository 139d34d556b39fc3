"""Steps: corrections of logs as values, in a file and applied."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.data.prepare import Step, derivable, mended, read_steps, steps_text
from seatrial.data.prepare.steps import OPERATIONS
from seatrial.data.trialfile import write_trial
from seatrial.workflow.data import mend
from tiers import slow_but

HEAD = 'schema = "seatrial-steps/1"\n[[steps]]\n'
AMOUNTS = {"move": (100.0, -15.0), "to_ground": (0.5, 70.0), "current": (0.5, 70.0), "fill": (3.0,)}
CHANNELS = {"exchange": ("x", "y"), "to_body": ("u", "v_m"), "move": ("x", "y"), "rotate": ("u", "v_m"),
            "from_bow": ("gamma_T",), "unwrap": ("psi",), "rebuild": ("psi",), "from_course": ("psi",)}  # fmt: skip


def circle() -> Trial:
    """A steady turn of 100 s with a wind."""
    t = np.arange(0.0, 100.0)
    r, u = 0.01 * np.ones_like(t), 5.0 * np.ones_like(t)
    psi = 0.01 * t
    return Trial("circle", t, {
        "x": 500.0 * np.sin(psi), "y": 500.0 * (1.0 - np.cos(psi)), "psi": psi, "u": u, "v_m": 0.0 * t, "r": r,
        "delta": 0.2 * np.sin(t), "U_T": 10.0 + 0.0 * t, "gamma_T": 1.0 + 0.0 * t,
    })  # fmt: skip


def example(do: str) -> Step:
    amount = AMOUNTS.get(do, (2.0,) if OPERATIONS[do].amounts else ())
    return Step(
        do=do, channels=CHANNELS.get(do, ("delta",)), amount=amount, unit="deg" if do in ("add", "constant") else "",
        names=("delta_cmd",) if do in ("rename", "mark") else (), trials=("circle",),
        where=((10.0, 20.5),) if do in ("gaps", "cut") else (),
    )  # fmt: skip


@pytest.mark.parametrize("do", slow_but(sorted(OPERATIONS), *(set(OPERATIONS) - {"derive", "from_track"})))
def test_each_step_is_read_as_it_was_written_and_changes_the_trial(do: str, tmp_path: Path) -> None:
    file, step = tmp_path / "steps.toml", example(do)
    file.write_text(steps_text([("a fault", [step])]), encoding="utf-8")
    assert read_steps(file) == (step,)
    assert f"# {step.words}\n" in file.read_text(encoding="utf-8")
    made = mended(circle(), [step])
    assert any(step.words in one for part in made for one in part.meta.get("processing", [])) or do == "split"
    other = replace(step, trials=("another",))
    assert mended(circle(), [other])[0].meta == circle().meta


def test_steps_do_what_they_say() -> None:
    trial = circle()
    [added] = mended(trial, [Step(do="add", channels=("r",), amount=(6.0,), unit="deg/min")])
    np.testing.assert_allclose(added["r"] - trial["r"], np.radians(0.1))
    [port] = mended(trial, [Step(do="multiply_port", channels=("delta",), amount=(2.0,))])
    np.testing.assert_allclose(port["delta"], np.where(trial["delta"] < 0, 2.0, 1.0) * trial["delta"])
    [water] = mended(trial, [Step(do="to_ground", channels=("u", "v_m"), amount=(0.5, 0.0))])
    np.testing.assert_allclose(water["u"] * np.cos(trial["psi"]) - water["v_m"] * np.sin(trial["psi"]),
                               5.0 * np.cos(trial["psi"]) + 0.5)  # fmt: skip
    [antenna] = mended(trial, [Step(do="move", channels=("x", "y"), amount=(0.0, 20.0))])
    np.testing.assert_allclose(np.hypot(antenna["x"], antenna["y"] - 500.0), 520.0)  # 20 m to port of the ship's track
    [rebuilt] = mended(trial.having(psi=np.round(trial["psi"], 1)), [Step(do="rebuild", channels=("psi",))])
    assert np.abs(rebuilt["psi"] - trial["psi"]).max() < 0.02


def test_a_stretch_that_is_cut_leaves_two_trials() -> None:
    first, second = mended(circle(), [Step(do="cut", where=((40.0, 49.0),))])
    assert (first.name, second.name) == ("circle_1", "circle_2")
    assert (first.t[-1], second.t[0]) == (39.0, 50.0)
    [tail] = mended(circle(), [Step(do="cut", where=((40.0, 99.0),))])
    assert (tail.name, tail.t[-1]) == ("circle", 39.0)
    with pytest.raises(DataError, match="circle: nothing is left after cut out t = 0 to 99 s"):
        mended(circle(), [Step(do="cut", where=((0.0, 99.0),))])


BAD = {
    "an unknown operation": ('do = "ad"', r"steps\[0\].do: .*'ad'.*add"),
    "too few numbers": ('do = "move"\nchannels = ["x", "y"]\namount = [1]', "takes 2"),
    "a unit of something else": ('do = "add"\nchannels = ["psi"]\namount = [1]\nunit = "kn"', "cannot measure it"),
    "one channel to exchange": ('do = "exchange"\nchannels = ["x"]', "takes two"),
    "zero": ('do = "multiply"\nchannels = ["x"]\namount = [0]', "not zero"),
    "a stretch that ends before it begins": ('do = "gaps"\nchannels = ["x"]\nwhere = [[5, 1]]', r"\[from, to\]"),
    "a number for a list": ('do = "multiply"\nchannels = ["x"]\namount = 2', "must be a list"),
    "an unknown key": ('do = "trim"\nchannel = ["x"]', "channel"),
    "names that lack": ('do = "rename"\nchannels = ["x"]', "one for each channel"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_steps_are_refused_in_one_line(case: str, tmp_path: Path) -> None:
    text, words = BAD[case]
    file = tmp_path / "steps.toml"
    file.write_text(HEAD + text, encoding="utf-8")
    with pytest.raises(DataError, match=words) as caught:
        read_steps(file)
    assert str(file) in str(caught.value)


def test_steps_for_what_is_not_there_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    write_trial(circle(), tmp_path / "in" / "circle.csv")
    file, out = tmp_path / "steps.toml", tmp_path / "out"
    for text, words in (('do = "trim"\ntrials = ["circel"]', "circel.*circle"),
                        ('do = "drop"\nchannels = ["n_P"]', "leave out n_P: .*'n_P'")):  # fmt: skip
        file.write_text(HEAD + text, encoding="utf-8")
        with pytest.raises(DataError, match=words):
            mend([tmp_path / "in"], file, out)
        assert not out.exists()


@pytest.mark.slow
def test_a_track_without_velocities_says_how_they_are_come_by() -> None:
    bare = circle()
    bare = replace(bare, channels={name: bare[name] for name in ("x", "y", "psi")})
    told = derivable(bare, ("u", "v_m", "r", "n_P"))
    assert 'do = "derive", channels = ["u", "v_m", "r"]' in told
    assert derivable(replace(bare, channels={"psi": bare["psi"]}), ("u",)) == ""
    with pytest.raises(DataError, match=r'no channel .u.; .* do = "derive"'):
        mended(bare, (Step(do="from_track", channels=("u", "v_m")),))
    (whole,) = mended(bare, (Step(do="derive", channels=("u", "v_m", "r")),))
    assert {"u", "v_m", "r"} <= set(whole.channels)
