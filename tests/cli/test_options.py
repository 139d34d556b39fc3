"""Every option of a command reaches its work under its own name, and what is not given is what the work takes itself.

The work is replaced by one that keeps what it was given.  Each option has a value that no other has.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import pytest

from seatrial.cli.app import app, main

COMMANDS: Any = app.whole()


class ReachedError(Exception):
    """The work was reached."""


@dataclass(frozen=True)
class Case:
    """A command and the function that does its work.

    Attributes:
        names: of the work's parameters, where they are not those of the command.
        without: parameters of the command that do not go to this function.
        given: values that are no free text.
        turned: how a value is changed on its way.
    """

    command: str
    work: str
    names: Mapping[str, str] = field(default_factory=dict)
    without: tuple[str, ...] = ()
    given: Mapping[str, Any] = field(default_factory=dict)
    turned: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.command}, {self.work.rpartition('.')[2]}"


SAILED = {"ship": "ship", "name": "manoeuvre"}
BANDED = ("level", "count", "extrapolate", "of")
FLAGS = ("show", "verify", "merge", "report", "rare", "runs")
CASES = (
    Case("simulate", "workflow.simulation.simulate", SAILED, BANDED),
    Case("simulate", "workflow.evidence.bands.simulate_with_bands", {"ship": "model", "name": "manoeuvre"},
         ("of", "sea", "rao", "roll_damping", "device")),
    Case("simulate", "workflow.campaigns.replayed", {"of": "where", "ship": "run_number"},
         ("name", "rudder", "heading", "steer", "side", "seed", "speed", "rps", "throttle", "duration", "dt", "wind",
          "gusts", "current", "waves", "depth", "sea", "rao", "roll_damping", "device", "level", "count",
          "extrapolate"), {"ship": "12"}, {"ship": int}),
    Case("steer", "workflow.afloat.sail"),
    Case("bridge", "workflow.afloat.sail", without=("page",)),
    Case("range", "workflow.afloat.sail", without=("encounter",)),
    Case("twin", "workflow.live.twin.twin", {}, ("page", "port")),
    Case("check", "workflow.validate.check", {"trials": "paths"}),
    Case("predict", "workflow.validate.predict", {"trials": "paths"}),
    Case("validate", "workflow.validate.validate", {"trials": "paths", "limit": "limits"}),
    Case("identify", "workflow.identify.identify", {"study": "path"}, ("page", "port")),
    Case("card", "workflow.evidence.card.card"),
    Case("calibrate", "workflow.evidence.calibrate.calibrate", {"fit_first": "first", "folds": "by"}),
    Case("campaign", "workflow.campaigns.campaign", {"source": "path"}, FLAGS, {}, {"source": Path}),
    Case("campaign", "workflow.campaigns.analysing.rare", {"source": "path", "rare": "criterion"},
         ("shard", "dask", "device", *FLAGS[:4]), {}, {"source": Path, "out": Path}),
    Case("campaign", "workflow.campaigns.status", {"source": "where"},
         ("out", "shard", "dask", "device", "threads", "merge", "report", "rare", "runs", "show")),
    Case("campaign", "workflow.campaigns.merged", {"source": "where"},
         ("shard", "dask", "device", "threads", "verify", "report", "rare", "runs", "show", "merge"),
         turned={"out": Path}),
    Case("captive", "workflow.judging.captive", {"open_water": "water", "report": "page"}),
    Case("scale", "workflow.judging.scale", {"rudder_wake": "rudder", "froude": "friction"},
         turned={"roughness": lambda micrometres: micrometres / 1e6, "froude": lambda alone: not alone}),
    Case("roll", "workflow.seaway.making.roll", {"midship": "C_m"}),
    Case("seakeeping", "workflow.seaway.making.seakeeping"),
    Case("export", "workflow.plant.export"),
    Case("copy", "workflow.judging.copy"),
    Case("estimate", "workflow.judging.estimate"),
    Case("design", "workflow.judging.design"),
    Case("imo", "workflow.judging.imo"),
    Case("requirements", "workflow.judging.requirements"),
    Case("thrust-map", "workflow.plant.thrust_map"),
    Case("servo", "workflow.plant.servo", {"trials": "paths", "control": "controls"}),
    Case("resample", "workflow.data.resample"),
    Case("mend", "workflow.data.mend"),
    Case("convert", "workflow.data.convert"),
    Case("import", "workflow.data.import_logs", {}, ("guess",), {"format": "csv"}),
    Case("import", "workflow.data.guess_mapping", {"guess": "folder"}, ("format", "source", "mapping")),
    Case("trials", "workflow.folders.survey.trials"),
    Case("study", "workflow.folders.drafting.new_study"),
    Case("harbour", "workflow.harbour.harbour", {"run": "what"}),
    Case("bench", "workflow.installation.bench.bench", {}, ("listed",)),
    Case("ships", "workflow.contributing.ship_check.check_ship_file", {"check": "name_or_path"}),
)  # fmt: skip


def kind_of(parameter: Any) -> str:
    kinds = {click.FLOAT: "float", click.INT: "int", click.BOOL: "bool", click.STRING: "str"}
    return kinds.get(parameter.type, "Path")


def value_of(parameter: Any, k: int, case: Case) -> tuple[list[str], Any]:
    """Words for one parameter, and what they mean."""
    kind = kind_of(parameter)
    text = str(case.given.get(parameter.name, f"{parameter.name}-{k}"))
    words, value = {
        "float": ([f"{k + 0.5}"], k + 0.5), "int": ([str(k)], k), "Path": ([text], Path(text)), "str": ([text], text),
        "bool": ([], not parameter.default),
    }[kind]  # fmt: skip
    if parameter.multiple or parameter.nargs == -1:
        words, value = [*words, f"{text}b"], [value, type(value)(f"{text}b")]
    if parameter.param_type_name == "argument":
        return words, value
    flag = max(parameter.opts, key=len)
    return ([flag] if kind == "bool" else [x for word in words for x in (flag, word)]), value


def asked(case: Case, *, only_needed: bool) -> tuple[list[str], dict[str, Any]]:
    """The words of a command, and what each parameter then is."""
    command = COMMANDS[case.command]
    words: list[str] = []
    values: dict[str, Any] = {}
    for k, parameter in enumerate(command.params, 3):
        name = parameter.name
        if name in (*case.without, "help", "json", "trust", "quiet") or (only_needed and not parameter.required):
            continue
        more, values[name] = value_of(parameter, k, case)
        words = [*more, *words] if parameter.param_type_name != "argument" else [*words, *more]
    return words, values


def plain(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def parameters(work: str) -> Mapping[str, inspect.Parameter]:
    module, _, name = f"seatrial.{work}".rpartition(".")
    return inspect.signature(getattr(importlib.import_module(module), name)).parameters


def apart(given: Mapping[str, Any]) -> dict[str, Any]:
    """Groups of options in place of their values."""
    groups = [one for one in given.values() if type(one).__module__ == "seatrial.workflow.asked"]
    alone = {name: one for name, one in given.items() if one not in groups}
    return {**alone, **{name: one for group in groups for name, one in vars(group).items()}}


USUAL = {one.work: parameters(one.work) for one in CASES}
EXTRA = {
    "simulate_with_bands": ["--bands", "95"], "rare": ["--rare", "a < 1"],
    "status": ["--status"], "merged": ["--merge"],
}  # fmt: skip
"""What asks for this work and not for another of the same command."""

ALWAYS = ("sink", "level", "nmea", "page", "judge")
"""What a command gives by itself, or asks for to be run at all."""


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> Callable[[Case, list[str]], dict[str, Any]]:
    """What the work of a case is given by a command."""

    def run(case: Case, words: list[str]) -> dict[str, Any]:
        where, _, name = f"seatrial.{case.work}".rpartition(".")
        module = importlib.import_module(where)
        signature, kept = inspect.signature(getattr(module, name)), []

        def work(*positional: Any, **named: Any) -> Any:
            kept.append(signature.bind(*positional, **named))
            raise ReachedError

        monkeypatch.setattr(module, name, work)
        with pytest.raises(ReachedError):
            main([case.command, *words])
        [bound] = kept
        return apart(bound.arguments)

    return run


@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_option_reaches_the_work_under_its_own_name(case: Case, given: Any) -> None:
    words, values = asked(case, only_needed=False)
    if case.work.endswith("merged"):
        words = ["--merge", *words]
    found = given(case, words)
    for group in [one for one in found.values() if type(one).__module__ == "seatrial.workflow.asked"]:
        found |= vars(group)
    for name, value in values.items():
        expected = case.turned.get(name, plain)(value)
        there = plain(found[case.names.get(name, name)])
        if isinstance(there, float):
            there = pytest.approx(there, rel=1e-12)
        assert there == plain(expected), name


@pytest.mark.parametrize("case", [one for one in CASES if one.work.rpartition(".")[2] not in
                                  ("replayed", "guess_mapping", "check_ship_file")], ids=str)  # fmt: skip
def test_what_is_not_given_is_what_the_work_takes_itself(case: Case, given: Any) -> None:
    words, needed = asked(case, only_needed=True)
    extra = EXTRA.get(case.work.rpartition(".")[2], [])
    if case.command == "simulate":
        words = [*words, "turning"]
    if case.command == "import":
        words = ["csv", "logs", "-o", "out"]
    if case.command == "campaign" and case.work.endswith((".campaign", ".rare")):
        words = [*words, "-o", "out"]
    if case.command == "steer":
        words = [*words, "--nmea", "udp://127.0.0.1:0"]
    found = given(case, [*extra, *words])
    usual = apart({name: one.default for name, one in USUAL[case.work].items()})
    for key, value in found.items():
        default = usual.get(key, inspect.Parameter.empty)
        if default is inspect.Parameter.empty or callable(value) or key in needed or key in ALWAYS:
            continue
        assert plain(value) == plain(default), key
