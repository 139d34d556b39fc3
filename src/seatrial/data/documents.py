"""TOML and YAML documents, read strictly: sidecars and mapping files.

YAML is read as version 1.2: ``1:45`` and ``2024-99-99`` are texts, ``010`` is ten, and ``no`` is a text.
A key given twice is refused, as the last one would silently win; so are anchors and aliases, by which
a few lines become gigabytes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from ..core import files
from ..core.records import filled, of_schema
from . import DataError
from .table import existing

T = TypeVar("T")

LARGEST = 1_000_000
"""Bytes of a document at most."""

_LARGEST_YAML = 200_000
"""Bytes of a YAML document at most; its reader takes ten seconds for a megabyte."""

_DIGITS = 19
"""Digits of a whole number at most, as many as nanoseconds since 1970 have."""


def read_toml(path: str | Path) -> dict[str, Any]:
    """The tables of a TOML file, its numbers as `core.files.read_toml` takes them.

    Raises:
        DataError: no such file, not TOML, too large or too deep, a number out of reach.
    """
    return _read(existing(path), "TOML", files.read_toml)


def read_yaml(path: str | Path) -> dict[str, Any]:
    """The keys of a YAML file of one mapping.

    Raises:
        DataError: no such file, not YAML, no mapping, a key twice, an anchor or an alias, too large or too deep.
    """
    return _read(existing(path), "YAML", lambda here: _yaml(here.read_text(encoding="utf-8")), _LARGEST_YAML)


def read_json(path: str | Path) -> dict[str, Any]:
    """A JSON file of keys with values.

    Raises:
        DataError: no such file, not JSON, too large or too deep, a number that is none.
    """
    return _read(existing(path), "JSON", lambda here: json.loads(
        here.read_text(encoding="utf-8"), parse_constant=_no_number, parse_int=_integer))  # fmt: skip


def _integer(text: str) -> int:
    if len(text) > _DIGITS + 1:
        raise DataError(f"a number of {len(text)} digits; {_DIGITS} are the most")
    return int(text)


def _no_number(text: str) -> Any:
    raise DataError(f"{text} is no number of JSON; leave the key out")


def yaml_text(said: Mapping[str, Any]) -> str:
    """Plain values as YAML that `read_yaml` reads back as the same."""
    import yaml

    return yaml.dump(dict(said), Dumper=_dumper(), sort_keys=False, allow_unicode=True, width=100)


def _read(here: Path, kind: str, parse: Callable[[Path], Any], most: int = LARGEST) -> dict[str, Any]:
    try:
        if not here.is_file():
            raise DataError(f"{here}: not readable as {kind}: not a file")
        if here.stat().st_size > most:
            raise DataError(f"{here}: {here.stat().st_size} bytes; {most} are the most of such a file")
        said = parse(here)
        _refuse_surrogates(said)
    except DataError as error:
        about = str(error)
        raise DataError(about if str(here) in about else f"{here}: {about}") from None
    except RecursionError:
        raise DataError(f"{here}: not readable as {kind}: nested too deeply") from None
    except OSError as error:
        raise DataError(f"{here}: not readable as {kind}: {error.strerror}") from None
    except ValueError as error:  # also for numbers and for bytes that are not text
        raise DataError(f"{here}: not readable as {kind}: {_line(error)}") from None
    if not isinstance(said, dict):
        raise DataError(f"{here}: must be keys with values, such as 'ship: kvlcc2'")
    return cast("dict[str, Any]", said)


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__


def _refuse_surrogates(said: Any) -> None:
    """Refuse texts with lone surrogates, at any depth."""
    if isinstance(said, dict):
        for value in cast("dict[Any, Any]", said).values():
            _refuse_surrogates(value)
    elif isinstance(said, list):
        for value in cast("list[Any]", said):
            _refuse_surrogates(value)
    elif isinstance(said, str):
        said.encode()


def _yaml(text: str) -> Any:
    import yaml

    if yaml.__with_libyaml__:  # six times as fast; what it refuses the other reads again, for its words
        with suppress(yaml.YAMLError):
            return yaml.load(text, Loader=_loader(True))
    try:
        return yaml.load(text, Loader=_loader(False))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise DataError(f"line {mark.line + 1 if mark else 1}: not YAML ({error.problem})") from None
    except yaml.YAMLError as error:
        raise DataError(f"line 1: not YAML ({_line(error)})") from None


_CORE = (
    ("bool", r"(?:true|True|TRUE|false|False|FALSE)", "tTfF"),
    ("int", r"[-+]?[0-9]+", "-+0123456789"),
    ("float", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
     "-+0123456789."),
    ("null", r"(?:~|null|Null|NULL|)", "~nN"), ("null", "", ("",)),
)  # fmt: skip
"""Core schema of YAML 1.2: kind of a plain scalar, its form, and its possible first characters."""


def _resolving(base: Any) -> Any:
    """A loader or dumper class that also resolves plain scalars by the core schema."""
    made = type("Core", (base,), {})
    for tag, form, first in _CORE:
        made.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(f"^(?:{form})$", re.ASCII), list(first))
    return made


@cache
def _dumper() -> Any:
    import yaml

    # its own resolvers of YAML 1.1 stay: a text that either version takes for a number is quoted
    return _resolving(yaml.SafeDumper)


@cache
def _loader(quick: bool) -> Any:
    """A loader of one document without anchors, whose scalars are those of YAML 1.2; quick by libyaml."""
    import yaml

    whole: Any = yaml
    reader = whole.CSafeLoader if quick else whole.SafeLoader
    # in C, nodes would be composed past the refusal of anchors
    base: Any = type("Reader", (whole.composer.Composer, reader), {}) if quick else reader

    class Plain(base):
        def __init__(self, text: str) -> None:
            reader.__init__(self, text)
            self.anchors: Any = {}

        yaml_implicit_resolvers: Any = {}  # noqa: RUF012 -- as in PyYAML

        def compose_node(self, parent: Any, index: Any) -> Any:
            event: Any = self.peek_event()
            if getattr(event, "anchor", None):  # an alias names it too
                raise _wrong("anchors and aliases are not read; write the value out", event)
            return super().compose_node(parent, index)

        def construct_yaml_map(self, node: Any) -> Any:
            seen: dict[str, Any] = {}
            for key, value in node.value:
                if not isinstance(key, yaml.ScalarNode):
                    raise _wrong("a key is a plain text", key)
                if key.value in seen:
                    raise _wrong(f"key '{key.value[:40]}' twice; keep one", key)
                seen[key.value] = self.construct_object(value, deep=True)
            return seen

    made = _resolving(Plain)
    made.add_constructor("tag:yaml.org,2002:map", Plain.construct_yaml_map)
    for tag, construct in (("int", _whole), ("bool", _truth), ("float", _decimal)):
        made.add_constructor(f"tag:yaml.org,2002:{tag}", construct)
    return made


def _whole(_: Any, node: Any) -> int:
    if len(node.value.lstrip("+-0")) > _DIGITS:
        raise _wrong(f"a whole number of more than {_DIGITS} digits", node)
    return int(node.value)


def _truth(_: Any, node: Any) -> bool:
    return node.value.lower() == "true"


def _decimal(_: Any, node: Any) -> float:
    return float(re.sub(r"\.(?=[iInN])", "", node.value))


def _wrong(what: str, node: Any) -> Exception:
    import yaml

    return yaml.constructor.ConstructorError(None, None, what, node.start_mark)


def read_keys(path: str | Path, kind: type[T], schema: str) -> T:
    """A TOML file as a frozen dataclass, its keys and types taken from the fields; see `core.records.filled`.

    Raises:
        DataError: not TOML, another schema, an unknown key (the near ones are named), a missing one, a wrong type.
    """
    return filled(kind, of_schema(read_toml(path), schema, path, DataError), path, DataError)
