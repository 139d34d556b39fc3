"""Write types.md: every family and type that a ship file may name, from the classes themselves.

The site always has the page of the code (docs/site/generate.py).  The file is written anew before a release: until then
it may lack a type, or the ships that have one, so that whoever adds a force adds one file; what it says is never wrong.
"""

from __future__ import annotations

import importlib
import inspect
import math
import pkgutil
import re
import typing
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import Path
from typing import Any

import seatrial as st

PAGE = Path(__file__).parent / "types.md"

TITLES = {
    "force": "Forces: hull, damping, wind, waves and further ones", "propeller": "Propellers", "rudder": "Rudders",
    "thruster": "Thrusters",
}  # fmt: skip
HEAD = """# Types

*Written by `docs/make_types.py` from the code.* Every family and type that a ship file may name, with the numbers
that each takes. How a file is put together is in [extending.md](extending.md), what the families mean in
[models.md](models.md); `seatrial copy SHIP FILE` writes a library ship as a complete file to edit.

A number is written `{ value = ..., unit = "...", source = "..." }`, or with `prime` in place of `value` and `unit`
where it is made non-dimensional by 0.5 rho L d U^2 and its like. **required** has no default; "any" is a number without
limits. A unit of `'` is that of a primed number.
"""
NUMBERS = "\n| key | meaning | unit | range | default |\n|---|---|---|---|---|\n"


def sections(text: str) -> dict[str, str]:
    """The sections of a page by their headings, without the ships that have the type."""
    parts = re.split(r"^(#{1,3} .*)$", text, flags=re.MULTILINE)
    bodies = (re.sub(r"\nIn the library: .*\n", "", body).strip() for body in parts[2::2])
    return dict(zip(parts[1::2], bodies, strict=True))


def classes(room: Any) -> Iterator[type]:
    """The dataclasses that the modules of a room define."""
    for found in pkgutil.walk_packages(room.__path__, f"{room.__name__}."):
        module = importlib.import_module(found.name)
        yield from (cls for cls in vars(module).values()
                    if inspect.isclass(cls) and is_dataclass(cls) and cls.__module__ == module.__name__)  # fmt: skip


def families() -> list[type]:
    """Every family, by name."""
    found = [cls for cls in classes(st.models) if issubclass(cls, st.models.Model) and not inspect.isabstract(cls)]
    return sorted(found, key=name_of)


def components() -> dict[str, list[type]]:
    """Every component by its role, then by name."""
    found: dict[str, list[type]] = {role: [] for role in TITLES}
    for cls in sorted((cls for room in (st.forces, st.models) for cls in classes(room)), key=name_of):
        if st.role_of(cls) in found and not issubclass(cls, st.models.Model) and not inspect.isabstract(cls):
            found[st.role_of(cls)].append(cls)
    return found


def bodies() -> list[type]:
    """Classes that a family has as a part by default and that are no force: bodies, inertias, derivatives."""
    wanted = {hint for cls in families() for f in fields(cls) for hint in _hints(cls, f)}
    known = {one for some in components().values() for one in some}
    inside = {cls for room in (st.forces, st.models) for cls in classes(room)}
    return sorted({cls for cls in inside if wanted & set(cls.__mro__)} - known, key=name_of)


def name_of(cls: type) -> str:
    """How a ship file writes it."""
    return f"{cls.__module__.rpartition('.')[2]}:{cls.__name__}"


def page() -> str:
    """The whole page."""
    used = _used()
    parts = [HEAD, "\n## Families\n\nA family is named by `family`; its own numbers stand in `[model]`.\n",
             *(_section(cls, used, _tables(cls)) for cls in families()),
             "\n## Bodies and derivatives\n\nThe usual class of a table needs no `type`.\n",
             *(_section(cls, used) for cls in bodies())]  # fmt: skip
    for role, some in components().items():
        parts += [f"\n## {TITLES[role]}\n", *(_section(cls, used, _controls(cls)) for cls in some)]
    return "".join([*parts, _actuators()])


def _section(cls: type, used: dict[str, list[str]], more: str = "") -> str:
    ships = used.get(name_of(cls), [])
    where = f"\nIn the library: {', '.join(f'`{name}`' for name in ships)}.\n" if ships else ""
    return f"\n### `{name_of(cls)}`\n\n{_about(cls)}\n{more}{where}{_numbers(list(fields(cls)))}"


def _about(cls: type) -> str:
    """Its docstring in Markdown, without the list of attributes; literal text stays literal."""
    text = (inspect.getdoc(cls) or "").partition("\nAttributes:")[0].strip()
    text = text.replace("<", "&lt;").replace("``", "`")
    return re.sub(r"(?<!`)\*(?!`)", r"\\*", text)


def _tables(cls: type) -> str:
    """The tables that a family takes."""
    rows: list[str] = []
    for f in fields(cls):
        if "spec" in f.metadata or "choice" in f.metadata:
            continue
        needed = "required" if f.default is MISSING and f.default_factory is MISSING else "may be left out"
        own = f"[{f.name}.NAME]" if "parts" in f.metadata else f"[{f.name}]"
        rows.append(f"| `{own}` | {_takes(cls, f)} | {needed} |\n")
    return f"\n| table | takes | |\n|---|---|---|\n{''.join(rows)}" if rows else ""


def _takes(cls: type, f: Field[Any]) -> str:
    if "parts" in f.metadata:
        return f"any number of components: a {f.metadata['parts']} each"
    if "terms" in f.metadata:
        return "numbers named by their term, such as those of the library"
    if "network" in f.metadata:
        return "a network, see [networks.md](networks.md)"
    hints = _hints(cls, f)
    roles = [st.ROLES[hint.__name__] for hint in hints if hint.__name__ in st.ROLES]
    return f"a {roles[0]}" if roles else ", ".join(f"`{name_of(hint)}`" for hint in hints) or "see above"


def _hints(cls: type, f: Field[Any]) -> list[type]:
    hint = typing.get_type_hints(cls)[f.name]
    return [one for one in (typing.get_args(hint) or (hint,))
            if inspect.isclass(one) and one not in (type(None), float, str, int, st.parameters.Parts)
            and one.__module__.startswith("seatrial.") and "spec" not in f.metadata]  # fmt: skip


def _controls(cls: Any) -> str:
    prefixes = getattr(cls, "prefixes", ())
    if not prefixes:
        return ""
    return f"\nControls of a part called NAME: {', '.join(f'`{prefix}_NAME`' for prefix in prefixes)}.\n"


def _numbers(own: list[Field[Any]]) -> str:
    rows = [_row(f.name, f.metadata["spec"], f.default) for f in own if "spec" in f.metadata]
    for f in own:
        if "choice" in f.metadata:
            about, options = f.metadata["choice"]
            values = " or ".join(f'"{one}"' for one in options)
            rows.append(f"| `{f.name}` | {_plain(about)} | text | {values} | \"{f.default}\" |\n")
    return NUMBERS + "".join(rows) if rows else ""


def _row(name: str, meaning: st.parameters.Spec, default: Any) -> str:
    low, high = meaning.low, meaning.high
    span = "any" if math.isinf(low) and math.isinf(high) else f"{_end(low)} to {_end(high)}"
    said = "**required**" if default is MISSING else _end(float(default))
    return f"| `{name}` | {_plain(meaning.about)} | {meaning.unit or '–'} | {span} | {said} |\n"


def _end(value: float) -> str:
    return ("no limit" if value > 0 else "no lower limit") if math.isinf(value) else f"{value:.6g}"


def _plain(text: str) -> str:
    return text.replace("|", "&#124;").replace("<", "&lt;").replace("*", "\\*")


def _actuators() -> str:
    text = (
        "\n## Actuators\n\nEach control may have a table `[actuators.NAME]`: `rudder` and `propeller` for `delta` and "
        "`n_P`,\nany other by the name of its control. Units below are those of a rudder and, for a shaft, of a "
        "propeller.\n"
    )
    for name, kind in st.actuation.KINDS.items():
        meanings = st.actuation.meanings(kind, "n_P" if name == "Shaft" else "delta")
        rows = [_row(key, meaning, next(f.default for f in fields(kind) if f.name == key))
                for key, meaning in meanings.items()]  # fmt: skip
        usual = "(without a `type`)" if name == st.actuation.USUAL else ""
        text += f"\n### `{name}` {usual}".rstrip() + f"\n\n{_about(kind)}\n" + NUMBERS + "".join(rows)
    return text


def _used() -> dict[str, list[str]]:
    """Ships of the library by the types that they name."""
    found: dict[str, list[str]] = {}
    for ship in st.library():
        for name in dict.fromkeys(name_of(type(part)) for part in _within(st.load(ship).model)):
            found.setdefault(name, []).append(ship)
    return found


def _within(model: Any) -> Iterator[Any]:
    yield model
    for part in vars(model).values():
        if isinstance(part, st.parameters.Parts):
            yield from part.components
        elif is_dataclass(part):
            yield part


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
