"""Conformance suite of force modules, model families, manoeuvres and formats of logs, to run on new ones too.

Contract: a check takes one subject, raises `ContractError` with what is wrong, and returns None, or in one line why it
does not apply.  From a test of your own::

    from seatrial.testing import Part, check_force, check_manoeuvre, check_ship

    def test_my_hull():
        check_force(Part(MyHull(area=2.0), rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0))

    def test_my_ship():
        check_ship(load("mine.toml", trust=("my_models",)))

    def test_my_manoeuvre():
        check_manoeuvre(Weave, load("kvlcc2_l7"))

    def test_my_format():
        check_format(Log(my_format, Path("short.log").read_text()))

`FORCE_CHECKS`, `SHIP_CHECKS`, `MANOEUVRE_CHECKS` and `FORMAT_CHECKS` are the checks by name, `ships`, `force_modules`,
`manoeuvres` and `log_examples` what the package itself is checked on.
"""

from __future__ import annotations

from ..manoeuvres import Manoeuvre
from ..ships import Ship
from .discovery import ContractError, Part, classes_of, force_modules, parts_of, ships
from .forces import FORCE_CHECKS, untried_forces
from .logs import FORMAT_CHECKS, Log, log_examples
from .manoeuvres import MANOEUVRE_CHECKS, manoeuvres
from .models import SHIP_CHECKS, untried_families

__all__ = [
    "FORCE_CHECKS", "FORMAT_CHECKS", "MANOEUVRE_CHECKS", "SHIP_CHECKS", "ContractError", "Log", "Part",
    "check_force", "check_format", "check_manoeuvre", "check_ship", "classes_of", "force_modules", "log_examples",
    "manoeuvres", "parts_of", "ships", "untried_families", "untried_forces",
]  # fmt: skip


def check_force(part: Part) -> None:
    """Run every check on a force module; `part` gives the size of the ship that it is tried on.

    Raises:
        ContractError: it breaks the contract of `seatrial.forces`.
    """
    for check in FORCE_CHECKS.values():
        check(part)


def check_ship(ship: Ship) -> None:
    """Run every check on the model of a ship and on its force modules.

    Raises:
        ContractError: it breaks the contract of `seatrial.models` or of `seatrial.forces`.
    """
    for check in SHIP_CHECKS.values():
        check(ship)
    for _, part in parts_of(ship):
        check_force(part)


def check_manoeuvre(cls: type[Manoeuvre], ship: Ship) -> None:
    """Run every check on a manoeuvre, ordered with its usual settings for a ship that can run it.

    Raises:
        ContractError: it breaks the contract of `seatrial.manoeuvres`.
    """
    for check in MANOEUVRE_CHECKS.values():
        check(cls, ship)


def check_format(log: Log) -> None:
    """Run every check on a format of logs.

    Raises:
        ContractError: it breaks the contract of `seatrial.data.formats`.
        DataError: it cannot read its own example.
    """
    for check in FORMAT_CHECKS.values():
        check(log)
