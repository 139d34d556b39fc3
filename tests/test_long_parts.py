"""The record of the long tier: what ran on which commit stands until what it tests changes."""

from __future__ import annotations

import importlib.util
import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
_SPEC: Any = importlib.util.spec_from_file_location("long_parts", ROOT / "tests" / "long" / "parts.py")
parts: Any = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(parts)


@pytest.mark.parametrize(("node", "part"), [
    ("tests/test_notebooks.py::test_a", "top"), ("tests/garden/test_fleet.py::test_a[b/c.py]", "garden"),
    ("tests/realtime/bridge/test_page.py::test_a", "realtime"), ("tests/long/test_kill.py::test_a", "long/test_kill"),
])  # fmt: skip
def test_every_test_is_in_one_part_that_runs_its_file(node: str, part: str) -> None:
    assert parts.part_of(node) == part
    assert any(f"{node.partition('::')[0]}/".startswith(f"{path}/") for path in parts.where(part))


def reported(recorder: Any, node: str, *phases: tuple[str, str]) -> None:
    for when, outcome in phases:
        why = ("file", 1, "Skipped: no compiler") if outcome == "skipped" else None
        recorder.pytest_runtest_logreport(
            pytest.TestReport(node, ("file", 1, "name"), {}, outcome, why, when, duration=1.5)  # type: ignore[arg-type]
        )


def test_a_test_is_entered_when_it_has_ended(tmp_path: Path) -> None:
    """One of several phases that failed is a failure, whichever it was; one that has not ended is not entered."""
    path = tmp_path / "results" / "long.json"
    recorder = parts.Recorder("c0", path)
    well = (("setup", "passed"), ("call", "passed"), ("teardown", "passed"))
    reported(recorder, "good", *well)
    reported(recorder, "bad", ("setup", "passed"), ("call", "failed"), ("teardown", "passed"))
    reported(recorder, "unmade", ("setup", "failed"), ("teardown", "passed"))
    reported(recorder, "untidy", ("setup", "passed"), ("call", "passed"), ("teardown", "failed"))
    reported(recorder, "left out", ("setup", "skipped"), ("teardown", "passed"))
    reported(recorder, "cut off", ("setup", "passed"), ("call", "passed"))
    reported(recorder, "died", ("???", "failed"))
    found = parts.read(path)
    assert {name: entry["outcome"] for name, entry in found.items()} == {
        "good": "passed", "bad": "failed", "unmade": "failed", "untidy": "failed", "left out": "skipped",
        "died": "failed"}  # fmt: skip
    assert (found["good"]["seconds"], found["good"]["commit"]) == (4.5, "c0")
    assert found["left out"]["why"] == "Skipped: no compiler"


def test_what_others_entered_meanwhile_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "long.json"
    parts.enter({"a": {"outcome": "passed"}, "b": {"outcome": "failed"}}, path=path)
    parts.enter({"c": {"outcome": "passed"}}, gone=["b"], path=path)
    parts.enter({"a": {"outcome": "failed"}}, path=path)
    assert json.loads(path.read_text()) == {"a": {"outcome": "failed"}, "c": {"outcome": "passed"}}
    assert [file.name for file in tmp_path.iterdir()] == ["long.json"]


@pytest.mark.slow
def test_what_passed_stands_until_its_sources_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another part's tests and a page of the docs change nothing; the package, committed or not, does."""

    def git(*arguments: str) -> str:
        command = ["git", "-c", "user.name=a", "-c", "user.email=a@b.c", *arguments]
        return subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout

    def write(name: str, text: str) -> None:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)

    def standing(part: str, entry: dict[str, str]) -> bool:
        parts.unchanged.cache_clear()
        return parts.stands(entry, part)

    monkeypatch.setattr(parts, "ROOT", tmp_path)
    files = ("src/a.py", "tests/core/test_a.py", "tests/data/test_b.py", "docs/page.md", "tests/conftest.py",
             "tests/long/test_kill.py", "tests/long/test_soak.py")  # fmt: skip
    for name in files:
        write(name, "1")
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "one")
    entry = {"outcome": "passed", "commit": git("rev-parse", "HEAD").strip()}
    assert standing("core", entry)
    assert not standing("core", {**entry, "outcome": "failed"})
    assert not standing("core", {**entry, "outcome": "skipped"})
    assert not standing("core", {**entry, "commit": entry["commit"] + "+"})
    assert not standing("core", {**entry, "commit": "0" * 40})
    assert not parts.stands(None, "core", anyhow=True)
    write("docs/page.md", "2")
    write("tests/data/test_b.py", "2")
    write("tests/long/test_kill.py", "2")
    git("commit", "-q", "-a", "-m", "two")
    assert standing("core", entry)
    assert standing("long/test_soak", entry)
    assert not standing("data", entry)
    assert not standing("long/test_kill", entry)
    write("src/a.py", "2")
    assert not standing("core", entry)
    assert parts.stands(entry, "core", anyhow=True)
    parts.unchanged.cache_clear()
    assert parts.here(["core", "data"]).endswith("+")
    git("commit", "-q", "-a", "-m", "three")
    parts.unchanged.cache_clear()
    assert not standing("core", entry)
    assert git("rev-parse", "HEAD").startswith(parts.here(["core", "data"]))
    write("src/a.py", "1")
    assert standing("core", entry)
