"""Coverage: what is within the training data, what leaves it, and in which channels; the page and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from seatrial.belief.coverage import WIND, Coverage, Reference, apart, columns, coverage, remembered, told, usual
from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.trialfile import write_trial
from seatrial.report.judging.coverage import histogram
from seatrial.report.judging.coverage import page as page_of


def wandering(seed: int, seconds: float = 300.0, **offset: float) -> Trial:
    """A ship whose every channel wanders about, with offsets on some."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 0.5)
    scale = {"u": 0.1, "v_m": 0.03, "r": 0.02, "n_P": 5.0, "delta": 0.3, "U_T": 0.3}
    channels = {"psi": 0.02 * t, "gamma_T": np.full_like(t, 1.0)}
    for name, size in scale.items():
        walk = np.zeros(t.size)
        for k in range(1, t.size):
            walk[k] = 0.95 * walk[k - 1] + np.sqrt(1 - 0.95**2) * rng.normal()
        channels[name] = size * walk + offset.get(name, 0.0)
    x, y = np.cumsum(channels["u"]), np.cumsum(channels["v_m"])
    return Trial(f"w{seed}", t, {**channels, "x": x, "y": y, "U_T": np.abs(channels["U_T"]) + 1.0}, {}, {"L_pp": 3.0})


@pytest.fixture(scope="module")
def train() -> list[Trial]:
    return [wandering(seed) for seed in range(8)]


@pytest.mark.slow
def test_a_slow_receiver_that_never_speaks_on_an_even_row_is_judged_by_the_rows_that_it_has():
    """Speeds on the second of every two rows only, five rows a step of thinning apart: no strided row is complete."""
    def slow(seed: int) -> Trial:
        whole = wandering(seed)
        silent = np.arange(len(whole)) % 2 == 0
        return whole.having(u=np.where(silent, np.nan, whole["u"]))

    own = Reference.of([slow(seed) for seed in range(4)]).own
    assert len(own) == 4
    assert max(own.values()) < 0.1  # one in a hundred is usual


@pytest.mark.slow
def test_more_of_the_same_is_inside(train):
    reference = Reference.of(train)
    shares = [coverage(reference, wandering(seed)).share for seed in range(20, 25)]
    assert 0.0 < np.mean(shares) < 0.03  # one in a hundred is usual, and they come in runs
    assert coverage(reference, wandering(20)).verdict == "inside"
    assert coverage(reference, wandering(20)).channels == ()


@pytest.mark.slow
def test_the_training_files_have_one_novel_sample_in_a_hundred(train):
    reference = Reference.of(train)
    assert np.mean(list(reference.own.values())) == pytest.approx(0.01, abs=0.005)


@pytest.mark.parametrize(("channel", "by"), [("n_P", 40.0), ("delta", -2.5), ("u", 0.8), ("r", 0.2)])
def test_what_leaves_the_data_is_named(train, channel, by):
    found = coverage(Reference.of(train), wandering(50, **{channel: by}))
    assert found.verdict == "leaves"
    assert found.channels[0] == channel
    assert found.outside[channel] > 0.9
    assert "this manoeuvre leaves the training data" in str(found)
    assert sum(found.telling.values()) == pytest.approx(1.0)


def test_a_corner_that_no_range_shows_is_novel():
    """Ahead and astern were both tried, the rudder hard over only ahead: range says nothing, distance does."""
    t = np.arange(0.0, 200.0, 1.0)
    rng = np.random.default_rng(0)

    def run(name: str, u: float, delta: float) -> Trial:
        noise = 0.01 * rng.normal(size=(2, t.size))
        return Trial(name, t, {"u": u + noise[0], "delta": delta + noise[1]})

    train = [run(f"{k}{i}", u, d) for i in range(3) for k, (u, d) in enumerate(((1, 0.6), (1, 0.0), (-1, 0.0)))]
    reference = Reference.of(train, ("u", "delta"))
    hard_astern = coverage(reference, run("x", -0.98, 0.58))
    assert max(hard_astern.outside.values()) < 0.1
    assert hard_astern.share == 1.0
    assert coverage(reference, run("y", 1.0, 0.6)).share < 0.1


def test_a_trial_does_not_cover_itself_when_it_is_alone():
    reference = Reference.of([wandering(1)])
    assert set(reference.own) == {"w1"}
    assert 0.1 < reference.limit < 10.0


def test_a_control_that_never_moved_is_novel_when_it_does(train):
    still = [trial.having(n_P=np.full(len(trial), 10.0)) for trial in train]
    found = coverage(Reference.of(still), wandering(60, n_P=30.0))
    assert found.verdict == "leaves"
    assert found.channels[0] == "n_P"


def test_wind_is_what_the_ship_meets(train):
    trial = train[0]
    ahead, aside = columns(trial, WIND).T
    bearing = trial["gamma_T"] - trial["psi"]
    assert ahead == pytest.approx(trial["U_T"] * np.cos(bearing) + trial["u"])
    assert aside == pytest.approx(trial["U_T"] * np.sin(bearing) + trial["v_m"])
    assert usual(train) == ("u", "v_m", "r", "n_P", "delta", *WIND)
    bare = Trial("b", trial.t, {n: trial[n] for n in ("u", "v_m", "r")})
    assert usual([*train, bare]) == ("u", "v_m", "r")


def turning(name: str, seed: int, sign: np.ndarray) -> Trial:
    """600 s at .04 rad/s to the side that `sign` has at each second, with the rudder that goes with it."""
    rng, t = np.random.default_rng(seed), np.arange(600.0)
    u, r, delta = 0.3 + 0.01 * rng.normal(size=600), 0.04 * sign + 0.002 * rng.normal(size=600), 0.3 * sign
    return Trial(name, t, {"u": u, "r": r, "delta": delta, "n_P": np.full(600, 10.0) + rng.normal(size=600)})


@pytest.mark.slow
def test_a_steady_turn_is_new_to_zigzags_that_have_each_of_its_states():
    """The past is the time in which .04 rad/s turn by 4 rad, some 90 s; zigzags hold a side for 10 to 20 s."""
    t = np.arange(600.0)
    zigzags = [turning(f"z{k}", k, np.where((t + 3 * k) % (20 + 4 * k) < 10 + 2 * k, 1.0, -1.0)) for k in range(6)]
    turn = turning("turn", 9, np.ones(600))
    states = coverage(Reference.of(zigzags, usual(zigzags)), turn)
    assert states.verdict == "inside"
    with_past = coverage(Reference.of(zigzags), turn)
    assert with_past.verdict == "leaves"
    assert {name.partition(" over ")[0] for name in with_past.channels} <= {"r", "delta"}
    assert all(" over " in name for name in with_past.channels)
    assert coverage(Reference.of([*zigzags, turning("other", 8, np.ones(600))]), turn).verdict == "inside"


def test_a_mean_over_the_past_forgets_exponentially_and_passes_gaps():
    t = np.arange(0.0, 100.0, 0.5)
    step = np.where(t >= 20.0, 1.0, 0.0)
    trial = Trial("step", t, {"r": step})
    found = columns(trial, ("r over 10 s",))[:, 0]
    assert found[t < 20.0] == pytest.approx(0.0, abs=1e-15)
    assert found[t >= 20.0] == pytest.approx(1.0 - np.exp(-(t[t >= 20.0] - 19.5) / 10.0))
    late = np.where(t < 5.0, np.nan, 2.0)
    late[50:60] = np.nan
    assert columns(trial.having(r=late), ("r over 10 s",))[:, 0] == pytest.approx(2.0 - 2.0 * np.exp(-(t + 0.5) / 10.0))


def test_the_past_is_as_long_as_the_ship_is_slow_to_turn():
    names = ("u", "r", "delta")
    fast, slow = (turning("a", 1, np.full(600, size)) for size in (2.0, 1.0))
    spans = [float(remembered([one], names)[3].removeprefix("r over ").removesuffix(" s")) for one in (fast, slow)]
    assert spans == pytest.approx([4.0 / 0.084, 4.0 / 0.044], rel=0.05)  # two deviations beyond the mean, nearly
    assert remembered([slow], ("u", "delta")) == ("u", "delta")
    assert len(remembered([slow], ("u", "r"))) == 3
    assert told(("u", "r over 9 s"), slow)
    assert not told(("u", "v_m", "r over 9 s"), slow)


def test_the_past_is_named_where_the_channel_itself_is_not():
    def named(**telling: float) -> tuple[str, ...]:
        own = {name.replace("_over", " over 9 s"): part for name, part in telling.items()}
        return Coverage("x", np.zeros(1), np.zeros(1), 0.5, own, dict.fromkeys(own, 0.0)).channels

    assert named(u=0.2, r_over=0.3, delta_over=0.5) == ("delta over 9 s", "r over 9 s")
    assert named(r=0.3, r_over=0.4, delta_over=0.35) == ("delta over 9 s", "r")


def test_gaps_are_left_out(train):
    trial = train[1]
    u = trial["u"].copy()
    u[:50] = np.nan
    found = coverage(Reference.of(train), trial.having(u=u))
    assert found.t[0] == trial.t[50]
    assert found.novelty.size == len(trial) - 50


def test_bad_input_is_refused_in_one_line(train):
    with pytest.raises(DataError, match="no training trial"):
        Reference.of([])
    with pytest.raises(DataError, match="no channel"):
        Reference.of(train, ("u", "nothing"))
    with pytest.raises(DataError, match="complete training samples"):
        Reference.of([train[0].rows(slice(0, 5))])
    with pytest.raises(DataError, match="no channel that all"):
        Reference.of(train, ())
    empty = train[0].having(u=np.full(len(train[0]), np.nan))
    with pytest.raises(DataError, match="no complete row"):
        coverage(Reference.of(train), empty)


@pytest.mark.slow
def test_the_page_draws_every_channel_and_says_the_verdict(train):
    reference, far = Reference.of(train, ("delta", "n_P")), wandering(50, n_P=40.0)
    text = page_of(reference, train, [far], [coverage(reference, far)], ["a finding"]).html
    assert text.count("<svg") == len(reference.channels) + 1
    for words in ("leaves", "n_P", "a finding", "rudder δ [°]"):
        assert words in text
    one = histogram("u", np.array([np.nan, 1.0]), np.array([2.0]))
    assert one == histogram("u", np.array([np.nan, 1.0]), np.array([2.0]))


@pytest.mark.long
def test_the_command_compares_with_a_training_set(tmp_path: Path, train, capsys):
    (tmp_path / "new").mkdir()
    (tmp_path / "train").mkdir()
    for trial in (*train[:4], wandering(50, n_P=40.0)):
        write_trial(trial, tmp_path / ("new" if trial.name == "w50" else "train") / f"{trial.name}.csv")
    page = tmp_path / "page.html"
    status = main(["check", str(tmp_path / "new"), "--against", str(tmp_path / "train"), "-o", str(page), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert said["coverage"]["w50"]["verdict"] == "leaves"
    assert said["coverage"]["w50"]["channels"][0] == "n_P"
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert status in (0, 1)


@pytest.mark.slow
def test_the_command_names_both_files_of_an_overlap(tmp_path: Path, train, capsys):
    (tmp_path / "new").mkdir()
    (tmp_path / "train").mkdir()
    write_trial(train[0], tmp_path / "train" / "whole.csv")
    write_trial(train[0].rows(slice(100, 400)), tmp_path / "new" / "part.csv")
    assert main(["check", str(tmp_path / "new"), "--against", str(tmp_path / "train")]) == 1
    said = capsys.readouterr().out
    assert "whole and part: training and test share a recording" in said


def test_a_page_needs_something_to_compare_with(tmp_path: Path, train, capsys):
    write_trial(train[0], tmp_path / "a.csv")
    assert main(["check", str(tmp_path / "a.csv"), "-o", str(tmp_path / "p.html")]) == 2
    assert "--against" in capsys.readouterr().err
    arguments = ["check", str(tmp_path / "a.csv"), "--against", str(tmp_path), "-o", str(tmp_path / "p.txt")]
    assert main(arguments) == 2
    assert ".html" in capsys.readouterr().err


@pytest.mark.slow
def test_the_search_is_prepared_once_however_many_files_there_are(train, monkeypatch):
    """A tree of all training samples for each file made the time grow with the square of the files."""
    from scipy import spatial

    made: list[int] = []
    tree = spatial.KDTree
    monkeypatch.setattr(spatial, "KDTree", lambda points: made.append(len(points)) or tree(points))
    reference = Reference.of(train)
    for trial in train:
        coverage(reference, trial)
    assert len(made) == 2


def test_a_file_is_judged_by_the_others_only():
    """Against the distance found point by point; one file lies far from the rest, and one is a single row."""
    rng = np.random.default_rng(4)
    parts = [rng.normal(size=(n, 3)) + 9.0 * (n == 30) for n in (40, 1, 30, 25)]
    for k, (part, found) in enumerate(zip(parts, apart(parts), strict=True)):
        others = np.concatenate(parts[:k] + parts[k + 1 :])
        near = np.sort(np.linalg.norm(part[:, None] - others[None], axis=2), axis=1)[:, :5]
        assert found == pytest.approx(np.sqrt(np.mean(near**2, axis=1)))
