"""Files of arrays by writers of our own: every form comes back to the last bit, by the one mapping."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mat_by_hand import Opaque, Run, Version5, version73

from seatrial.data import DataError, Trial
from seatrial.data.guess import guess
from seatrial.data.mapping.reading import read
from seatrial.data.mapping.schema import Channel, Clock, Mapping

FORMATS = ("v5", "v7", "v5 big", "v7.3", "npz", "npy")


@dataclass
class Drawn:
    """A file of arrays by chance, and the trials that are in it.

    Attributes:
        tree: as it is written.
        trials: columns of each, t among them, by the end of its name.
        sheet: of the mapping.
    """

    tree: dict[str, Any]
    trials: dict[str, dict[str, np.ndarray]]
    sheet: str | None = None
    hand: Any = field(default=None, repr=False)


def table(hand: np.random.Generator, count: int) -> dict[str, np.ndarray]:
    """A time and one to five columns of any kind of number, NaN among those of floats."""
    step = 10.0 ** hand.uniform(-3, 1)
    columns = {"t": float(hand.uniform(-10, 1e4)) + step * np.cumsum(0.5 + hand.random(count))}
    for k in range(int(hand.integers(1, 6))):
        kind = str(hand.choice(["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "whole"]))
        if kind == "whole":
            columns[f"c{k}"] = np.round(hand.normal(size=count) * 10.0 ** hand.integers(1, 8))
        elif kind[0] == "f":
            values = (hand.normal(size=count) * 10.0 ** hand.integers(-8, 8)).astype(kind)
            columns[f"c{k}"] = np.where(hand.random(count) < 0.1, np.nan, values).astype(kind)
        else:
            top = np.iinfo(kind)
            columns[f"c{k}"] = hand.integers(top.min, top.max, size=count, endpoint=True, dtype=kind)
    return columns


def turned(hand: np.random.Generator, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns as rows or columns of a matrix."""
    return {name: one.reshape((-1, 1) if hand.random() < 0.5 else (1, -1)) for name, one in columns.items()}


def variables(hand: np.random.Generator) -> Drawn:
    columns = table(hand, int(hand.integers(8, 60)))
    short = {"L_pp": np.array([[176.0]]), "x_R": hand.normal(size=(1, 3)), "title": "a trial"}
    return Drawn({**short, **turned(hand, columns)}, {"": columns})


def matrix(hand: np.random.Generator) -> Drawn:
    columns = {name: one.astype(float) for name, one in table(hand, int(hand.integers(8, 60))).items()}
    whole = np.stack(list(columns.values()), axis=1)
    return Drawn({"data": whole if hand.random() < 0.5 else whole.T, "names": list(columns)}, {"": columns})


def structure(hand: np.random.Generator) -> Drawn:
    columns = table(hand, int(hand.integers(8, 60)))
    inner = turned(hand, columns)
    first = dict(list(inner.items())[:1])
    deep = {"log": first | {"gps": dict(list(inner.items())[1:])}} if hand.random() < 0.5 else {"log": inner}
    return Drawn({"about": "x", **deep}, {"": columns})


def structures(hand: np.random.Generator) -> Drawn:
    first = table(hand, 10)
    kinds = {name: one.dtype for name, one in first.items()}
    trials = {}
    for k in range(int(hand.integers(2, 5))):
        count = int(hand.integers(8, 40))
        step = np.cumsum(0.5 + hand.random(count))
        trials[f"zz{k}"] = {name: step if name == "t" else hand.integers(0, 100, count).astype(kind)
                            for name, kind in kinds.items()}  # fmt: skip
    run = hand.random() < 0.5
    tree = {"run": Run(trials.values())} if run else dict(trials)
    ends = {(f"_run_{k}_" if run else f"_{name}"): one for k, (name, one) in enumerate(trials.items(), start=1)}
    return Drawn(tree, ends, "*")


def simulink(hand: np.random.Generator) -> Drawn:
    columns = table(hand, int(hand.integers(8, 60)))
    time = columns.pop("t")
    signals = Run({"values": one.reshape(-1, 1) if hand.random() < 0.7 else one.reshape(1, 1, -1), "label": name,
                   "blockName": f"model/{name}"} for name, one in columns.items())  # fmt: skip
    whole = signals if len(signals) > 1 else signals[0]
    return Drawn({"out": {"time": time.reshape(-1, 1), "signals": whole, "blockName": "model/Scope"}},
                 {"": {"time": time, **columns}})  # fmt: skip


def content(drawn: Drawn, format: str) -> bytes:
    if format == "v7.3":
        return version73(drawn.tree, packed=len(drawn.tree) % 2 == 0)
    return Version5(">" if "big" in format else "<", "7" in format, len(drawn.tree) % 2 == 0).file(drawn.tree)


def header(shape: tuple[int, ...], descr: object, turned: bool = False) -> bytes:
    said = f"{{'descr': {descr!r}, 'fortran_order': {turned}, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\1\0" + (118).to_bytes(2, "little") + said.ljust(117) + b"\n" if len(said) < 118 else (
        b"\x93NUMPY\1\0" + (len(said) + 1).to_bytes(2, "little") + said + b"\n")  # fmt: skip


def numpy_file(hand: np.random.Generator, format: str) -> tuple[bytes, Drawn]:
    columns = table(hand, int(hand.integers(8, 60)))
    if format == "npz":
        held = io.BytesIO()
        with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED if hand.random() < 0.5 else zipfile.ZIP_STORED) as made:
            for name, one in {"L_pp": np.array([7.0]), **columns}.items():
                made.writestr(f"{name}.npy", header(one.shape, one.dtype.str) + one.tobytes())
        return held.getvalue(), Drawn({}, {"": columns})
    rows = np.zeros(columns["t"].size, dtype=[(name, one.dtype.newbyteorder(">" if hand.random() < 0.3 else "<"))
                                              for name, one in columns.items()])  # fmt: skip
    for name, one in columns.items():
        rows[name] = one
    return header(rows.shape, rows.dtype.descr) + rows.tobytes(), Drawn({}, {"": columns})


def back(path: Path, drawn: Drawn) -> dict[str, Trial]:
    columns = next(iter(drawn.trials.values()))
    time = next(iter(columns))
    channels = {f"a_{name}": Channel(name, "-") for name in columns if name != time}
    found = read(path, Mapping(time=Clock(time, unit="s"), channels=channels, sheet=drawn.sheet))
    return {one.name.removeprefix(path.stem): one for one in found}


def check(folder: Path, format: str, seed: int) -> None:
    hand = np.random.default_rng([seed, FORMATS.index(format)])
    if format in ("npz", "npy"):
        raw, drawn = numpy_file(hand, format)
    else:
        forms = (variables, matrix, structure, structures, simulink)
        drawn = forms[seed % len(forms)](hand)
        raw = content(drawn, format)
    path = folder / f"log.{format if format[0] == 'n' else 'mat'}"
    path.write_bytes(raw)
    found = back(path, drawn)
    assert list(found) == list(drawn.trials)
    for name, columns in drawn.trials.items():
        time, *rest = columns
        np.testing.assert_array_equal(found[name].t, columns[time])
        for one in rest:
            np.testing.assert_array_equal(found[name][f"a_{one}"], columns[one].astype(np.float64))


@pytest.mark.slow
@pytest.mark.parametrize("format", FORMATS)
def test_what_is_written_comes_back_to_the_last_bit(format: str, tmp_path: Path) -> None:
    for seed in range(25):
        check(tmp_path, format, seed)


@pytest.mark.long
@pytest.mark.parametrize("format", FORMATS)
def test_what_is_written_comes_back_a_thousand_times(format: str, tmp_path: Path) -> None:
    for seed in range(25, 1025):
        check(tmp_path, format, seed)


T = np.arange(200) * 0.5
TURNING = {
    "t": T, "lat": 63.0 + 1e-5 * T, "lon": 10.0 + 2e-5 * np.sin(T / 9.0), "heading": 20.0 * np.sin(T / 20.0),
}  # fmt: skip


@pytest.mark.parametrize("writer", [Version5("<", True).file, Version5(">").file, version73])
def test_a_guess_reads_a_file_of_matlab_as_it_does_a_table(writer: Any, tmp_path: Path) -> None:
    (tmp_path / "log.mat").write_bytes(writer({"L": np.array([5.0]), "log": TURNING}))
    text = guess(tmp_path / "log.mat").text
    assert 'latitude = "lat"' in text
    assert 'time = { column = "t", unit = "s" }' in text


@pytest.mark.parametrize(("kind", "line"), [
    ("timetable", "writetimetable(log, 'log.csv')"), ("table", "writetable(log, 'log.csv')"),
    ("timeseries", "struct('time', log.Time, 'data', log.Data)"), ("datetime", "log = posixtime(log)"),
    ("Simulink.SimulationData.Dataset", "writetimetable(extractTimetable(log), 'log.csv')"),
    ("Reading", "log = struct(log)"),
])  # fmt: skip
@pytest.mark.parametrize("writer", [Version5("<", True).file, version73])
def test_an_object_is_named_with_the_line_to_run(kind: str, line: str, writer: Any, tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(writer({"L": np.array([5.0]), "log": Opaque(kind), "other": Opaque("string")}))
    with pytest.raises(DataError, match="no table in it") as said:
        guess(path)
    assert line in str(said.value)
    assert "other = cellstr(other)" in str(said.value)
    assert "\n" not in str(said.value)
    path.write_bytes(writer({**TURNING, "log": Opaque(kind)}))
    assert any(line in one for one in guess(path).doubts)


def test_columns_without_names_are_named_by_the_mapping(tmp_path: Path) -> None:
    path = tmp_path / "log.npy"
    rows = np.stack([TURNING["t"], TURNING["heading"]])
    path.write_bytes(header(rows.shape, "<f8") + rows.tobytes())
    with pytest.raises(DataError, match="2 columns without names; write a mapping that names them"):
        guess(path)
    how = Mapping(time=Clock("t", unit="s"), channels={"psi": Channel("hdg", "deg")}, columns=("t", "hdg"))
    (trial,) = read(path, how)
    np.testing.assert_allclose(np.degrees(trial["psi"]), TURNING["heading"], atol=1e-12)
    with pytest.raises(DataError, match="2 columns, and columns of the mapping has 3"):
        read(path, Mapping(time=Clock("t", unit="s"), channels=how.channels, columns=("t", "hdg", "r")))
    named = np.zeros(5, dtype=[("t", "f8"), ("hdg", "f8")])
    named["t"] = np.arange(5)
    np.save(path, named)
    with pytest.raises(DataError, match="names its own columns"):
        read(path, how)


@pytest.mark.parametrize("writer", [Version5("<", True).file, Version5(">").file, version73])
def test_the_columns_of_a_square_matrix_are_those_of_matlab(writer: Any, tmp_path: Path) -> None:
    square = np.arange(36.0).reshape(6, 6)
    (tmp_path / "log.mat").write_bytes(writer({"M": square}))
    how = Mapping(time=Clock("M(:,1)", unit="s"), channels={"a": Channel("M(:,3)", "-")})
    (trial,) = read(tmp_path / "log.mat", how)
    np.testing.assert_array_equal(trial.t, square[:, 0])
    np.testing.assert_array_equal(trial["a"], square[:, 2])


def test_texts_are_times_and_words(tmp_path: Path) -> None:
    stamps = [f"2026-05-01 09:00:{k:02d}" for k in range(20)]
    (tmp_path / "log.mat").write_bytes(Version5("<", True).file({"when": stamps, "heading": np.arange(20.0)}))
    how = Mapping(time=Clock("when", format="iso", zone="UTC"), channels={"psi": Channel("heading", "deg")})
    (trial,) = read(tmp_path / "log.mat", how)
    assert trial.meta["start"] == "2026-05-01T09:00:00.000000+00:00"
    np.testing.assert_array_equal(trial.t, np.arange(20.0))
