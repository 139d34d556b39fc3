"""`seatrial study new`: what is held out, what is free, and that the file runs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.folder import read_folder
from seatrial.data.trialfile import write_trial
from seatrial.identify import StudyError
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.study.drafting.draft import draft
from seatrial.study.drafting.held_out import dated
from seatrial.study.study import read_study
from seatrial.workflow.asked import Orders, Span
from seatrial.workflow.simulation import simulate

NOISE = Sensors({"x": 0.02, "y": 0.02, "psi": 0.002, "u": 0.01, "v_m": 0.01, "r": 0.001})
RUNS = {
    "zigzag_a": ("zigzag", {"rudder": 10.0, "heading": 10.0}),
    "zigzag_b": ("zigzag", {"rudder": 20.0, "heading": 20.0}),
    "zigzag_c": ("zigzag", {"rudder": 15.0, "heading": 10.0}), "turn_a": ("turning", {"rudder": 35.0}),
    "turn_b": ("turning", {"rudder": 20.0, "side": "port"}), "line": ("straight", {}),
}  # fmt: skip


@pytest.fixture(scope="module")
def runs() -> dict[str, Trial]:
    """Virtual trials of the 7 m KVLCC2, read by sensors with noise, ten a second."""
    rng = np.random.default_rng(5)
    out: dict[str, Trial] = {}
    for name, (kind, options) in RUNS.items():
        made = simulate("kvlcc2_l7", kind, orders=Orders(**options), span=Span(150.0)).trial
        out[name] = replace(NOISE.read(made.rows(slice(0, None, 4)), rng), name=name)
    return out


@pytest.fixture
def folder(runs: dict[str, Trial], tmp_path: Path) -> Path:
    return written(runs, tmp_path / "logs")


def written(trials: dict[str, Trial], at: Path) -> Path:
    at.mkdir()
    for name, trial in trials.items():
        write_trial(replace(trial, name=name), at / f"{name}.csv")
    return at


def made(folder: Path, tmp_path: Path, ship: str = "kvlcc2_l7"):
    return draft(ship, load(ship), read_folder(folder), tmp_path / "study.toml")


@pytest.mark.slow
def test_some_of_each_kind_are_held_out_whole(folder: Path, tmp_path: Path) -> None:
    """No times are known here: one from the middle of the names of a side, so that the fit has those beyond."""
    found = made(folder, tmp_path)
    assert dict(found.test) == {"zigzag": ("zigzag_b",), "turning": ("turn_b",)}
    assert "no times are known" in found.text
    assert found.train["straight"] == ("line",)
    assert found.notes == ("straight: one recording only, for training; nothing of this kind judges the model",)


@pytest.mark.slow
def test_later_means_recorded_later(runs: dict[str, Trial], tmp_path: Path) -> None:
    """The start in the sidecar decides, whatever the names."""
    starts = {"zigzag_a": "2024-05-03T12:00:00+00:00", "zigzag_b": "2024-05-01T12:00:00+02:00",
              "zigzag_c": "2024-05-02T12:00:00+00:00"}  # fmt: skip
    some = {name: replace(runs[name], meta={**runs[name].meta, "start": start}) for name, start in starts.items()}
    assert made(written(some, tmp_path / "logs"), tmp_path).test["zigzag"] == ("zigzag_a",)


@pytest.mark.slow
def test_each_side_is_in_both_sets(runs: dict[str, Trial], tmp_path: Path) -> None:
    """Three turns to either side, those to port the later ones."""
    some: dict[str, Trial] = {}
    for k in range(3):
        for side, day, sign in (("stbd", 1, 1.0), ("port", 2, -1.0)):
            # another noise, that they are no copies
            noisy = NOISE.read(runs["turn_a"], np.random.default_rng(100 * day + k))
            mirrored = noisy.having(**{c: sign * noisy[c] for c in ("y", "psi", "v_m", "r", "delta")})
            start = {"start": f"2024-05-0{day}T1{k}:00:00+00:00"}
            some[f"{side}_{k}"] = Trial(side, mirrored.t, {c: v for c, v in mirrored.channels.items()
                                        if not c.endswith("_cmd")}, meta={**noisy.meta, **start})  # fmt: skip
    found = made(written(some, tmp_path / "logs"), tmp_path)
    assert set(found.test["turning"]) == {"stbd_2", "port_2"}


@pytest.mark.parametrize(
    ("early", "late"),
    [("turn_14-Sep-2020_15_58_08", "turn_14-Oct-2020_14_08_51"), ("a_2023-12-31_23-59-59", "a_2024-01-01T000000"),
     ("no date", "a_1999-01-01_00_00_00"), ("a_31-Feb-2020_10_00_00", "a_01-Mar-2020_10_00_00")],
)  # fmt: skip
def test_dates_in_names_count(early: str, late: str) -> None:
    assert dated(early) < dated(late)


@pytest.mark.slow
def test_a_copy_is_never_on_both_sides(runs: dict[str, Trial], tmp_path: Path) -> None:
    """A cut of a recording, under another name and later in time, is left out."""
    cut = runs["zigzag_a"].rows(slice(50, 300))
    some = {**{n: runs[n] for n in ("zigzag_a", "zigzag_b")}, "zigzag_z": replace(cut, t=cut.t + 1000.0)}
    found = made(written(some, tmp_path / "logs"), tmp_path)
    assert found.left_out == {"zigzag_z": "shares rows with zigzag_a, which is kept"}
    assert found.test["zigzag"] == ("zigzag_b",)
    assert "zigzag_z" in found.text


@pytest.mark.slow
def test_it_is_a_study_as_written(folder: Path, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    assert main(["study", "new", "kvlcc2_l7", str(folder), "-o", str(study)]) == 0
    read = read_study(study)
    assert [trial.name for trial in read.test] == ["zigzag_b", "turn_b"]
    free = {one.path for one in read.problem.free}
    assert {"hull.N_v", "hull.R_0", "rudder.gamma_Rp"} <= free
    assert not {"propeller.D_P", "rudder.A_R", "body.m"} & free


@pytest.mark.slow
def test_priors_of_an_estimated_ship_are_its_own_and_those_of_a_published_one_relative(
    folder: Path, tmp_path: Path
) -> None:
    """Regressions state their sigma; 30 % about it would trust a guess of R_0 as much as one of N_r."""
    particulars = tmp_path / "particulars.toml"
    numbers = "\n".join(f"{key} = {value}" for key, value in (("L_pp", 7.0), ("B", 1.27), ("d", 0.46), ("C_b", 0.81)))
    particulars.write_text(f'schema = "seatrial-particulars/1"\nname = "bare"\n[particulars]\n{numbers}\n')
    ship, study = tmp_path / "bare.toml", tmp_path / "study.toml"
    assert main(["estimate", str(particulars), "-o", str(ship)]) == 0
    assert main(["study", "new", str(ship), str(folder), "-o", str(study)]) == 0
    problem = read_study(study).problem
    entries = load(str(ship)).entries
    free = {one.path: one for one in problem.free}
    assert {path: one.sigma for path, one in free.items()} == {path: entries[path].sigma for path in free}
    assert len({round(entries[path].sigma / abs(one.start), 3) for path, one in free.items()}) > 5
    published = {one.path: one for one in read_study(made_study(folder, tmp_path / "published.toml")).problem.free}
    one = published["hull.N_r"]
    assert one.sigma == pytest.approx(0.3 * abs(one.start))
    guessed = {"propeller.C_1", "propeller.C_2n", "propeller.k_0", "propeller.k_2", "rudder.f_alpha", "rudder.eta"}
    assert guessed <= {*free}, "a number that a regression gave, if held, makes others wrong"
    assert not guessed & {*published}, "what was measured is fixed"


def made_study(folder: Path, out: Path) -> Path:
    assert main(["study", "new", "kvlcc2_l7", str(folder), "-o", str(out)]) == 0
    return out


@pytest.mark.slow
def test_errors_weigh_by_noise_and_a_current_is_shared_by_all_trials(folder: Path, tmp_path: Path) -> None:
    """Of a model of 1.2 m/s a current is at most a quarter of its speed, at sea half a metre a second."""
    problem = read_study(made_study(folder, tmp_path / "study.toml")).problem
    assert problem.loss.scale == "noise"
    assert problem.loss.correlation is None
    assert set(problem.nuisance.common) >= {"current.north", "current.east"}
    assert problem.nuisance.common["current.north"] == pytest.approx(0.25 * 1.179, rel=0.1)


@pytest.mark.slow
def test_a_compass_that_is_right_is_not_estimated(folder: Path, tmp_path: Path) -> None:
    problem = read_study(made_study(folder, tmp_path / "study.toml")).problem
    assert set(problem.nuisance.common) == {"current.north", "current.east"}


@pytest.mark.slow
def test_what_the_logs_show_of_an_instrument_is_free_in_the_study_and_told(
    runs: dict[str, Trial], tmp_path: Path
) -> None:
    scaled = {name: runs[name].having(r=1.09 * runs[name]["r"]) for name in ("zigzag_a", "zigzag_b", "turn_a")}
    logs = {name: replace(one, channels={n: c for n, c in one.channels.items() if not n.endswith("_cmd")})
            for name, one in scaled.items()}  # fmt: skip
    found = made(written(logs, tmp_path / "logs"), tmp_path)
    (tmp_path / "study.toml").write_text(found.text)
    assert read_study(tmp_path / "study.toml").problem.nuisance.common["scale.r"] == pytest.approx(0.18, rel=0.1)
    assert "what the logs show of their instruments" in found.text
    assert [note for note in found.notes if note.startswith("scale.r: the logs show a scale error of the yaw rate of")]


@pytest.mark.slow
def test_where_all_head_one_way_or_a_current_is_on_record_none_is_estimated(
    runs: dict[str, Trial], tmp_path: Path
) -> None:
    """Zigzags along a basin cannot tell a current from the ship's own speed; a circle can, or another course."""
    along = {name: runs[name] for name in ("zigzag_a", "zigzag_b", "zigzag_c")}
    assert "current.north" not in made(written(along, tmp_path / "along"), tmp_path).text
    back = {**along, "zigzag_c": runs["zigzag_c"].having(psi=runs["zigzag_c"]["psi"] + math.pi)}
    assert "current.north" in made(written(back, tmp_path / "back"), tmp_path).text
    turns = {**along, "turn_a": runs["turn_a"], "turn_b": runs["turn_b"]}
    assert "current.north" in made(written(turns, tmp_path / "turns"), tmp_path).text
    rows = {name: np.full(len(trial), 0.1) for name, trial in turns.items()}
    known = {name: trial.having(U_C=rows[name], gamma_C=rows[name]) for name, trial in turns.items()}
    assert "current.north" not in made(written(known, tmp_path / "known"), tmp_path).text


@pytest.mark.slow
@pytest.mark.parametrize(("channel", "told"), [("U_A", "U_A: 3.0 m/s"), ("U_T", "U_T: 3.0 m/s"), ("", "")])
def test_a_wind_on_record_that_the_ship_does_not_feel_is_said_with_the_remedy(
    runs: dict[str, Trial], tmp_path: Path, channel: str, told: str
) -> None:
    angle = {"U_A": "gamma_A", "U_T": "gamma_T"}

    def windy(trial: Trial) -> Trial:
        rows = np.ones(len(trial))
        return trial.having(**{channel: 3.0 * rows, angle[channel]: rows}) if channel else trial

    blown = {name: windy(runs[name]) for name in ("turn_a", "zigzag_a", "zigzag_b")}
    notes = " ".join(made(written(blown, tmp_path / "logs"), tmp_path).notes)
    assert told in notes
    assert ("no force of wind" in notes) == bool(channel)
    assert ("[wind]" in notes) == bool(channel)


@pytest.mark.slow
def test_without_a_turn_nothing_of_the_turn_is_free(runs: dict[str, Trial], tmp_path: Path) -> None:
    some = {"line": runs["line"], "slow": replace(runs["line"].having(u=runs["line"]["u"] - 0.1), name="slow")}
    text = made(written(some, tmp_path / "logs"), tmp_path).text
    assert "hull.[RX]_*" in text
    assert "hull.*" not in text
    assert "rudder" not in text.partition("[free]")[2]


@pytest.mark.slow
def test_one_recording_is_cut_in_time(runs: dict[str, Trial], tmp_path: Path) -> None:
    folder = written({"zigzag_b": runs["zigzag_b"]}, tmp_path / "logs")
    study = tmp_path / "study.toml"
    assert main(["study", "new", "kvlcc2_l7", str(folder), "-o", str(study)]) == 0
    read = read_study(study)
    (train,), (test,) = read.problem.trials, read.test
    assert train.t[-1] < test.t[0]
    assert len(train) + len(test) == len(runs["zigzag_b"])
    assert "one recording only" in " ".join(made(folder, tmp_path).notes)


@pytest.mark.parametrize(
    ("ship", "change", "message"),
    [("kvlcc2", lambda t: t, "is of a ship of 7 m, kvlcc2 has 320 m"),
     ("kvlcc2_l7", lambda t: replace(t, channels={k: v for k, v in t.channels.items() if "delta" not in k}),
      "no channel delta, which kvlcc2_l7 needs"),
     ("kvlcc2_l7", lambda t: t.rows(slice(0, 25)), "25 rows are too few"),
     ("kvlcc2_l7_arx", lambda t: t, "is sampled every .* s, kvlcc2_l7_arx runs at 0.25 s only"),
     ("esso_osaka_3m_network", lambda t: t, "is a network, which has weights")],
)  # fmt: skip
def test_recordings_that_the_ship_cannot_be_fitted_to(runs, tmp_path: Path, ship: str, change, message: str) -> None:
    folder = written({"zigzag_a": change(runs["zigzag_a"])}, tmp_path / "logs")
    with pytest.raises(StudyError, match=message):
        made(folder, tmp_path, ship)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["study", "old", "kvlcc2_l7", "{logs}", "-o", "{out}"], "study: no action 'old'"),
     (["study", "new", "kvlcc3", "{logs}", "-o", "{out}"], "kvlcc3"),
     (["study", "new", "kvlcc2_l7", "{logs}", "-o", "{out}.txt"], "a study ends in .toml"),
     (["study", "new", "kvlcc2_l7", "{none}", "-o", "{out}"], "none"),
     (["study", "new", "kvlcc2_l7", "{empty}", "-o", "{out}"], "no trial file"),
     (["study", "new", "kvlcc2_l7", "{logs}", "-o", "{there}"], "is there already"),
     (["study", "new", "kvlcc2_l7", "{logs}/line.csv", "-o", "{out}"], "is a file; name the folder"),
     (["study", "new", "kvlcc2_l7", "{logs}", "-o", "{out}", "--format", "cvs"], "no format 'cvs'; near: csv"),
     (["trials", "{logs}", "-o", "{out}"], "a page ends in .html"),
     (["trials", "{logs}", "--mapping", "{there}"], "a mapping is of no use without a format"),
     (["trials", "{mixed}"], "several formats")],
)  # fmt: skip
def test_wrong_requests_end_in_one_line(
    folder: Path, tmp_path: Path, capsys, arguments: list[str], message: str
) -> None:
    there, empty, mixed = tmp_path / "there.toml", tmp_path / "empty", tmp_path / "mixed"
    there.write_text("x = 1\n")
    empty.mkdir()
    mixed.mkdir()
    (mixed / "a.csv").write_text("t [s],u [m/s]\n0,1\n1,1\n")
    (mixed / "b.csv").write_text("t [s],x_position_mid [m]\n0,1\n1,1\n")
    before = sorted(tmp_path.rglob("*"))
    names = {"logs": folder, "out": tmp_path / "new.toml", "none": tmp_path / "none", "there": there, "empty": empty,
             "mixed": mixed}  # fmt: skip
    assert main([one.format(**names) for one in arguments]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_a_folder_with_two_files_of_one_name_is_refused(folder: Path) -> None:
    (folder / "line.parquet").write_bytes(b"")
    with pytest.raises(DataError, match="a second recording of this name"):
        read_folder(folder)
