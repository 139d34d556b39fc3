"""Mutated input of every kind that a command reads: never a traceback, never a hang, a refusal is one line.

The files are valid ones with bytes flipped, lines lost, numbers replaced by absurd ones and tables nested;
the command is the real one, run within this process under an alarm.  ``SEATRIAL_FUZZ`` sets how many mutations of
each kind are tried (12), ``SEATRIAL_FUZZ_SEED`` which (1).
"""

from __future__ import annotations

import io
import json
import math
import os
import random
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from fuzzed import MORE, SLOW

from seatrial.cli.app import main
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.environment.geojson import FOLDER as CHARTS
from seatrial.identify import FitError
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.twin.likely import Factors
from seatrial.ships.files import FOLDER, load
from seatrial.ships.writing import save
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate
from workbooks import voyage, write_workbook

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("SEATRIAL_DATA", ROOT / ".." / "shared" / "data"))
COUNT = int(os.environ.get("SEATRIAL_FUZZ", "12"))
SEED = int(os.environ.get("SEATRIAL_FUZZ_SEED", "1"))
LONGEST, WAITED = 10.0, 120.0
"""Seconds of processor time, and by the clock, after which a command counts as one that hangs."""
MEMORY, DISK = 500.0, 500e6
"""More that a command may take for a file of less than a megabyte: memory [MB], and what it writes [bytes]."""

ABSURD = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e999", "0", "-1", "-0.0", "9" * 400, "9" * 5000, "true", '""',
    '"x"', "2024-99-99", "1_000", "\uff11\uff12", "[]", "{}", "[[[[1]]]]", "[" * 300 + "]" * 300, "*a", "&a [*a]",
    "!!python/name:os", "'\\u001b[31m'", "1:45", "0x10", "..", "/etc/passwd", "$\\frac{1}{$",
)  # fmt: skip
NUMBER = __import__("re").compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def mutated(data: bytes, rng: random.Random) -> bytes:
    """One to three changes of a file."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        data = rng.choice((_number, _number, _bytes, _line, _cut, _twice, _swap))(data, rng)
    return data


def _number(data: bytes, rng: random.Random) -> bytes:
    found = list(NUMBER.finditer(data))
    if not found:
        return _bytes(data, rng)
    at = rng.choice(found)
    return data[: at.start()] + rng.choice(ABSURD).encode() + data[at.end() :]


def _bytes(data: bytes, rng: random.Random) -> bytes:
    k = rng.randrange(len(data) + 1)
    return data[:k] + rng.randbytes(rng.choice((1, 1, 4))) + data[k + rng.choice((0, 1)) :]


def _line(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if lines:
        del lines[rng.randrange(len(lines))]
    return b"".join(lines)


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _twice(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    k = rng.randrange(len(lines)) if lines else 0
    return b"".join([*lines[: k + 1], *lines[k:]])


def _swap(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    rng.shuffle(lines)
    return b"".join(lines)


@contextmanager
def no_longer_than(seconds: float, waited: float) -> Iterator[None]:
    """Processor time of this process, and time by the clock [s]."""

    def ring(*_: object) -> None:
        raise TimeoutError

    timers = ((signal.SIGALRM, signal.ITIMER_REAL, waited), (signal.SIGPROF, signal.ITIMER_PROF, seconds))
    held = [signal.signal(number, ring) for number, _, _ in timers]
    for _, timer, limit in timers:
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for (number, timer, _), before in zip(timers, held, strict=True):
            signal.setitimer(timer, 0.0)
            signal.signal(number, before)


def used(peak: bool) -> float:
    """Memory of this process, now or at most since `forgotten` [MB]."""
    name = "VmHWM:" if peak else "VmRSS:"
    said = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(name))
    return int(said.split()[1]) / 1024.0


def forgotten() -> float:
    """Begin to watch the most memory anew; what is used now [MB]."""
    Path("/proc/self/clear_refs").write_text("5")
    return used(peak=False)


def size(folder: Path) -> int:
    return sum(one.stat().st_size for one in folder.rglob("*") if one.is_file())


def run(arguments: list[str], quick: bool = True) -> tuple[int, str]:
    said, out = io.StringIO(), io.StringIO()
    with no_longer_than(LONGEST if quick else WAITED, WAITED), redirect_stderr(said), redirect_stdout(out):
        status = main(arguments)
    return status, said.getvalue()


Kind = tuple[Callable[[Path], Path], Callable[[Path, Path], list[str]]]


def _trial(folder: Path, suffix: str = ".csv") -> Path:
    ship = load("kvlcc2_l7")
    _, n_P = approach(ship)
    run = simulate(ship, Zigzag(n_P, 0.17, 0.17), duration=60.0, every=25, name="log")
    write_trial(run, folder / f"log{suffix}")
    return folder / f"log{suffix}"


def _parquet(folder: Path) -> Path:
    return _trial(folder, ".parquet")


def _sidecar(folder: Path) -> Path:
    return _trial(folder).with_suffix(".yaml")


def _foreign(folder: Path) -> Path:
    t = np.arange(40) * 0.5
    rows = [f"{a:.1f},{math.degrees(0.01 * a):.3f},{0.5 * a:.2f},0.1,1.0,0.0" for a in t]
    (folder / "voyage.csv").write_text("\n".join(["Time,HDG,X,Y,U,V", *rows]) + "\n")
    (folder / "map.toml").write_text(
        'schema = "seatrial-mapping/1"\ntime = { column = "Time", unit = "s" }\nL_pp = 7.0\n'
        '[channels.psi]\ncolumn = "HDG"\nunit = "deg"\noffset = 3.0\n[channels.x]\ncolumn = "X"\nunit = "m"\n'
        '[channels.y]\ncolumn = "Y"\nunit = "m"\n[channels.u]\ncolumn = "U"\nunit = "m/s"\n'
        '[channels.v_m]\ncolumn = "V"\nunit = "m/s"\n'
    )
    return folder / "voyage.csv"


def _mapping(folder: Path) -> Path:
    return _foreign(folder).with_name("map.toml")


def _table(folder: Path) -> Path:
    """The foreign log as Parquet."""
    pl.read_csv(_foreign(folder)).write_parquet(folder / "voyage.parquet")
    return folder / "voyage.parquet"


def _pieces(folder: Path) -> Path:
    """A mapping whose files are named by a pattern."""
    rows = _foreign(folder).read_text().splitlines(keepends=True)
    for name, some in (("run7_a", rows[1:21]), ("run7_b", rows[21:])):
        (folder / "pieces").mkdir(exist_ok=True)
        (folder / "pieces" / f"{name}.csv").write_text(rows[0] + "".join(some))
    text = (folder / "map.toml").read_text().replace("[channels.psi]", "[files]\njoin = \"rows\"\n[channels.psi]", 1)
    (folder / "map.toml").write_text(text.replace("[files]\n", '[files]\npattern = "{trial}_*.csv"\n'))
    return folder / "map.toml"


def _steps(folder: Path) -> Path:
    """What a check of a log with faults of several kinds writes."""
    log = read_trial(_trial(folder))
    lost = np.arange(len(log)) % 17 == 3
    rows = np.delete(np.arange(len(log)), [20, 21, 40])
    write_trial(log.having(x=np.where(lost, 0.0, log["x"] + 5e6), r=-log["r"]).rows(rows), folder / "log.csv")
    status, said = run(["check", str(folder / "log.csv"), "--remedy", str(folder / "steps.toml")])
    assert status in (0, 1), said
    return folder / "steps.toml"


def _chart(folder: Path) -> Path:
    return Path(shutil.copy(CHARTS / "tanker_quay.geojson", folder / "chart.geojson"))


def _sheet(folder: Path) -> Path:
    rows = [one.split(",") for one in _foreign(folder).read_text().splitlines()]
    (folder / "table").mkdir()
    book = write_workbook(folder / "Asw1.xlsx", voyage(rows=60))
    heads = [str(one) for one in pl.read_excel(book, engine="calamine").columns[: len(rows[0])]]
    names = dict(zip(rows[0], heads, strict=True))
    text = (folder / "map.toml").read_text()
    for old, new in names.items():
        text = text.replace(f'"{old}"', json.dumps(new))
    (folder / "map.toml").write_text(text)
    return book


def _sentences(folder: Path) -> Path:
    status, said = run(["steer", "kvlcc2", "--nmea", "udp://127.0.0.1:0", "--factor", "inf", "--duration", "20",
                        "--place", "35,139", "--log", str(folder / "log.nmea")])  # fmt: skip
    assert status == 0, said
    return folder / "log.nmea"


def _robot(to: str) -> Callable[[Path], Path]:
    def made(folder: Path) -> Path:
        trial = _trial(folder)
        status, said = run(["convert", str(trial), "--to", to, "-o", str(folder / "robot")])
        assert status == 0, said
        files = sorted(p for p in (folder / "robot").rglob("*") if p.is_file())
        return next((p for p in files if p.suffix in (".mcap", ".db3")), files[0])

    return made


def _measured(pattern: str) -> Callable[[Path], Path]:
    def made(folder: Path) -> Path:
        found = sorted(DATA.glob(pattern))
        if not found:
            pytest.skip(f"no {pattern} in {DATA}; docs/data.md says where it can be had")
        data = found[0].read_bytes().splitlines(keepends=True)
        (folder / found[0].name).write_bytes(b"".join(data[:400]))
        return folder / found[0].name

    return made


def _workbook(folder: Path) -> Path:
    return write_workbook(folder / "Asw1.xlsx", voyage(rows=60))


def _ship(folder: Path) -> Path:
    return Path(shutil.copy(FOLDER / "kvlcc2_l7.toml", folder / "ship.toml"))


def _study(folder: Path) -> Path:
    _trial(folder)
    (folder / "study.toml").write_text(
        'schema = "seatrial-study/1"\nship = "kvlcc2_l7"\ntitle = "A fit"\n[data]\nroot = "."\ntrain = ["log.csv"]\n'
        '[free]\n"hull.Y_v" = { ratio = 0.5 }\n"hull.N_*" = { prior = 0.3 }\n[loss]\ncorrelation = 5.0\n'
        'sigma = { x = 1.0, psi = 0.1 }\n[nuisance]\ncurrent = 0.1\n[estimator]\ntype = "shooting:Trajectory"\n'
        "window = 30.0\n[report]\nrestart = 30.0\n"
    )
    return folder / "study.toml"


def _series(folder: Path) -> Path:
    log = _trial(folder)
    (folder / "other.csv").write_text(log.read_text().replace("0.", "0.0"))
    shutil.copy(log.with_suffix(".yaml"), folder / "other.yaml")
    (folder / "table.toml").write_text(
        'schema = "seatrial-series/1"\ntitle = "Two fits"\n[data]\nroot = "."\n[data.test]\n"the other" = "other"\n'
        '[fits.one]\nship = "kvlcc2_l7"\ntrain = ["log.csv"]\nseeds = [0]\n[fits.one.free]\n'
        '"hull.Y_v" = { ratio = 0.5 }\n'
        '[fits.one.estimator]\ntype = "shooting:Trajectory"\nwindow = 30.0\n'
    )
    return folder / "table.toml"


def _particulars(folder: Path) -> Path:
    found = sorted((ROOT / "examples" / "particulars").glob("*.toml"))[0]
    return Path(shutil.copy(found, folder / "particulars.toml"))


def _pull(folder: Path) -> Path:
    rows = [f"{n},{1.5 * n * abs(n)},{1.4 * n * abs(n)}" for n in np.linspace(-5, 5, 21)]
    (folder / "pull.csv").write_text("n [1/s],T_1 [N],T_2 [N]\n" + "\n".join(rows) + "\n")
    return folder / "pull.csv"


def _servo(folder: Path) -> Path:
    t = np.arange(0.0, 60.0, 0.5)
    order = np.where(t % 20 < 10, 0.3, -0.2)
    actual = np.concatenate([[order[0]], order[:-1]])
    rows = [f"{a},{b},{c}" for a, b, c in zip(t, order, actual, strict=True)]
    (folder / "servo.csv").write_text("t [s],alpha_1_cmd [rad],alpha_1 [rad]\n" + "\n".join(rows) + "\n")
    (folder / "servo.yaml").write_text("schema: manoeuvre-trial/1\nship: tug\n")
    return folder / "servo.csv"


def _fit(folder: Path) -> Path:
    _trial(folder)
    save(load("kvlcc2_l7"), folder / "model.toml", {"study": "s", "trained_on": ["log"], "ship": "kvlcc2_l7"})
    scale = dict.fromkeys(("x", "y", "psi", "u", "v_m", "r"), 1.0)
    found = {"schema": "seatrial-fit/1", "scale": scale, "parameters": {}, "verdicts": []}
    (folder / "fit.json").write_text(json.dumps(found))
    return folder / "fit.json"


def _options(folder: Path) -> Path:
    text = "--wind 5,90 --current 0.5,90 --duration 20 --rps 1.5 --speed 7 --dt 0.5\n"
    (folder / "options").write_text(text)
    return folder / "options"


def _imported(kind: str, *more: str) -> Callable[[Path, Path], list[str]]:
    return lambda file, out: ["import", kind, str(file), "-o", str(out), *(m.format(file.parent) for m in more)]


def _split(file: Path, _: Path) -> list[str]:
    words = file.read_bytes().decode(errors="replace").replace("\0", " ").split()
    harmless = [word for word in words if not word.startswith(("-o", "--o", "--trust"))]
    return ["simulate", "kvlcc2", "straight", "--json", *harmless[:20]]


REFUSED = ("sheet", "coefficients", "coefficients, netCDF 3")
"""Kinds whose file is read whole and then refused for what stands in it."""

KINDS: dict[str, Kind] = {
    "guess": (_foreign, lambda file, out: ["import", "--guess", str(file), "-o", str(out.with_suffix(".toml"))]),
    "guess, parquet": (_table, lambda file, out: ["import", "--guess", str(file), "-o", str(out.with_suffix(".toml"))]),
    "guess, workbook": (_workbook, lambda file, out: ["import", "--guess", str(file), "-o",
                                                      str(out.with_suffix(".toml"))]),
    "table of parquet": (_table, _imported("csv", "--mapping", "{}/map.toml")),
    "sheet": (_sheet, _imported("csv", "--mapping", "{}/map.toml")),
    "pieces": (_pieces, lambda file, out: ["import", "csv", str(file.with_name("pieces")), "-o", str(out),
                                           "--mapping", str(file)]),
    "steps": (_steps, lambda file, out: ["mend", str(file.with_name("log.csv")), "--by", str(file), "-o", str(out)]),
    "chart": (_chart, lambda file, out: ["harbour", "berthing", "--chart", str(file), "--duration", "1"]),
    "trial": (_trial, lambda file, out: ["check", str(file)]),
    "parquet": (_parquet, lambda file, out: ["check", str(file)]),
    "sidecar": (_sidecar, lambda file, out: ["check", str(file.with_suffix(".csv"))]),
    "csv": (_foreign, _imported("csv", "--mapping", "{}/map.toml")),
    "mapping": (_mapping, lambda file, out: ["import", "csv", str(file.with_name("voyage.csv")), "-o", str(out),
                                             "--mapping", str(file)]),
    "nmea": (_sentences, _imported("nmea")),
    "mcap": (_robot("mcap"), _imported("mcap")),
    "rosbag2": (_robot("rosbag2"), lambda file, out: ["import", "rosbag2", str(file.parent), "-o", str(out)]),
    "simman": (_measured("kvlcc2_hsva_simman2008/raw/*.dat"), _imported("simman")),
    "frt-esso": (_measured("esso_osaka_frt/data/turning/*.csv"), _imported("frt-esso")),
    "workbook": (_workbook, _imported("usv-asw")),
    "ship": (_ship, lambda file, out: ["show", str(file), "--json"]),
    "ship, simulated": (_ship, lambda file, out: ["simulate", str(file), "straight", "--duration", "5", "--json"]),
    "study": (_study, lambda file, out: ["identify", str(file), "-o", str(out)]),
    "series": (_series, lambda file, out: ["identify", str(file), "-o", str(out)]),
    "particulars": (_particulars, lambda file, out: ["estimate", str(file), "-o", str(file.with_name("made.toml"))]),
    "thrust map": (_pull, lambda file, out: ["thrust-map", str(file), "--json"]),
    "servo": (_servo, lambda file, out: ["servo", str(file), "--json"]),
    "fit": (_fit, lambda file, out: ["validate", str(file.with_name("model.toml")), str(file.with_name("log.csv")),
                                     "--scale", str(file.with_name("model.toml")), "--json"]),
    "predicted": (_trial, lambda file, out: ["predict", "kvlcc2_l7", str(file), "-o", str(out), "--restart", "20"]),
    "options": (_options, _split),
    **MORE,
}  # fmt: skip


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("kind", KINDS)
def test_mutations_end_in_a_result_or_in_one_line(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stub(*_: Any, **__: Any) -> Any:  # what is read is under test, not the search
        raise FitError("not searched here")

    monkeypatch.setattr(Trajectory, "fit", stub)
    monkeypatch.setattr("seatrial.workflow.harbour.simulate", stub)
    monkeypatch.setattr("seatrial.workflow.live.twin.likeliest", lambda ship, settings, *_: (settings, Factors()))
    make, command = KINDS[kind]
    (tmp_path / "given").mkdir()
    file, rng = make(tmp_path / "given"), random.Random(f"{kind} {SEED}")
    whole, wrong = file.read_bytes(), []
    for k in range(COUNT if kind not in SLOW else max(4, COUNT // 10)):
        out = tmp_path / f"out{k}"
        data = mutated(whole, rng) if k else whole
        file.write_bytes(data)
        arguments, before, written = command(file, out), forgotten(), size(tmp_path)
        try:
            status, said = run(arguments, quick=kind not in SLOW and k > 0)
        except TimeoutError:
            wrong.append(f"{k}: over {LONGEST} s of processor time, or {WAITED} s")
            continue
        except Exception as error:
            wrong.append(f"{k}: {type(error).__name__}: {error}")
            continue
        finally:
            if k and (taken := used(peak=True) - before) > MEMORY:  # the first loads libraries
                wrong.append(f"{k}: {taken:.0f} MB of memory")
            if (taken := size(tmp_path) - written) > DISK:
                wrong.append(f"{k}: writes {taken} bytes")
            (tmp_path / "last").write_bytes(data)
            shutil.rmtree(out, ignore_errors=True)
        errors = [line for line in said.splitlines() if not line.startswith(("warning:", "note:", "wrote"))]
        if status not in (0, 1, 2) or "Traceback" in said or (status == 2 and len(errors) != 1):
            wrong.append(f"{k}: exit {status}: {said[-400:]!r}")
        if not k and status == 2 and kind not in REFUSED:
            wrong.append(f"the file itself is refused: {said}")
        if wrong and os.environ.get("SEATRIAL_FUZZ_KEEP"):
            (Path(os.environ["SEATRIAL_FUZZ_KEEP"]) / f"{kind}-{k}{file.suffix}").write_bytes(data)
    assert not wrong, "\n".join(wrong[:10])
