"""What `seatrial roll` and `seatrial seakeeping` do: a ship of the horizontal plane with more degrees of freedom."""

from __future__ import annotations

from pathlib import Path

from ...core.errors import WeatherError
from ...ships import Ship
from ..request import Note, RequestError, check_output, ship_of, silent


def roll(
    ship: str | Path | Ship, GM: float, KG: float, out: Path | None, *, C_m: float = 0.98,
    keels: str | None = None, note: Note = silent,
) -> Ship:  # fmt: skip
    """Add heel and roll to a ship, and write its file.

    Args:
        GM, KG: metacentric height and height of the centre of gravity above the keel [m].
        C_m: coefficient of the midship section.
        keels: breadth and length of the bilge keels [m], ``M,M``; none unless given.

    Raises:
        RequestError, ShipError: a number that no ship has, another family; nothing is written.
    """
    from ...ships.rolled import Stability, with_roll

    check_output(out, (".toml",), "a ship file")
    if not 0.5 <= C_m <= 1.0:
        raise RequestError(f"--midship is {C_m:g}; it is from 0.5 to 1")
    b, length = _keels(keels)
    made = with_roll(ship_of(ship), Stability(GM=GM, KG=KG, C_m=C_m, b_BK=b, l_BK=length))
    return _written(made, out, note)


def seakeeping(
    ship: str | Path | Ship, data: Path, out: Path | None, *, roll_damping: float | None = None, added: str = "ship",
    note: Note = silent,
) -> Ship:  # fmt: skip
    """Add heave, pitch and the memory of waves to a ship, and write its file.

    Args:
        data: added mass, damping and stiffness of its hull: .nc of Capytaine or a table, .csv.
        roll_damping, added: see `ships.at_sea.with_memory`.

    Raises:
        RequestError, ShipError, DataError, WeatherError: what cannot be used; nothing is written.
    """
    from ...environment.sea.reading import read_hydrodynamics
    from ...ships.at_sea import with_memory

    check_output(out, (".toml",), "a ship file")
    if roll_damping is not None and not 0.0 <= roll_damping < 1.0:
        raise RequestError(f"--roll-damping is {roll_damping:g}; it is a share of the critical damping, such as 0.05")
    if added not in ("ship", "data"):
        raise RequestError(f"--added is '{added}'; write ship or data")
    vessel, coefficients = ship_of(ship), read_hydrodynamics(data)
    try:
        made = with_memory(vessel, coefficients, roll_damping, added)
    except WeatherError as error:
        raise RequestError(str(error)) from None
    return _written(made, out, note)


def _written(made: Ship, out: Path | None, note: Note) -> Ship:
    from ...ships.files import save

    for line in made.notes.get("cautions", ())[-6:]:
        note(f"caution: {line}")
    if out is not None:
        save(made, out)
        note(f"wrote {out}")
    return made


def _keels(text: str | None) -> tuple[float, float]:
    if text is None:
        return 0.0, 0.0
    try:
        b, length = (float(part) for part in text.split(","))
    except ValueError:
        raise RequestError(f"--keels is '{text}'; write M,M: breadth and length of the bilge keels") from None
    if not (0.0 <= b < 5.0 and 0.0 <= length < 500.0):
        raise RequestError(f"--keels is '{text}'; a breadth below 5 m and a length below 500 m")
    return b, length
