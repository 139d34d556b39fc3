"""Defaults of a project from `seatrial.toml`, `--quiet`, and what shells complete."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.shell_completion import ShellComplete
from rich.console import Console

from seatrial.cli.app import app, main
from seatrial.cli.command import PROJECT
from seatrial.core.parameters import specs
from seatrial.data import Trial
from seatrial.data.trialfile import write_trial
from seatrial.environment.weather import SPECTRA
from seatrial.ships.files import load
from seatrial.study.data import DATA

SAID = 'schema = "seatrial-project/1"\n'
SHORT = ("simulate", "kvlcc2_l7", "zigzag", "--json")


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Writes the file into a folder that commands run in."""
    monkeypatch.chdir(tmp_path)

    def write(text: str, schema: str = SAID) -> None:
        (tmp_path / PROJECT).write_text(schema + text, encoding="utf-8")

    return write


def settings(capsys: pytest.CaptureFixture[str], *more: str) -> tuple[dict[str, Any], str]:
    assert main([*SHORT, *more]) == 0
    told = capsys.readouterr()
    return json.loads(told.out)["settings"], told.err


@pytest.mark.slow
def test_a_default_is_taken_where_the_command_is_not_told_and_said(project: Any, capsys: Any) -> None:
    project("[options.simulate]\nrudder = 12\nheading = 8\n[options.imo]\nbands = 90\n")
    found, told = settings(capsys)
    assert (found["rudder"], found["heading"]) == pytest.approx((12.0, 8.0))
    assert "note: seatrial.toml: --rudder 12.0, --heading 8.0\n" in told
    found, told = settings(capsys, "--rudder", "15")
    assert (found["rudder"], found["heading"]) == pytest.approx((15.0, 8.0))
    assert "note: seatrial.toml: --heading 8.0\n" in told


def test_it_is_that_of_the_working_folder_alone(project: Any, tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    project("[options.simulate]\nrudder = 12\n")
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path / "below")
    found, told = settings(capsys)
    assert found["rudder"] != 12.0
    assert "seatrial.toml" not in told


@pytest.mark.parametrize(
    ("text", "wrong"),
    [('schema = "seatrial-ship/1"\n', "seatrial-project/1"), ("quiet = true\n", "seatrial-project/1"),
     (f"{SAID}quite = true\n", "no key 'quite'; near: quiet"),
     (f"{SAID}quiet = 1\n", "quiet is 1; it must be true or false"),
     (f"{SAID}[options.simulat]\nrudder = 12\n", "no command 'simulat'; near: simulate"),
     (f"{SAID}[options.simulate]\nruder = 10\n", "simulate: no option that a project sets 'ruder'; near: rudder"),
     (f'{SAID}[options.simulate]\nrudder = "10"\n', "options.simulate.rudder is '10'; it must be a number"),
     (f"{SAID}[options.simulate]\nrudder = true\n", "rudder is True; it must be a number"),
     (f"{SAID}[options.simulate]\nseed = 1.5\n", "seed is 1.5; it must be a whole number"),
     (f"{SAID}[options.simulate]\nwind = 3\n", "wind is 3; it must be a text"),
     (f'{SAID}[options.simulate]\ntrust = "os"\n', "no option that a project sets 'trust'"),
     (f"{SAID}[options.simulate]\njson = true\n", "no option that a project sets 'json'"),
     (f'{SAID}[options.simulate]\nout = "a.csv"\n', "no option that a project sets 'out'"),
     (f'{SAID}[options.simulate]\nname = "turning"\n', "no option that a project sets 'name'"),
     (f"{SAID}data =\n", "seatrial.toml")],
)  # fmt: skip
def test_what_is_wrong_with_it_is_one_line(text: str, wrong: str, project: Any, capsys: Any) -> None:
    project(text, schema="")
    assert main(list(SHORT)) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("error: seatrial.toml: ")
    assert wrong in told.err
    assert told.err.count("\n") == 1


def test_help_needs_no_project_that_can_be_read(project: Any, capsys: Any) -> None:
    project("no TOML", schema="")
    assert main(["simulate", "--help"]) == 0
    assert main(["--help"]) == 0


def test_permissions_and_destinations_are_never_those_of_a_file() -> None:
    """Of no command may a file allow modules or addresses, or say where to write."""
    from seatrial.cli.command import _NEVER

    assert {"trust", "anywhere", "out", "json"} <= set(_NEVER)
    names = {one.name for command in app.whole().values() for one in command.params}
    assert set(_NEVER) <= names


def test_data_stand_for_the_variable_unless_the_shell_has_one(project: Any, capsys: Any, monkeypatch: Any) -> None:
    project('data = "kept"\n')
    Path("kept/fleet").mkdir(parents=True)
    study = 'schema = "seatrial-study/1"\nship = "kvlcc2_l7"\n[data]\nroot = "$SEATRIAL_DATA/fleet"\n'
    Path("study.toml").write_text(f'{study}train = ["*"]\n[free]\n"hull.R_0" = {{ ratio = 0.5 }}\n')
    monkeypatch.delenv(DATA, raising=False)
    assert main(["identify", "study.toml", "-o", "run"]) == 2
    assert str(Path("kept/fleet")) in capsys.readouterr().err
    assert DATA not in os.environ
    monkeypatch.setenv(DATA, "elsewhere")
    assert main(["identify", "study.toml", "-o", "run"]) == 2
    assert str(Path("elsewhere/fleet")) in capsys.readouterr().err


@pytest.mark.slow
def test_quiet_leaves_results_and_errors(project: Any, capsys: Any) -> None:
    assert main(["show", "esso_osaka"]) == 0
    loud = capsys.readouterr()
    assert main(["show", "esso_osaka", "--quiet"]) == 0
    quiet = capsys.readouterr()
    assert loud.err
    assert (quiet.out, quiet.err) == (loud.out, "")
    project("quiet = true\n[options.simulate]\nrudder = 12\n")
    assert settings(capsys)[1] == ""
    assert main(["simulate", "kvlcc2_l7", "zigzags", "--quiet"]) == 2
    assert capsys.readouterr().err.startswith("error: ")


@pytest.mark.slow
def test_what_is_printed_has_no_colour_where_none_is_wanted(capsys: Any, monkeypatch: Any) -> None:
    """https://no-color.org; the moving line of a terminal is Rich's, and follows the variable as well."""
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert main(["show", "kvlcc2_l7"]) == 0
    assert "\x1b[3" not in capsys.readouterr().out
    assert Console(force_terminal=True).no_color


# shells


def offered(*words: str) -> list[str]:
    """What is offered for the last of some words."""
    found = ShellComplete(app, {}, "seatrial", "_SEATRIAL_COMPLETE").get_completions(list(words[:-1]), words[-1])
    return [one.value for one in found if one.type != "file"]


def test_parameters_are_those_of_the_ship_that_is_named() -> None:
    hull = [path for path in specs(load("kvlcc2_l7").model) if path.startswith("hull.")]
    assert offered("design", "kvlcc2_l7", "--free", "hull.") == ["hull.*", *hull]
    whole = [path for path in specs(load("mariner").model) if path.startswith("body.")]
    assert offered("design", "mariner", "--free", "body.") == ["body.*", *whole]
    assert offered("design", "no such ship", "--free", "hull.") == []
    assert offered("twin", "kvlcc2_l7", "--free", "rudder.t") == ["rudder.t_R"]


@pytest.mark.slow
def test_channels_are_those_of_the_trial_that_is_named(tmp_path: Path) -> None:
    t = np.arange(3.0)
    write_trial(Trial("one", t, {"n_P": t, "alpha_1": t, "alpha_2": t}), tmp_path / "one.csv")
    assert offered("servo", str(tmp_path / "one.csv"), "--control", "alpha") == ["alpha_1", "alpha_2"]
    assert offered("servo", str(tmp_path / "none.csv"), "--control", "") == []


@pytest.mark.slow
def test_names_of_closed_lists() -> None:
    assert offered("simulate", "kcs", "turning", "--gusts", "") == list(SPECTRA)
    assert offered("simulate", "kcs", "turning", "--side", "st") == ["starboard"]
    assert offered("import", "dataf") == ["dataflash"]
    assert "berthing" in offered("validate", "m.toml", "t.csv", "--for", "b")
    assert offered("requirements", "kcs", "--scope", "c") == ["collision-avoidance"]
    assert offered("calibrate", "m.toml", "--folds", "h") == ["hardest"]
    assert offered("paper", "you") == ["you2023"]
    assert offered("design", "kcs", "--noise", "v") == ["v_m="]
    assert "tanker_quay" in offered("harbour", "berthing", "--chart", "t")


def test_of_what_no_name_begins_with_files_are_offered() -> None:
    """A fitted ship is a file: its name is completed where a ship's is."""
    found = ShellComplete(app, {}, "seatrial", "_SEATRIAL_COMPLETE").get_completions(["show"], "runs/mo")
    assert [(one.value, one.type) for one in found] == [("runs/mo", "file")]
