"""Classes that a file names: one module a stem, at whatever depth of its room."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from seatrial import forces
from seatrial.forces import body, hull, propeller, rudder, thruster
from seatrial.ships import ShipError
from seatrial.ships.classes import _listed, find_class
from seatrial.ships.files import role_of


@pytest.fixture
def beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose modules are of the room of forces, as a contribution of its own would be."""
    monkeypatch.setattr(forces, "__path__", [*forces.__path__, str(tmp_path)])
    yield tmp_path
    _listed.cache_clear()


def test_a_new_stem_is_found_at_once(beside: Path) -> None:
    text = "from dataclasses import dataclass\n\n\n@dataclass(frozen=True)\nclass Sail:\n    area: float\n"
    (beside / "sail_of_a_test.py").write_text(text)
    assert find_class("sail_of_a_test:Sail", "forces", "[extras.sail]").__name__ == "Sail"


def test_two_modules_of_one_stem_are_refused(beside: Path) -> None:
    folder = beside / "old"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "rudder.py").touch()
    _listed.cache_clear()
    names = (
        r"seatrial\.forces\.old\.rudder and seatrial\.forces\.rudder|seatrial\.forces\.rudder and seatrial\.forces\.old"
    )
    with pytest.raises(ShipError, match=f"({names}).* have one name.*rename one"):
        find_class("rudder:Standard", "forces", "[rudder]")


@pytest.mark.parametrize(("cls", "role"), [
    (hull.Polynomial, "force"), (propeller.Standard, "propeller"), (rudder.Standard, "rudder"),
    (thruster.Tunnel, "thruster"), (body.Body, ""), (int, ""),
])  # fmt: skip
def test_what_a_part_is_follows_from_what_its_force_takes_and_gives(cls: type, role: str) -> None:
    assert role_of(cls) == role


def test_what_acts_by_its_own_control_is_derived_from_a_thruster() -> None:
    class Sail:
        def force(self, flow: object, control: object) -> None: ...

    assert role_of(Sail) == "class not derived from forces.ThrusterModule"
