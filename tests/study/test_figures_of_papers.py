"""Figures of the studies' own reports, drawn from short trials: a page of a paper takes minutes to come to them."""

from __future__ import annotations

import ast
import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import seatrial as st
from seatrial.report.canvas.panels import Axes, Figure
from seatrial.study.study import read_study

REPORTS = Path(__file__).parents[2] / "studies" / "reports"
KNOWN = {*dir(Axes), *vars(Axes(SimpleNamespace())), *dir(Figure), "ravel", "T", "flat"}  # type: ignore[arg-type]


def panels_of(function: ast.FunctionDef) -> set[str]:
    """Names that a function binds to panels of a canvas."""
    found: set[str] = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            called = ast.unparse(node.value.func).rpartition(".")[2]
            if called in ("canvas", "panels"):
                found |= {one.id for target in node.targets for one in ast.walk(target) if isinstance(one, ast.Name)}
    for node in ast.walk(function):  # those of a loop over them
        if isinstance(node, ast.For) and found & {one.id for one in ast.walk(node.iter) if isinstance(one, ast.Name)}:
            first = node.target.elts[0] if isinstance(node.target, ast.Tuple) else node.target
            found |= {one.id for one in ast.walk(first) if isinstance(one, ast.Name)} if "axes" in ast.unparse(
                node.iter) else set()  # fmt: skip
    return found


@pytest.mark.parametrize("path", sorted(REPORTS.glob("*.py")), ids=lambda path: path.stem)
def test_reports_ask_of_the_canvas_what_it_has(path: Path) -> None:
    wrong: list[str] = []
    for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(function, ast.FunctionDef):
            continue
        names = panels_of(function)
        for node in ast.walk(function):
            if isinstance(node, ast.Attribute):
                root = node.value.value if isinstance(node.value, ast.Subscript) else node.value
                if isinstance(root, ast.Name) and root.id in names and node.attr not in KNOWN:
                    wrong.append(f"{path.name}:{node.lineno}: {ast.unparse(node)}")
    assert not wrong, "\n".join(wrong)


@pytest.fixture(scope="module")
def tug() -> Any:
    study = read_study(REPORTS.parent / "you2023.toml")
    sails = dict(list(study.virtual.sails.items())[:2])
    trials = replace(study.virtual, sails=sails, duration=12.0).run()
    return SimpleNamespace(study=study, ship=study.virtual.ship, trials=tuple(trials))


@pytest.fixture(scope="module")
def reports() -> Any:
    sys.path.insert(0, str(REPORTS))
    try:
        yield SimpleNamespace(**{name: importlib.import_module(name)
                                 for name in ("you2023", "you2023_paper", "you2023_validation")})  # fmt: skip
    finally:
        sys.path.remove(str(REPORTS))


def drawn(svg: str, *words: str) -> None:
    assert svg.startswith("<svg")
    assert "nan" not in svg
    for one in words:
        assert one in svg, one


@pytest.mark.slow
def test_figures_of_you2023_are_drawn(tug: Any, reports: Any) -> None:
    who = tuple(st.rivals_page.STYLES)[:2]
    names = dict(zip(who, ("22 parameters", "6 parameters"), strict=True))
    scores = {one: SimpleNamespace(runs={str(k): dict.fromkeys(reports.you2023.AXES, 0.1 * (k + 1)) for k in range(4)})
              for one in who}  # fmt: skip
    drawn(reports.you2023.runs(scores, names), "22 parameters", "held-out trial")
    runs = {one: st.replay(tug.ship, tug.trials[0]) for one in who}
    drawn(reports.you2023.motion(tug.trials[0], runs, names), "measured", "time t [s]")
    drawn(reports.you2023_validation.inputs(tug.ship, tug.trials), "alpha_1", "N [N m]", "as ordered")
    steps = {one.name: st.rivals.one_step_states(tug.ship, [one])[0] for one in tug.trials}
    drawn(reports.you2023_validation.tracks(tug.ship, tug.trials, steps), "whole run", "north x [m]")
    drawn(reports.you2023_validation.restarted(tug.ship, tug.trials[0]), "1 steps", "time t [s]")
    curves = {name: [one.stack("u", "v_m", "r") for one in tug.trials] for name in reports.you2023_paper._LINES}
    drawn(reports.you2023_paper.sequence(tug.trials, curves), "measured")


def test_a_step_holds_each_value_until_the_next() -> None:
    figure, (ax,) = st.figures.canvas(1)
    ax.step(np.array([0.0, 1.0, 3.0]), np.array([5.0, 7.0, 2.0]))
    (line,) = ax.lines
    assert line.x.tolist() == [0.0, 1.0, 1.0, 3.0, 3.0]
    assert line.y.tolist() == [5.0, 5.0, 7.0, 7.0, 2.0]
    assert st.figures.svg(figure, "orders").startswith("<svg")
