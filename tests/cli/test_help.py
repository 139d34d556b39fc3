"""What `--help` says, and what README.md and docs/commands.md say of the commands, the ships and the manoeuvres."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import get_type_hints

import pytest

from seatrial.cli.app import app, main
from seatrial.cli.command import about
from seatrial.ships.files import library
from seatrial.workflow.asked import Always
from seatrial.workflow.simulation import known

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
PAGE = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
COMMANDS = app.whole()
NAMES = sorted(COMMANDS)


@pytest.mark.parametrize("name", NAMES)
def test_help_is_for_users(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What a function raises, takes or returns is for those who call it from Python."""
    assert main([name, "--help"]) == 0
    told = capsys.readouterr().out
    assert f"seatrial {name}" in told
    assert not re.search(r"\b(Raises|Args|Returns|Attributes|Yields):", told)


MOST_OPTIONS = 200
VERBS = {
    "add", "allow", "build", "check", "choose", "compare", "convert", "design", "divide", "end", "estimate",
    "export", "fit", "identify", "import", "judge", "limit", "list", "listen", "mark", "measure", "mend", "name",
    "obey", "place", "predict", "print", "read", "recommend", "record", "release", "replay", "resample",
    "reset", "run", "scale", "seed", "send", "serve", "set", "show", "simulate", "split", "start", "steer", "trust",
    "turn", "use", "validate", "write",
}  # fmt: skip


def test_help_texts_are_short_imperative_sentences() -> None:
    """One sentence that begins with a verb, at most 80 characters, on every command, argument and option."""
    wrong: list[str] = []
    for name, command in COMMANDS.items():
        texts = {"": command.help, **{one.name: about(one) for one in command.params}}
        for option, text in texts.items():
            first = (text or "").partition(" ")[0].lower()
            if not (text and len(text) <= 80 and text.endswith(".") and first in VERBS and "\n" not in text):
                wrong.append(f"{name} {option}: {text}")
    assert not wrong, "\n".join(wrong)


def test_the_list_of_commands_cuts_no_help_short(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out.partition("Data:")[2]
    assert all(name in listed for name in NAMES)
    assert "..." not in listed


def test_help_of_simulate_lists_the_manoeuvres(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--help"]) == 0
    told = capsys.readouterr().out
    listed = told.partition("Manoeuvres:")[2].strip().rstrip(".")
    assert [name.strip() for name in listed.split(",")] == list(known())


def test_options_are_few_enough_to_know() -> None:
    """One that several commands take as a part of a group counts once."""
    kinds = {(name, option): group for name, command in COMMANDS.items() for group in (*command.groups.values(), Always)
             for option in get_type_hints(group)}  # fmt: skip
    owners = {(next(one for one in kinds[key].__mro__ if key[1] in vars(one)) if key in kinds else key[0], key[1])
              for name, command in COMMANDS.items() for one in command.params
              if one.param_type_name == "option" and (key := (name, str(one.name)))}  # fmt: skip
    assert len(owners) <= MOST_OPTIONS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "absent"),
    [("['--help']", ("numpy", "scipy", "pydantic")),
     ("['simulate', 'kvlcc2_l7', 'turning', '--rudder', '20', '--json']",
      ("scipy.optimize", "scipy.linalg", "pydantic", "polars", "torch", "matplotlib", "seatrial.validate"))],
    ids=["help", "simulate"],
)  # fmt: skip
def test_a_cold_start_imports_only_what_it_needs(arguments: str, absent: tuple[str, ...]) -> None:
    code = f"import sys\nfrom seatrial.cli.app import main\nmain({arguments})\n"
    code += f"sys.exit(', '.join(set(sys.modules) & set({absent!r})) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"imported for nothing: {done.stderr}"


@pytest.mark.parametrize("name", NAMES)
def test_the_page_of_commands_has_every_command(name: str) -> None:
    assert re.search(rf"`seatrial {name}\b", PAGE)


def test_the_pages_have_no_command_that_there_is_not() -> None:
    assert set(re.findall(r"`seatrial ([a-z][a-z-]*)", README + PAGE)) <= set(NAMES)


def test_readme_counts_ships() -> None:
    assert "Over forty ships, every number of a file with its source" in README
    assert len(library()) > 40


def test_type_checkers_of_others_read_our_types() -> None:
    """PEP 561: without this file they take every name of an installed package for Any."""
    assert files("seatrial").joinpath("py.typed").is_file()
