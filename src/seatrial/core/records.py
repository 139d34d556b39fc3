"""Frozen dataclasses as the records of files: TOML and JSON documents, and .npz archives.

The fields are the keys, their types what the keys may hold; what is not a matter of type is checked by whoever uses the
record.  An error is one line: the file, the key, what it holds and what it may hold, near names of an unknown one.
Whole numbers are taken for floats, and null for the number that `Limits.null` says.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from datetime import datetime
from functools import cache
from pathlib import Path
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from .errors import RequestError
from .files import packed, plain, read_toml
from .kinds import wrong_kind
from .parameters import unknown
from .unpacking import unpacked
from .values import MISSING, Field, dataclass, field, fields, is_dataclass

T = TypeVar("T")

_SHOWN = 80
"""Longest text of a document that a message repeats."""
_KINDS: Mapping[Any, str] = MappingProxyType({
    str: "a text", int: "a whole number", float: "a finite number", bool: "true or false", NoneType: "null",
    datetime: "a date with a time", Path: "a path", list: "a list", dict: "a table", np.ndarray: "rows of numbers",
})  # fmt: skip
# Members of an archive beside the arrays that are fields of the record itself.
_SAID, _NUMBERS = "said", "numbers"


@dataclass(frozen=True)
class Limits:
    """What a value may be within its type, in `Annotated`.

    Attributes:
        above, least, most: of a number.
        entries, length: fewest and most entries of a list or a table, letters of a text.
        infinite: whether infinite numbers are taken.
        null: number that null stands for.
    """

    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    entries: int = 0
    length: float = math.inf
    infinite: bool = False
    null: float = math.nan

    def hold(self, value: Any) -> bool:
        """Whether they hold for a value of the type; NaN is beyond any."""
        if isinstance(value, str | list | dict):
            return self.entries <= len(cast("list[Any]", value)) <= self.length
        return not self.bound or (value >= self.least and value <= self.most and value > self.above)

    @property
    def bound(self) -> bool:
        """Whether they say anything of a number."""
        return not self.above == self.least == -self.most == -math.inf

    def __str__(self) -> str:
        """After the words for the type."""
        said = [f" {word} {one:g}" for word, one in (("above", self.above), ("from", self.least), ("to", self.most))
                if math.isfinite(one)]  # fmt: skip
        said += [f" of {self.entries} or more"] * (self.entries > 0)
        return "".join(said) + (f" of at most {self.length:g}" if math.isfinite(self.length) else "")


_USUAL = Limits()

Positive = Annotated[float, Limits(above=0.0)]
NotNegative = Annotated[float, Limits(least=0.0)]


def named(key: str, default: Any = MISSING) -> Any:
    """A field whose key in the file is no name of Python's, such as ``from``."""
    return field(default=default, metadata={"key": key})


def filled(kind: type[T], said: Mapping[str, Any], where: object, error: type[RequestError] = RequestError) -> T:
    """The record that a document holds.

    Args:
        kind: dataclass of fields of type str, int, float, bool, None, Any, Literal, datetime, Path, an array, a
            dataclass, a list, tuple or mapping of these, or a union of them; `Annotated` with `Limits`.
        where: file, or what else the document is from, for messages.

    Raises:
        error: an unknown key (the near ones are named), a missing one, a value of another type or beyond its limits.
    """
    return cast("T", _Reading(str(where), error).record(kind, said, ()))


def document_of(path: Path, error: type[RequestError] = RequestError) -> dict[str, Any]:
    """The document of a TOML file.

    Raises:
        error: no such file, or what is wrong with it.
    """
    try:
        return read_toml(path)
    except (OSError, ValueError) as why:
        raise error(f"{path}: cannot be read as TOML: {why}") from None


def read_record(path: Path, kind: type[T], schema: str, error: type[RequestError] = RequestError) -> T:
    """The record of a TOML file; raises `error` as `document_of`, `of_schema` and `filled`."""
    return filled(kind, of_schema(document_of(path, error), schema, path, error), path, error)


def of_schema(said: Any, schema: str, where: str | Path, error: type[RequestError] = RequestError) -> dict[str, Any]:
    """A document without its key `schema`.

    Raises:
        error: it has another one, or none.
    """
    if not isinstance(said, dict):
        raise error(f"{where}: holds {_KINDS.get(type(said), 'no table')}; it must be a table of keys with values")
    table = cast("dict[str, Any]", said)
    if (found := table.get("schema")) != schema:
        raise error(wrong_kind(where, found, schema))
    return {key: value for key, value in table.items() if key != "schema"}


def to_json(found: Any, schema: str) -> str:
    """A record as the text of a JSON file; numbers that are not finite become null."""
    return json.dumps({"schema": schema, **plain(found)}) + "\n"


def json_of(path: Path, schema: str, error: type[RequestError] = RequestError, remedy: str = "") -> dict[str, Any]:
    """A JSON file of a schema, without that key.

    Args:
        remedy: what would help whoever meets an error, after it.

    Raises:
        error: not such a file, or one of another schema.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as why:
        raise _unread(path, why, error, remedy) from None
    return json_in(text, schema, path, error, remedy)


def json_in(
    text: str | bytes, schema: str, where: object, error: type[RequestError] = RequestError, remedy: str = ""
) -> dict[str, Any]:
    """As `json_of`, of the content of a file or of what a file holds."""
    try:
        said = json.loads(text)
    except (ValueError, RecursionError) as why:
        raise _unread(where, why, error, remedy) from None
    with _helped(error, remedy):
        return of_schema(said, schema, str(where), error)


def read_json(
    path: Path, kind: type[T], schema: str, error: type[RequestError] = RequestError, remedy: str = ""
) -> T:  # fmt: skip
    """The record of a JSON file that `to_json` gave; numbers may be null.

    Raises:
        error: as of `json_of` and `filled`.
    """
    said = json_of(path, schema, error, remedy)
    with _helped(error, remedy):
        return from_json(kind, said, path, error)


def from_json(kind: type[T], said: Mapping[str, Any], where: object, error: type[RequestError] = RequestError) -> T:
    """As `filled`, of a document in which null stands for numbers that are not finite."""
    return cast("T", _Reading(str(where), error, finite=False).record(kind, said, ()))


def digest(said: Any) -> str:
    """Of a document in the types of JSON, whatever the order and layout of its keys."""
    return hashlib.sha256(json.dumps(said, sort_keys=True, default=str).encode()).hexdigest()[:32]


def to_archive(found: Any, schema: str) -> bytes:
    """A record as the content of an .npz file, to the last bit.

    Arrays and lists of texts that are its fields are members of their names; arrays farther below share one, so that
    their number is not limited, and the rest is one text.
    """
    own = {one.name: np.array(vars(found)[one.name]) for one in fields(found) if _alone(vars(found)[one.name])}
    below: list[Any] = []
    said = {one.name: _said(vars(found)[one.name], below) for one in fields(found) if one.name not in own}
    text = json.dumps({"schema": schema, **said})
    joined = np.concatenate([one.ravel() for one in below]) if below else np.zeros(0)
    return packed(**own, **{_SAID: np.array(text), _NUMBERS: joined})


def read_archive(
    path: Path, kind: type[T], schema: str, error: type[RequestError] = RequestError, remedy: str = ""
) -> T:  # fmt: skip
    """The record of an .npz file that `to_archive` gave.

    Raises:
        error: as of `read_json`.
    """
    try:
        found = unpacked(path.read_bytes())
        said, below = json.loads(str(found.pop(_SAID))), found.pop(_NUMBERS)
    except (OSError, ValueError, RecursionError, KeyError) as why:
        raise _unread(path, why, error, remedy) from None
    own = {name: one.tolist() if one.dtype.kind == "U" else one for name, one in found.items()}
    with _helped(error, remedy):
        document = of_schema({**said, **own} if isinstance(said, dict) else said, schema, path, error)
        return cast("T", _Reading(str(path), error, False, below).record(kind, document, ()))


def short(text: str) -> str:
    """A text of a document, on one line of moderate length."""
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}..."


@contextmanager
def _helped(error: type[RequestError], remedy: str) -> Generator[None]:
    try:
        yield
    except error as why:
        raise error(f"{why}{remedy and f'; {remedy}'}") from None


def _unread(path: object, why: Exception, error: type[RequestError], remedy: str) -> RequestError:
    told = f"it has no {why}" if isinstance(why, KeyError) else " ".join(str(why).split())[:200] or type(why).__name__
    return error(f"{path}: cannot be read: {told}{remedy and f'; {remedy}'}")


def _alone(value: Any) -> bool:
    """Whether a field is a member of an archive by itself."""
    texts = isinstance(value, tuple) and value and all(isinstance(one, str) for one in cast("tuple[Any, ...]", value))
    return isinstance(value, np.ndarray) or bool(texts)


def _said(value: Any, arrays: list[Any]) -> Any:
    """A value in the types of JSON, its arrays by their place among the numbers of all."""
    if is_dataclass(value):
        return {one.name: _said(vars(value)[one.name], arrays) for one in fields(value)}
    if isinstance(value, np.ndarray):
        before = sum(one.size for one in arrays)
        arrays.append(value)
        return [before, *value.shape]
    if isinstance(value, Mapping):
        return {str(key): _said(one, arrays) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_said(one, arrays) for one in value]
    return value.item() if isinstance(value, np.generic) else value


@cache
def _keys(kind: Any) -> Mapping[str, Field[Any]]:
    return {str(one.metadata.get("key", one.name)): one for one in fields(kind) if one.init}


@cache
def _hints(kind: Any) -> Mapping[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _split(hint: Any) -> tuple[Any, Any, tuple[Any, ...], Limits]:
    """What a type is of, itself without annotations, what it is made of, and its limits."""
    limits = _USUAL
    if get_origin(hint) is Annotated:
        hint, limits = get_args(hint)[:2]
    origin = get_origin(hint)
    if origin in (tuple, list):
        origin = list
    elif origin in (dict, Mapping):
        origin = dict
    elif origin is UnionType:
        origin = Union
    elif origin is None:
        origin = dict if is_dataclass(hint) else hint
    return origin, hint, get_args(hint), limits


def _fits(hint: Any, value: Any) -> bool:
    """Whether a value may be of this type, by its form alone."""
    origin, _, inner, _ = _split(hint)
    if origin is Any:
        return True
    if origin is Union:
        return any(_fits(one, value) for one in inner)
    if origin is Literal:
        return any(type(one) is type(value) and one == value for one in inner)
    if origin is float:
        return value is None or type(value) in (int, float)
    if origin is np.ndarray:
        return isinstance(value, list | np.ndarray)
    if origin is datetime:
        return isinstance(value, datetime)
    if origin is Path:
        return isinstance(value, str)
    return type(value) is origin


def _wanted(hint: Any, finite: bool = True) -> str:
    """A type in words."""
    origin, _, inner, limits = _split(hint)
    if origin is Union:
        return " or ".join(dict.fromkeys(_wanted(one, finite) for one in inner if one is not NoneType))
    if origin is Literal:
        return " or ".join(map(repr, inner))
    number = origin is float and (limits.infinite or not finite)
    return ("a number" if number else _KINDS.get(origin, str(origin))) + str(limits)


@dataclass(frozen=True)
class _Reading:
    """One document while it is read: where it is from, the error to raise, the numbers of an archive."""

    where: str
    error: type[RequestError]
    finite: bool = True
    numbers: Any = None

    def wrong(self, place: tuple[str, ...], what: str) -> RequestError:
        return self.error(f"{self.where}: {'.'.join(map(short, place))}{what}")

    def refused(self, hint: Any, value: Any, place: tuple[str, ...]) -> RequestError:
        return self.wrong(place, f" is {short(repr(value))}; it must be {_wanted(hint, self.finite)}")

    def record(self, kind: Any, said: Mapping[str, Any], place: tuple[str, ...]) -> Any:
        """A dataclass from the table at a place; an unknown key first, as it may be the missing one, misspelt."""
        known, hints = _keys(kind), _hints(kind)
        for key in said:
            if key not in known:
                raise self.wrong((*place, key), f": {unknown(short(key), known, 'key')}")
        values = {known[key].name: self.value(hints[known[key].name], one, (*place, key)) for key, one in said.items()}
        for key, one in known.items():
            if key not in said and one.default is MISSING and one.default_factory is MISSING:
                raise self.wrong((*place, key), " is missing")
        try:
            return kind(**values)
        except RequestError as error:
            raise self.error(f"{self.where}: {error}") from None

    def value(self, hint: Any, value: Any, place: tuple[str, ...]) -> Any:
        """A value of a document as that type."""
        origin, kind, inner, limits = _split(hint)
        if not _fits(hint, value):
            raise self.refused(hint, value, place)
        if origin is Union:
            return None if value is None and NoneType in inner else self.value(
                next(one for one in inner if _fits(one, value)), value, place)
        if origin is float:
            return self._number(hint, limits.null if value is None else float(value), place)
        if origin in (str, int, list, dict) and not limits.hold(value):
            raise self.refused(hint, value, place)
        if origin is list:
            return self._list(kind, inner, value, place)
        if origin is dict:
            return self.record(kind, value, place) if is_dataclass(kind) else self._mapping(inner, value, place)
        return self._array(hint, value, place) if origin is np.ndarray else Path(value) if origin is Path else value

    def _number(self, hint: Any, value: float, place: tuple[str, ...]) -> float:
        limits = _split(hint)[3]
        known = math.isfinite(value) or limits.infinite or not (self.finite or limits.bound)
        if not known or not limits.hold(value):
            raise self.refused(hint, value, place)
        return value

    def _list(self, kind: Any, inner: tuple[Any, ...], value: list[Any], place: tuple[str, ...]) -> Any:
        several = get_origin(kind) is list or inner[-1] is Ellipsis
        kinds = [inner[0]] * len(value) if several else list(inner)
        if len(kinds) != len(value):
            raise self.wrong(place, f" is {short(repr(value))}; it must be a list of {len(kinds)}")
        made = [self.value(one, item, (*place, str(k))) for k, (one, item) in enumerate(zip(kinds, value, strict=True))]
        return made if get_origin(kind) is list else tuple(made)

    def _mapping(self, inner: tuple[Any, ...], value: dict[str, Any], place: tuple[str, ...]) -> dict[str, Any]:
        for key in value:
            if inner and not _fits(inner[0], key):
                raise self.wrong((*place, key), f": {unknown(short(key), get_args(inner[0]), 'key')}")
        return {key: self.value(inner[1] if inner else Any, one, (*place, key)) for key, one in value.items()}

    def _array(self, hint: Any, value: Any, place: tuple[str, ...]) -> Any:
        try:
            if self.numbers is None or isinstance(value, np.ndarray):
                return np.array(value, dtype=np.float64)
            first, *shape = value
            return self.numbers[first : first + math.prod(shape)].reshape(shape)
        except (TypeError, ValueError):
            raise self.refused(hint, value, place) from None
