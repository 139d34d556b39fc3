"""What the scripts here share: minima of repetitions, a table, a file of results."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from seatrial.bench.timing import best, control_loop, machine

__all__ = ["best", "control_loop", "machine", "publish"]

HERE = Path(__file__).parent
TABLE = HERE.parent / "docs" / "benchmarks.md"
HEAD = """# Benchmarks

`seatrial bench` times this package beside other programs that are installed, and prints the ratios; it needs only the
installed package. `seatrial bench --list` lists the programs and how to install missing ones, `-o DIR` writes
`DIR/bench.json`. A fixed Python loop is timed before, between and after: if its time varies, the machine was busy with
other work.

`make bench` writes the tables below from scripts of the repository, one script for each claim. Times are the shortest
of repeated runs."""
SCRIPTS = ("engine", "contact", "gpu", "peers", "campaign", "kills", "tuning", "export", "shooting", "networks",
           "training", "realtime", "envs", "cold_start", "import_table",
           "import_instruments", "scaling")  # fmt: skip


def publish(name: str, rows: list[dict[str, Any]], kept: bool = False) -> None:
    """Write results/<name>.json and the table of docs/benchmarks.md; print the rows.

    Args:
        kept: whether earlier rows that were not measured now stay.
    """
    path, all_rows = HERE / "results" / f"{name}.json", rows
    if kept and path.exists():
        now = {row["what"]: row for row in rows}
        all_rows = [now.pop(row["what"], row) for row in json.loads(path.read_text())["rows"]] + list(now.values())
    result = {"machine": machine(), "control_loop_ms": control_loop(), "rows": all_rows}
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(result, indent=1) + "\n")
    for row in rows:
        print(f"{row['what']}: {row['value']:.4g} {row['unit']} (bar {row['bar']})")
    TABLE.write_text(table(TABLE.read_text() if TABLE.exists() else ""))


def table(before: str) -> str:
    """docs/benchmarks.md from the results; a section that was written by hand is kept, at the end."""
    lines = HEAD.splitlines()
    for script in SCRIPTS:
        path = HERE / "results" / f"{script}.json"
        if not path.exists():
            continue
        of = json.loads(path.read_text())
        lines += ["", f"## benchmarks/{script}.py", "",
                  f"{of['machine']}; Python control loop {of['control_loop_ms']:.1f} ms.", "",
                  "| what | measured | bar |", "|---|---|---|"]  # fmt: skip
        lines += [f"| {r['what']} | {r['value']:.4g} {r['unit']} | {r['bar']} |" for r in of["rows"]]
    made = {f"benchmarks/{script}.py" for script in SCRIPTS}
    kept = [part.rstrip() for part in before.split("\n## ")[1:] if part.partition("\n")[0] not in made]
    return "\n".join(lines) + "\n" + "".join(f"\n## {part}\n" for part in kept)
