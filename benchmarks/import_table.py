"""Import of a large table: 10^6 rows of 20 channels as CSV, its time and its memory beside the size of the numbers.

    python benchmarks/import_table.py [ROWS]

Peak memory is that of a process of its own, less that of one that only imports the package and its reader of tables.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from timing import publish

CHANNELS = ("x", "y", "psi", "u", "v_m", "r", "n_P", "delta", "U_A", "gamma_A", "depth", "phi",
            *(f"strain_{k}" for k in range(1, 9)))  # fmt: skip
UNITS = {"x": "m", "y": "m", "psi": "deg", "u": "kn", "v_m": "kn", "r": "deg/s", "n_P": "rpm", "delta": "deg",
         "U_A": "m/s", "gamma_A": "deg", "depth": "m", "phi": "deg"}  # fmt: skip


def write_log(folder: Path, rows: int) -> None:
    """A log of many rows as an instrument writes it, and its mapping."""
    import polars as pl

    t = np.arange(rows)
    noise = np.random.default_rng(1)
    columns = {"Time": t / 100.0} | {
        name: np.round(10.0 * np.sin(0.001 * k * t) + noise.normal(size=rows), 4) for k, name in enumerate(CHANNELS, 1)
    }
    pl.DataFrame(columns).write_csv(folder / "log.csv")
    lines = ['schema = "seatrial-mapping/1"', 'time = { column = "Time", unit = "s" }']
    for name in CHANNELS:
        lines += [f"[channels.{name}]", f'column = "{name}"', f'unit = "{UNITS.get(name, "-")}"']
    (folder / "mapping.toml").write_text("\n".join(lines))


def child(folder: Path, work: bool) -> None:
    """Import the log, or only what the import needs; print seconds, peak memory [MB] and seconds of processor time."""
    import polars  # noqa: F401

    from seatrial.data.formats import formats
    from seatrial.data.importing import import_log

    formats()
    spent = resource.getrusage(resource.RUSAGE_SELF)
    before, start = spent.ru_utime + spent.ru_stime, time.perf_counter()
    if work:
        import_log("csv", folder / "log.csv", folder / "out", folder / "mapping.toml")
    wall, used = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps([wall, used.ru_maxrss / 1024.0, used.ru_utime + used.ru_stime - before]))


def main() -> None:
    """Measure and print."""
    rows = int(next((a for a in sys.argv[1:] if a.isdigit()), "1000000"))
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        write_log(folder, rows)
        runs = [
            json.loads(subprocess.run([sys.executable, __file__, "--child", made, *flag], check=True, text=True,
                                      capture_output=True).stdout)
            for flag in ([], ["--work"], ["--work"], ["--work"])
        ]  # fmt: skip
        size = (folder / "log.csv").stat().st_size / 2**20
    table = rows * (len(CHANNELS) + 1) * 8 / 2**20
    what = f"import of a CSV of {rows} rows and {len(CHANNELS)} channels ({size:.0f} MB)"
    publish("import_table", [
        {"what": what, "value": min(one[0] for one in runs[1:]), "unit": "s", "bar": "at most 6"},
        {"what": "its processor time, all threads", "value": min(one[2] for one in runs[1:]), "unit": "s", "bar": "-"},
        {"what": f"its peak memory over the {table:.0f} MB of its numbers", "value": (runs[1][1] - runs[0][1]) / table,
         "unit": "-", "bar": "at most 4"},
    ])  # fmt: skip


if __name__ == "__main__":
    if "--child" in sys.argv:
        child(Path(sys.argv[sys.argv.index("--child") + 1]), "--work" in sys.argv)
    else:
        main()
