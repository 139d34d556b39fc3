"""The long tier in parts that go on where they stopped, and a record of what ran when on which commit.

    python tests/long/parts.py [PART ...] [--list] [--any] [--workers N]

A part is a folder of tests/, a file of tests/long, or `top` for the files of tests/ itself; without one, all run.  A
test that passed runs again when what it tests has changed since: the package, the studies, the part's own files.  The
record is written after every test, so a run that is cut off loses the test it was in.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from seatrial.core.files import write_whole

ROOT = Path(__file__).parents[2]
RECORD = ROOT / "benchmarks" / "results" / "long.json"
READ = ("src", "studies", "examples", "docs/notebooks", "docs/tutorials", "pyproject.toml", "constraints.txt",
        "tests/golden", ":(glob)tests/*.py")  # fmt: skip
"""What a test of any part may depend on."""
Entry = Mapping[str, Any]


def part_of(node: str) -> str:
    """The part of a test, by its id."""
    _, folder, *rest = node.partition("::")[0].removesuffix(".py").split("/")
    return "top" if not rest else f"{folder}/{rest[0]}" if folder == "long" else folder


def where(part: str) -> list[str]:
    """What holds the tests of a part, as paths from the root."""
    if part == "top":
        return sorted(f"tests/{path.name}" for path in (ROOT / "tests").glob("test_*.py"))
    return [f"tests/{part}.py" if part.startswith("long/") else f"tests/{part}"]


def read(path: Path = RECORD) -> dict[str, dict[str, Any]]:
    """By test its outcome, seconds, commit and day; empty where there is no record."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def enter(news: Mapping[str, Entry], gone: Iterable[str] = (), path: Path = RECORD) -> None:
    """Put entries into the record and take others out, whole or not at all, while other parts do so too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = os.open(path.parent, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        kept = {name: entry for name, entry in {**read(path), **news}.items() if name not in set(gone)}
        lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(kept[name])}" for name in sorted(kept))
        write_whole(path, f"{{\n{lines}\n}}\n")
    finally:
        os.close(lock)


class Recorder:
    """Enters each test when it has ended."""

    def __init__(self, commit: str, path: Path = RECORD) -> None:
        self.commit, self.path, self.seen = commit, path, dict[str, dict[str, Any]]()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        entry = self.seen.setdefault(report.nodeid, {"outcome": "passed", "seconds": 0.0})
        entry["seconds"] += report.duration
        if report.failed:
            entry["outcome"] = "failed"
        elif report.skipped and entry["outcome"] == "passed":
            entry["outcome"] = "skipped"
            entry["why"] = report.longrepr[2] if isinstance(report.longrepr, tuple) else "expected to fail"
        if report.when not in ("setup", "call"):  # a worker that died reports no phase
            day = datetime.now(UTC).date().isoformat()
            entry |= {"seconds": round(entry["seconds"], 1), "commit": self.commit, "date": day}
            enter({report.nodeid: entry}, path=self.path)


def git(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)


@cache
def unchanged(commit: str, part: str) -> bool:
    """Whether nothing that the tests of a part read differs from what it was at a commit."""
    return git("diff", "--quiet", commit, "--", *READ, *where(part)).returncode == 0


def here(parts: Iterable[str]) -> str:
    """The commit, with a + where files of one of the parts differ from it."""
    clean = all(unchanged("HEAD", part) for part in parts)
    return git("rev-parse", "--short=12", "HEAD").stdout.strip() + "+" * (not clean)


def stands(entry: Entry | None, part: str, anyhow: bool = False) -> bool:
    """Whether a test need not run again: it passed, on what is there now."""
    return entry is not None and entry["outcome"] == "passed" and (anyhow or unchanged(entry["commit"], part))


def collected(paths: Sequence[str]) -> list[str]:
    """Ids of the long tests in files and folders."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-n0", "-m", "long", *paths]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        raise SystemExit(done.stdout + done.stderr)
    return [line for line in done.stdout.splitlines() if line.startswith("tests/") and "::" in line]


def run(nodes: Sequence[str], workers: int) -> None:
    """Run tests and enter what became of them; all at once, so that no worker waits at the end of a part."""
    command = [sys.executable, "-m", "pytest", "-q", "-n", str(workers), "--dist", "loadfile", "-p", "parts"]
    modules = os.pathsep.join(filter(None, [str(Path(__file__).parent), os.environ.get("PYTHONPATH")]))
    around = {**os.environ, "PYTHONPATH": modules, "SEATRIAL_LONG_COMMIT": here(map(part_of, nodes))}
    subprocess.run([*command, *nodes], cwd=ROOT, env=around, check=False)


def pytest_configure(config: pytest.Config) -> None:
    """As a plug-in of the runs above; the workers report to the process that started them, and it records."""
    if not hasattr(config, "workerinput") and "SEATRIAL_LONG_COMMIT" in os.environ:
        config.pluginmanager.register(Recorder(os.environ["SEATRIAL_LONG_COMMIT"]))


def table(parts: Mapping[str, Sequence[str]], record: Mapping[str, Entry]) -> str:
    """A line for each part: how many of its tests stand, what failed, and the minutes of one core."""
    lines = [f"{'part':32}{'tests':>6}{'stand':>7}{'failed':>7}{'skipped':>8}{'minutes':>9}"]
    for part, nodes in parts.items():
        told = [record[node] for node in nodes if node in record]
        by = [sum(entry["outcome"] == outcome for entry in told) for outcome in ("failed", "skipped")]
        standing = sum(stands(record.get(node), part) for node in nodes)
        spent = sum(entry["seconds"] for entry in told) / 60.0
        lines.append(f"{part:32}{len(nodes):6}{standing:7}{by[0]:7}{by[1]:8}{spent:9.1f}")
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="*", help="parts to run; all without one")
    parser.add_argument("--list", action="store_true", help="tell what stands, and run nothing")
    parser.add_argument("--any", action="store_true", help="let what passed on any commit stand")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args(arguments)
    nodes = collected([path for part in asked.part for path in where(part)] or ["tests"])
    parts = {part: [n for n in nodes if part_of(n) == part] for part in dict.fromkeys(map(part_of, nodes))}
    if unknown := sorted(set(asked.part) - set(parts)):
        raise SystemExit(f"no long tests in {', '.join(unknown)}; without a part, --list names them all")
    record = read()
    enter({}, [name for name in record if name not in nodes and (not asked.part or part_of(name) in parts)])
    left = [node for node in nodes if not stands(record.get(node), part_of(node), asked.any)]
    if left and not asked.list:
        run(left, asked.workers)
    record = read()
    sys.stdout.write(table(parts, record) + "\n")
    return int(any(record.get(node, {}).get("outcome") not in ("passed", "skipped") for node in nodes))


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
