"""The command estimate: a ship from its particulars, and a table of where its numbers come from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..ships.estimate import Estimate, Number
from ..ships.estimate import estimate as make
from ..ships.files import save
from ..ships.formulas import NONE, UNPUBLISHED
from .support import UsageError, emit, figure, note, show_table

HEAD = ("number", "value", "unit", "formula", "range", "other formulas", "spread", "sigma")


def estimate(particulars: Path, out: Path, json: bool) -> None:
    """Estimate the ship, write it, and show each number with its formula, range and spread.

    Raises:
        UsageError: an output that is no ship file or would replace the particulars.
        ShipError: particulars that cannot be used; nothing is written.
    """
    if out.suffix != ".toml":
        raise UsageError(f"{out}: a ship file ends in .toml")
    if not out.parent.is_dir():
        raise UsageError(f"{out}: no such folder: {out.parent}")
    if out.exists() and particulars.exists() and out.samefile(particulars):
        raise UsageError(f"{out}: holds the particulars themselves; choose another file with -o")
    made = make(particulars)
    save(made.ship, out)
    for line in made.cautions:
        note(f"warning: {line}")
    note(f"wrote {out}")
    if json:
        emit(_document(made, out))
    else:
        show_table(HEAD, (_row(item) for item in made.numbers), right=(1, 6, 7))


def _row(item: Number) -> tuple[str, ...]:
    others = ", ".join(f"{name} {figure(value)}" for name, value in item.others.items())
    state = "; ".join(item.outside) or {"": "–", UNPUBLISHED: "ok (of compared ships)", NONE: "not published"}.get(
        item.basis, "ok"
    )
    return (
        item.path, figure(item.value), item.unit or "–", item.formula, state, others or "–",
        figure(item.spread, 2), figure(item.sigma, 2),
    )  # fmt: skip


def _document(made: Estimate, out: Path) -> dict[str, Any]:
    return {
        "ship": made.ship.name, "file": out, "cautions": list(made.cautions),
        "numbers": {
            item.path: {
                "value": item.value, "unit": item.unit, "formula": item.formula, "in_range": not item.outside,
                "outside": list(item.outside), "range_from": item.basis, "others": dict(item.others),
                "spread": item.spread, "sigma": item.sigma, "source": made.ship.entries[item.path].source,
            }
            for item in made.numbers
        },
    }  # fmt: skip
