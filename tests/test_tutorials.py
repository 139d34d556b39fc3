"""The tutorials run as they are printed, and print what they say."""

from __future__ import annotations

import importlib.util
import math
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
BLOCK = re.compile(r"^```(sh|console|toml|python)\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMPILES_FOR_WINDOWS = shutil.which("x86_64-w64-mingw32-gcc") or importlib.util.find_spec("ziglang")
NAMED = re.compile(r"# (\S+\.(?:toml|py))\n")


@dataclass(frozen=True)
class Step:
    """A command with what it prints, or a file with what is in it."""

    command: str
    text: str
    file: str = ""


def steps(path: Path) -> list[Step]:
    """Files and commands of a tutorial, in order."""
    found: list[Step] = []
    for kind, body in BLOCK.findall(path.read_text(encoding="utf-8")):
        if kind in ("toml", "python"):
            name = NAMED.match(body)
            found += [Step("", body, name[1])] if name else []
            continue
        for line in body.splitlines():
            if kind == "sh" or line.startswith("$ "):
                found.append(Step(line.removeprefix("$ "), ""))
            else:
                found[-1] = Step(found[-1].command, found[-1].text + line + "\n")
    return found


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that looks like the root of the repository to whoever only reads."""
    for name in ("examples", "studies"):
        (tmp_path / name).symlink_to(ROOT / name, target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(step: Step) -> None:
    path = Path(step.file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(step.text, encoding="utf-8")


def numbers(line: str) -> list[float]:
    """Numbers of a line that stand alone; those that are zero but for rounding are left out."""
    found = [float(word) for word in re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?(?![\w.])", line)]
    return [value for value in found if value == 0 or abs(value) > 1e-6]


def words(line: str) -> str:
    return " ".join(re.findall(r"[A-Za-z_]{3,}", line))


@pytest.mark.long
@pytest.mark.parametrize("path", TUTORIALS, ids=lambda p: p.stem)
def test_they_print_what_they_say(path: Path, place: Path) -> None:
    """As printed, in a shell; numbers within a hundredth."""
    left_out: list[str] = []
    around = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for step in steps(path):
        if step.file:
            write(step)
            continue
        if "win64" in step.command and not COMPILES_FOR_WINDOWS:
            left_out.append(step.command)
            continue
        done = subprocess.run(step.command, shell=True, env=around, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (step.command, done.stderr)
        printed = done.stdout.splitlines()
        for line in step.text.splitlines():
            same = [one for one in printed if words(one).startswith(words(line))] if line != "..." else []
            wanted = numbers(line)
            assert line == "..." or any(
                all(math.isclose(a, b, rel_tol=0.01) for a, b in zip(numbers(one), wanted, strict=False))
                and len(numbers(one)) >= len(wanted) for one in same
            ), f"{step.command}: no line such as {line!r} in\n{done.stdout}"  # fmt: skip
    if left_out:
        pytest.skip(f"all but {'; '.join(left_out)}: no compiler for Windows (gcc-mingw-w64-x86-64, or ziglang)")


def test_every_tutorial_is_found() -> None:
    assert {path.stem for path in TUTORIALS} >= {"estimate", "fine-tuning", "blueboat"}
