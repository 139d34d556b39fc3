"""What a file of arrays holds, as a tree, and the tables that are in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class Foreign:
    """A variable that is neither an array, a text nor a structure.

    Attributes:
        kind: its class.
        shut: whether it is an object, whose values only its own program knows.
    """

    kind: str
    shut: bool = False


@dataclass(frozen=True)
class Alike:
    """The elements of an array of structures."""

    parts: tuple[Mapping[str, Any], ...]


Tree = Mapping[str, Any]
"""Variables by name: arrays of numbers, times or texts, `Foreign`, `Alike`, and trees."""

_READ, _LAST = "fiubUSOM", 0x10FFFF
_FEWEST, _WIDEST = 2, 1000
"""Columns of a table at least, and of a matrix at most: an image or a map is no table."""

_LINES: Mapping[str, str] = {
    "timetable": "writetimetable({0}, '{0}.csv')",
    "table": "writetable({0}, '{0}.csv')",
    "timeseries": "{0} = struct('time', {0}.Time, 'data', {0}.Data); save('FILE.mat', '{0}', '-v7')",
    "datetime": "{0} = posixtime({0}); save('FILE.mat', '{0}', '-append')",
    "duration": "{0} = seconds({0}); save('FILE.mat', '{0}', '-append')",
    "string": "{0} = cellstr({0}); save('FILE.mat', '{0}', '-append')",
    "Simulink.SimulationData.Dataset": "writetimetable(extractTimetable({0}), '{0}.csv')",
    "Simulink.SimulationOutput": "writetimetable(extractTimetable({0}.logsout), '{0}.csv')",
}
_PLAIN = "{0} = struct({0}); save('FILE.mat', '{0}', '-append')"


def texts_of(codes: NDArray[Any]) -> NDArray[Any]:
    """The rows of a matrix of characters as texts, shape (rows,).

    Raises:
        ValueError: a number that is no character.
    """
    codes = np.atleast_2d(codes)
    rows = codes.reshape(codes.shape[0], -1).tolist() if codes.size else [[]]
    try:
        return np.array(["".join(map(chr, row)) for row in rows], dtype=object)
    except (TypeError, OverflowError):
        raise ValueError("a text of numbers that are no characters") from None


def cell(parts: list[Any]) -> Any:
    """The elements of a cell as one part of a tree: texts, single numbers, or structures."""
    single = [np.ravel(one) for one in parts if isinstance(one, np.ndarray) and one.dtype.kind in _READ]
    if parts and len(single) == len(parts) and all(one.size <= 1 for one in single):
        texts = [one.dtype.kind in "OU" or not one.size for one in single]
        if all(texts):
            return np.array([str(one[0]) if one.size else "" for one in single], dtype=object)
        if not any(texts):
            return np.concatenate(single)
    if parts and all(isinstance(one, Mapping) for one in parts):
        return Alike(tuple(parts))
    return Foreign("cell")


def sheets(tree: Tree) -> tuple[dict[str, pl.DataFrame], tuple[str, ...]]:
    """The tables of a tree by name, of each structure the one with most values first; what is left out, in words."""
    import polars as pl

    found: dict[str, pl.DataFrame] = {}
    for name, columns in _gathered(tree, ""):
        lengths = Counter(len(values) for values in columns.values() if len(values) > 1)
        for length in sorted(lengths, key=lambda length: (-lengths[length] * length, -length)):
            own = [_series(head, values) for head, values in columns.items() if len(values) == length]
            if len(own) < _FEWEST or all(one.dtype == pl.String for one in own):
                continue
            title = own[0].name if name in found else name
            found[title if title not in found else f"{name}.{title}"] = pl.DataFrame(own)
    return found, tuple(_foreign(tree, ""))


def _series(head: str, values: NDArray[Any]) -> pl.Series:
    import polars as pl

    if values.dtype.kind == "U" and values.size:
        codes = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("="))).view("u4")
        if codes.max() > _LAST:
            raise ValueError("a text of numbers that are no characters")
    if values.dtype.kind in "OU":
        return pl.Series(head, [str(one) for one in values.tolist()], dtype=pl.String)
    if values.dtype.kind == "S":
        return pl.Series(head, [one.decode("latin-1") for one in values.tolist()], dtype=pl.String)
    if values.dtype.kind == "f":
        return pl.Series(head, values.astype(np.float64))
    return pl.Series(head, np.ascontiguousarray(values.astype(values.dtype.newbyteorder("="))))


def _foreign(tree: Tree, name: str) -> Iterator[str]:
    """What to run in MATLAB for each variable that is an object."""
    for key, value in tree.items():
        path = f"{name}.{key}" if name else key
        if isinstance(value, Foreign) and value.shut:
            line = _LINES.get(value.kind, _PLAIN).format(path)
            yield f"{path} is an object of MATLAB ({value.kind}); there: {line}"
        elif isinstance(value, Mapping):
            yield from _foreign(value, path)
        elif isinstance(value, Alike) and value.parts:
            yield from _foreign(value.parts[0], f"{path}(1)")


def _gathered(tree: Tree, name: str) -> Iterator[tuple[str, dict[str, NDArray[Any]]]]:
    """Columns of each table by head, with the name of the structure it is."""
    inner = _structures(tree)
    kinds = Counter(frozenset(one) for one in inner.values())
    alike = {key for key, one in inner.items() if kinds[frozenset(one)] > 1 and len(one) > 1}
    paths = dict(_leaves({key: value for key, value in tree.items() if key not in alike and _whole(key, alike)}, ""))
    ends = Counter(path.rpartition(".")[2] for path in paths)
    own = {path if ends[last := path.rpartition(".")[2]] > 1 else last: values for path, values in paths.items()}
    if own:
        yield name, own
    for key in inner:
        if key in alike:
            yield from _gathered(inner[key], f"{name}.{key}" if name else key)


def _whole(key: str, alike: set[str]) -> bool:
    """Whether a variable is none of which the elements are tables."""
    return f"{key}(1)" not in alike


def _structures(tree: Tree) -> dict[str, Tree]:
    """Structures of a tree, and the elements of its arrays of structures."""
    found: dict[str, Tree] = {}
    for key, value in tree.items():
        if isinstance(value, Mapping):
            found[key] = value
        elif isinstance(value, Alike):
            found |= {f"{key}({k})": one for k, one in enumerate(value.parts, start=1)}
    return found


def _leaves(tree: Tree, name: str) -> Iterator[tuple[str, NDArray[Any]]]:
    """Columns by their path."""
    if set(tree) >= {"time", "signals"}:
        yield from _simulink(tree, name)
        return
    arrays = {key: value for key, value in tree.items() if isinstance(value, np.ndarray) and value.dtype.kind in _READ}
    texts = {value.size: value.ravel() for value in arrays.values() if value.dtype.kind in "OU" and _is_vector(value)}
    for key, value in arrays.items():
        path = f"{name}.{key}" if name else key
        if _is_vector(value):
            yield path, value.ravel()
        elif value.dtype.kind != "O":
            yield from _columns(path, _upright(value, set(texts)), texts)
    for key, value in _structures(tree).items():
        yield from _leaves(value, f"{name}.{key}" if name else key)


def _is_vector(value: NDArray[Any]) -> bool:
    return value.ndim > 0 and value.size == max(value.shape)


def _upright(value: NDArray[Any], across: Collection[int]) -> NDArray[Any]:
    """A matrix with its rows in time, which is its longer side, unless only that one has as many names."""
    flat = np.squeeze(value)
    if flat.ndim != 2:
        return np.zeros((0, 0))
    high, wide = flat.shape
    named = (high in across) - (wide in across)
    return flat.T if named > 0 or (named == 0 and high < wide) else flat


def _columns(path: str, matrix: NDArray[Any], texts: Mapping[int, NDArray[Any]]) -> Iterator[tuple[str, NDArray[Any]]]:
    if matrix.shape[1] > _WIDEST or matrix.shape[0] < 2:
        return
    names = [str(one).strip() for one in texts.get(matrix.shape[1], ())]
    for k in range(matrix.shape[1]):
        head = f"{path}(:,{k + 1})" if path else str(k + 1)
        yield names[k] if len(set(names)) == matrix.shape[1] and names[k] else head, matrix[:, k]


def _simulink(tree: Tree, name: str) -> Iterator[tuple[str, NDArray[Any]]]:
    """The structure with time of Simulink: `time`, `signals(k).values` and the name of each."""
    time = np.ravel(tree["time"])
    yield f"{name}.time" if name else "time", time
    signals = tree["signals"].parts if isinstance(tree["signals"], Alike) else (tree["signals"],)
    for k, one in enumerate(signals, start=1):
        values = one.get("values")
        if not isinstance(values, np.ndarray):
            continue
        named = (np.ravel(one[key]) for key in ("label", "blockName") if isinstance(one.get(key), np.ndarray))
        said = [str(text[0]) for text in named if text.size and text.dtype.kind in "OU"]
        label = next((text.rpartition("/")[2].strip() for text in said if text.strip()), f"signals({k})")
        path = f"{name}.{label}" if name else label
        if _is_vector(values):
            yield path, values.ravel()
        else:
            across = [size for size in values.shape if size != time.size]
            yield from _columns(path, _upright(values, across), {})
