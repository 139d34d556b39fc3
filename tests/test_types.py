"""docs/types.md: every family and type that a ship file may name, as the code has them."""

from __future__ import annotations

import importlib.util
import tomllib
from pathlib import Path
from typing import Any

import pytest

from seatrial.core.parameters import spec
from seatrial.forces.thruster_fixed import Screw
from seatrial.ships.classes import find_class
from seatrial.ships.files import role_of

ROOT = Path(__file__).parents[1]
_SPEC: Any = importlib.util.spec_from_file_location("make_types", ROOT / "docs" / "make_types.py")
make: Any = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(make)
PAGE = (ROOT / "docs" / "types.md").read_text(encoding="utf-8")
SCREW = "thruster_fixed:Screw"
CODE = make.page()
SHIPS = sorted((ROOT / "src" / "seatrial" / "ships").glob("*.toml"))


@pytest.mark.slow
def test_what_the_page_says_is_so_in_the_code() -> None:
    """A type that comes is added when a version is made; one that changed, or went, makes the page wrong at once."""
    code = make.sections(make.page())
    wrong = [heading for heading, text in make.sections(PAGE).items() if code.get(heading) != text]
    assert not wrong, "run python docs/make_types.py"


@pytest.mark.slow
def test_a_number_that_comes_or_changes_makes_the_page_stale(monkeypatch: pytest.MonkeyPatch) -> None:
    meaning = Screw.__dataclass_fields__["T_nu"].metadata["spec"]
    monkeypatch.setattr(Screw.__dataclass_fields__["T_nu"], "metadata", spec(meaning.unit, "another meaning").metadata)
    now = make.sections(make.page())
    assert [heading for heading, text in make.sections(PAGE).items() if now[heading] != text] == [f"### `{SCREW}`"]


@pytest.mark.parametrize("path", SHIPS, ids=lambda path: path.stem)
def test_every_type_of_the_library_has_its_section(path: Path) -> None:
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    named = [document["family"]] if "family" in document else []
    tables = [t for key, t in document.items() if key != "actuators" and isinstance(t, dict)]
    tables += [own for t in tables for own in t.values() if isinstance(own, dict)]
    named += [t["type"] for t in tables if isinstance(t.get("type"), str)]
    for name in named:
        assert f"### `{name.rpartition('.')[2]}`\n" in CODE, name


@pytest.mark.slow
def test_every_section_can_be_named_in_a_file() -> None:
    headings = [line.split("`")[1] for line in CODE.splitlines() if line.startswith("### `") and ":" in line]
    assert len(headings) == len(set(headings))
    roles = {role for name in headings for room in ("forces", "models")
             if (role := _role(name, room)) is not None}  # fmt: skip
    assert {"force", "propeller", "rudder", "thruster"} <= roles


def _role(name: str, room: str) -> str | None:
    from seatrial.ships import ShipError

    try:
        return role_of(find_class(name, room, "types.md"))
    except ShipError:
        return None
