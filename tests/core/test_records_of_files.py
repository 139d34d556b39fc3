"""Records of files: what a document may hold by the types of a dataclass, what comes back, what is said of the rest."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from seatrial.core.errors import DataError, RequestError
from seatrial.core.records import (
    Limits,
    Positive,
    filled,
    named,
    read_archive,
    read_json,
    short,
    to_archive,
    to_json,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inner:
    size: Positive
    side: Literal["port", "starboard"] | None = None


@dataclass(frozen=True)
class Outer:
    name: str
    count: int = 0
    first: float = named("from", 0.0)
    far: Annotated[float, Limits(null=math.inf)] = 0.0
    one: Inner | None = None
    several: Inner | list[Inner] = field(default_factory=list[Inner])
    by_name: Mapping[str, Inner] = field(default_factory=dict[str, Inner])
    by_side: dict[Literal["port", "starboard"], float] = field(default_factory=dict[Any, float])
    pair: tuple[float, float] = (0.0, 0.0)
    many: Annotated[tuple[float, ...], Limits(entries=1)] = (1.0,)
    either: float | str = 0.0
    when: datetime | None = None
    anything: Any = None


@dataclass(frozen=True)
class Held:
    paths: tuple[str, ...]
    values: Array
    below: Mapping[str, Array]
    scale: float = math.nan


def read(**said: Any) -> Outer:
    return filled(Outer, {"name": "a", **said}, "f.toml", DataError)


def test_a_document_becomes_the_record_that_its_types_say() -> None:
    when = datetime(2026, 1, 1, tzinfo=UTC)
    found = read(**{"from": 1}, one={"size": 2}, several=[{"size": 1.5, "side": "port"}], by_name={"x": {"size": 3.0}},
                 by_side={"port": 1}, pair=[1, 2.5], many=[4], either="text", when=when, anything={"k": [1, "a"]})
    assert found == Outer("a", 0, 1.0, 0.0, Inner(2.0), [Inner(1.5, "port")], {"x": Inner(3.0)}, {"port": 1.0},
                          (1.0, 2.5), (4.0,), "text", when, {"k": [1, "a"]})  # fmt: skip
    assert type(found.first) is float
    assert read(several={"size": 1.0}).several == Inner(1.0)


@pytest.mark.parametrize(("said", "told"), [
    ({"cuont": 1}, "f.toml: cuont: no key 'cuont'; near: count"),
    ({"by_name": {"x": {"siez": 1.0}}}, "by_name.x.siez: no key 'siez'; near: size"),
    ({"several": [{"size": 1.0}, {"side": "port"}]}, "several.1.size is missing"),
    ({"several": 3}, "several is 3; it must be a table or a list"),
    ({"count": 1.5}, "count is 1.5; it must be a whole number"),
    ({"count": True}, "count is True; it must be a whole number"),
    ({"name": 3}, "name is 3; it must be a text"),
    ({"from": math.inf}, "from is inf; it must be a finite number"),
    ({"one": {"size": 0}}, "one.size is 0.0; it must be a finite number above 0"),
    ({"one": {"size": 1.0, "side": "left"}}, "one.side is 'left'; it must be 'port' or 'starboard'"),
    ({"by_side": {"left": 1.0}}, "by_side.left: no key 'left'; known: port, starboard"),
    ({"pair": [1.0, 2.0, 3.0]}, "pair is [1.0, 2.0, 3.0]; it must be a list of 2"),
    ({"many": []}, "many is []; it must be a list of 1 or more"),
    ({"either": True}, "either is True; it must be a finite number or a text"),
    ({"when": "noon"}, "when is 'noon'; it must be a date with a time"),
])  # fmt: skip
def test_what_is_wrong_is_told_in_one_line_with_its_key(said: dict[str, Any], told: str) -> None:
    with pytest.raises(DataError) as caught:
        read(**said)
    assert told in str(caught.value)


def test_what_a_message_repeats_is_one_short_line() -> None:
    for said in ({"a\nb" + 300 * "c": 1}, {"count": "\n" * 5000}):
        with pytest.raises(DataError) as caught:
            read(**said)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 600


def test_what_a_message_repeats_ends_after_eighty_letters() -> None:
    assert short("a" * 80) == "a" * 80
    assert short("a" * 81) == "a" * 80 + "..."
    assert short("a\nb") == "a\\nb"


def test_json_gives_the_record_back_and_null_is_what_its_type_says(tmp_path: Path) -> None:
    path, found = tmp_path / "a.json", Inner(2.0, "port")
    path.write_text(to_json(found, "inner/1"))
    assert read_json(path, Inner, "inner/1") == found
    path.write_text(json.dumps({"schema": "outer/1", "name": "a", "far": None, "from": 0.0}))
    assert read_json(path, Outer, "outer/1").far == math.inf
    with pytest.raises(RequestError, match=r"schema is 'outer/1'; this version reads 'outer/2'; make it anew"):
        read_json(path, Outer, "outer/2", remedy="make it anew")
    for text in ("{", "[1]", "3"):
        path.write_text(text)
        with pytest.raises(RequestError, match=r"a\.json: .*; make it anew"):
            read_json(path, Outer, "outer/1", remedy="make it anew")


def test_an_archive_gives_every_bit_back(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    rng = np.random.default_rng(0)
    below = {"one": rng.random(3), "two": rng.random((2, 4)), "none": np.zeros((0, 2))}
    found = Held(("a", "b"), np.array([[1.0, np.nan], [np.inf, 1.0 / 3.0]]), below)
    path.write_bytes(to_archive(found, "held/1"))
    again = read_archive(path, Held, "held/1")
    assert again.paths == found.paths
    assert np.array_equal(again.values, found.values, equal_nan=True)
    assert {name: one.tolist() for name, one in again.below.items()} == {n: one.tolist() for n, one in below.items()}
    assert again.below["none"].shape == (0, 2)
    assert math.isnan(again.scale)
    with np.load(path) as arrays:  # for whoever reads it without seatrial
        assert arrays["paths"].tolist() == ["a", "b"]
        assert arrays["values"].shape == (2, 2)


@pytest.mark.parametrize("change", [
    {"values": np.array(["x"])}, {"said": np.array("{")}, {"said": np.array("[1]")}, {"numbers": np.zeros(1)},
    {"more": np.zeros(1)},
], ids=["texts", "no JSON", "no table", "too few numbers", "unknown"])  # fmt: skip
def test_a_damaged_archive_is_refused_in_one_line(change: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(to_archive(Held((), np.ones(2), {"one": np.ones(3)}), "held/1"))
    with np.load(path) as arrays:
        held = {name: arrays[name] for name in arrays.files}
    np.savez(path, **{**held, **change})
    with pytest.raises(RequestError, match=r"a\.npz: [^\n]*; make it anew"):
        read_archive(path, Held, "held/1", remedy="make it anew")
