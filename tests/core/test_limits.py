"""Limits of what files may hold, from both sides: numbers, keys, names, texts, and what an error repeats."""

from __future__ import annotations

import math
import os
import signal
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest

from seatrial.core.errors import DataError, NmeaError, RequestError, SimulationError, TomlError, obeyed
from seatrial.core.files import (
    LARGEST,
    in_reach,
    is_plain,
    no_file,
    packed,
    plain,
    read_toml,
    toml_of,
    write_together,
    write_whole,
)
from seatrial.core.records import (
    Limits,
    NotNegative,
    Positive,
    digest,
    filled,
    from_json,
    read_archive,
    read_json,
    read_record,
    to_archive,
    to_json,
)
from seatrial.core.unpacking import most, told, unpacked


def test_numbers_can_be_squared() -> None:
    assert [in_reach(one) for one in (1e-30, 0.99e-30, -1e30, 1.01e30, 1.0)] == [True, False, True, False, True]
    assert toml_of("a = 0.0\nb = inf\nc = -inf\nd = 1e30") == {"a": 0.0, "b": math.inf, "c": -math.inf, "d": 1e30}
    for wrong in ("nan", "1e31", "-1e-31"):
        with pytest.raises(TomlError, match=r"t\.a is .*; magnitudes lie between 1e-30 and 1e\+30"):
            toml_of(f"[t]\na = {wrong}")
    with pytest.raises(TomlError, match="a is nan"):
        toml_of("a = [[1.0, nan]]")
    assert toml_of(f"a = {2**63 - 1}") == {"a": 2**63 - 1}
    assert toml_of(f"a = {1 - 2**63}") == {"a": 1 - 2**63}
    for wrong in (2**63, -(2**63)):
        with pytest.raises(TomlError, match=r"a: an integer of \d+ digits; 64 bits hold no more than 19"):
            toml_of(f"a = {wrong}")


def test_keys_have_thirty_parts() -> None:
    deep = ".".join(["a"] * 30)
    assert toml_of(f"{deep} = 1")
    with pytest.raises(TomlError, match="line 3: a key of over 30 parts"):
        toml_of(f"\nb = 1\n{deep}.a = 1")


@pytest.mark.slow
def test_files_have_four_megabytes_and_are_no_pipes(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_bytes(b"#" * LARGEST)
    assert read_toml(tmp_path / "a.toml") == {}
    (tmp_path / "a.toml").write_bytes(b"#" * (LARGEST + 1))
    with pytest.raises(TomlError, match="4000001 bytes; 4000000 are the most"):
        read_toml(tmp_path / "a.toml")
    with pytest.raises(TomlError, match="nvalid"):
        toml_of("a = 2026-02-30")
    os.mkfifo(tmp_path / "pipe")
    assert no_file(tmp_path / "pipe").startswith("is a pipe")
    assert [no_file(one) for one in (tmp_path, tmp_path / "a.toml", tmp_path / "none")] == ["", "", ""]


def test_names_have_a_hundred_and_eighty_bytes() -> None:
    assert [is_plain(one) for one in ("a", "a" * 180, "ö" * 90, "a.b", "-a")] == [True] * 5
    assert [is_plain(one) for one in ("a" * 181, "ö" * 91, "a\x00b", "a\tb")] == [False] * 4


def test_files_are_written_with_the_mode_of_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "a", b"1")
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640
    assert write_together({tmp_path / "b": "ö", tmp_path / "c": b""}) == (tmp_path / "b", tmp_path / "c")
    assert (tmp_path / "b").read_bytes() == "ö".encode()


def test_values_become_the_types_of_json() -> None:
    @dataclass(frozen=True)
    class Two:
        a: Any
        b: Any

    said = plain({1: Two(np.float64(2.5), np.arange(2)), "p": Path("x") / "y", "n": (math.nan, math.inf, -1.0, True)})
    assert said == {"1": {"a": 2.5, "b": [0, 1]}, "p": "x/y", "n": [None, None, -1.0, True]}
    assert digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1}) != digest({"a": 1, "b": 3})
    assert len(digest({})) == 32
    assert unpacked(packed(a=np.arange(3), b=2.0))["a"].tolist() == [0, 1, 2]
    assert (most(0), most(671_088), most(671_089)) == (64 << 20, 64 << 20, 67_108_900)
    assert told(2e9, 1_000_000) == "holds 2000 MB in a file of 1 MB; 100 MB are the most"


@pytest.mark.parametrize(("limits", "good", "bad"), [
    (Limits(above=0.0), (1e-9, 5), (0.0, -1, math.nan)),
    (Limits(least=0.0, most=2.0), (0.0, 2.0), (-1e-9, 2.1, math.nan)),
    (Limits(most=2.0), (-1e9, 2.0), (2.1,)), (Limits(entries=2), ([1, 2], "ab"), ([1], "a")),
    (Limits(length=2), ([], "ab"), ([1, 2, 3], "abc")), (Limits(), (math.inf, math.nan, []), ()),
])  # fmt: skip
def test_limits_hold_or_not(limits: Limits, good: tuple[Any, ...], bad: tuple[Any, ...]) -> None:
    assert [limits.hold(one) for one in good] == [True] * len(good)
    assert [limits.hold(one) for one in bad] == [False] * len(bad)


def test_limits_are_told_after_the_type() -> None:
    assert str(Limits(above=0.0, most=3.5)) == " above 0 to 3.5"
    assert str(Limits(least=-1.0, entries=2, length=7)) == " from -1 of 2 or more of at most 7"
    assert (str(Limits()), Limits().bound, Limits(most=1.0).bound) == ("", False, True)
    assert Limits(least=0.0).bound
    assert Limits(above=0.0).bound


@dataclass(frozen=True)
class Held:
    size: Positive = 1.0
    depth: NotNegative = 0.0
    far: Annotated[float, Limits(infinite=True)] = 0.0
    name: Annotated[str, Limits(entries=1, length=5)] = "a"
    rows: Annotated[list[int], Limits(entries=1, length=2)] | None = None


@pytest.mark.parametrize(("said", "told"), [
    ({"size": 0.0}, "size is 0.0; it must be a finite number above 0"), ({"size": math.inf}, "finite number above 0"),
    ({"depth": -1e-9}, "depth is -1e-09; it must be a finite number from 0"),
    ({"name": ""}, "a text of 1 or more of at most 5"), ({"name": "abcdef"}, "of at most 5"), ({"rows": []}, "rows is"),
    ({"rows": [1, 2, 3]}, "rows is"), ({"rows": [1.5]}, "rows.0 is 1.5; it must be a whole number"),
])  # fmt: skip
def test_what_is_beyond_its_limits_is_told(said: dict[str, Any], told: str) -> None:
    assert filled(Held, {"depth": 0.0, "far": -math.inf, "name": "abcde", "rows": [1, 2]}, "f") == Held(
        1.0, 0.0, -math.inf, "abcde", [1, 2]
    )
    with pytest.raises(RequestError) as caught:
        filled(Held, said, "f")
    assert told in str(caught.value)


def test_null_is_no_number_in_json_and_none_in_toml_where_it_may() -> None:
    assert math.isnan(from_json(Held, {"far": None}, "f").far)
    assert filled(Held, {"rows": None}, "f").rows is None


def test_an_error_is_one_line_of_moderate_length() -> None:
    assert str(DataError("a\nb\x1b")) == "a\\nb\\x1b"
    assert str(DataError("x" * 1200)) == "x" * 1200
    assert str(DataError("x" * 800 + "y" * 101 + "z" * 300)) == "x" * 800 + " ... " + "z" * 300
    assert (NmeaError("a", "form").reason, SimulationError("a", 3.0).time, SimulationError("a").time) == (
        "form", 3.0, None
    )  # fmt: skip
    assert (str(TomlError("text")), isinstance(TomlError("text"), ValueError)) == ("text", True)


def test_a_ctrl_c_that_was_obeyed_is_not_repeated() -> None:
    before = signal.signal(signal.SIGALRM, signal.SIG_IGN)
    try:
        signal.setitimer(signal.ITIMER_REAL, 100.0)
        obeyed()
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@dataclass(frozen=True)
class Kept:
    place: Path
    size: Positive
    pairs: tuple[tuple[float, ...], ...] = ()


def test_a_record_of_each_kind_of_file_comes_back(tmp_path: Path) -> None:
    found = Kept(Path("a") / "b", 0.1, ((1.0, 2.0), (3.0,)))
    (tmp_path / "a.toml").write_text('schema = "kept/1"\nplace = "a/b"\nsize = 0.1\npairs = [[1.0, 2.0], [3.0]]\n')
    assert read_record(tmp_path / "a.toml", Kept, "kept/1") == found
    (tmp_path / "a.json").write_text(to_json(found, "kept/1"))
    assert read_json(tmp_path / "a.json", Kept, "kept/1") == found
    (tmp_path / "a.npz").write_bytes(to_archive(replace(found, place="a/b"), "kept/1"))  # type: ignore[arg-type]
    assert read_archive(tmp_path / "a.npz", Kept, "kept/1") == found
    with np.load(tmp_path / "a.npz") as held:
        assert held["numbers"].size == 0
    with pytest.raises(RequestError, match="place is 3; it must be a path"):
        filled(Kept, {"place": 3, "size": 1.0}, "f")
    for path in ("none.json", "a.npz"):
        with pytest.raises(RequestError, match=rf"{path}: cannot be read: .+; make it anew"):
            read_json(tmp_path / path, Kept, "kept/1", remedy="make it anew")


def test_files_are_for_all_where_the_umask_takes_nothing(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        write_whole(tmp_path / "a", b"1")
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o666
