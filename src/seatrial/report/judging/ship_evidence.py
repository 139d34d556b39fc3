"""Page of evidence for a ship file: what was checked, published indices beside simulated ones, two manoeuvres."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.values import asdict, dataclass
from ...data import Trial
from ...ships import Ship
from .. import figures
from ..blocks import Body, bullets, fields, figure, gallery, lead, number, soft, table
from ..page import Page, Section

_DEGREES = math.degrees(1.0)


@dataclass(frozen=True)
class Row:
    """A published index, both values with their unit in words."""

    manoeuvre: str
    settings: Mapping[str, Any]
    index: str
    published: str
    simulated: str
    ratio: float
    within: float
    kept: bool
    source: str


def page(
    ship: Ship, findings: Sequence[tuple[str, str, str]], rows: Sequence[Row], runs: Mapping[str, Trial]
) -> Page:  # fmt: skip
    """The whole page.

    Args:
        findings: check, state ("ok", "note", "error") and detail.
        runs: of the kinds turning and zigzag, as far as the ship runs them.
    """
    wrong = [one for one in findings if one[1] == "error"]
    kept = sum(row.kept for row in rows)
    compared = f"{kept} of {len(rows)} published indices reproduced" if rows else "no published index to compare with"
    answer = f"{len(findings)} checks, {len(wrong)} against the ship; {compared}."
    against = bullets(f"{what}: {detail}" for what, _, detail in wrong) if wrong else ()
    first = Section("", fields({"ship": ship.name, "fit": not wrong}, lead(answer) + against))
    sections = (first, _published(rows), _drawn(ship, runs), _checks(findings), _about(ship))
    return Page(f"Evidence for {ship.name}", sections)


def _published(rows: Sequence[Row]) -> Section:
    said = [(", ".join([row.manoeuvre, *(f"{key} {value}" for key, value in row.settings.items())]),
             row.index.replace("_", " "), row.published, row.simulated, number(row.ratio), f"±{100 * row.within:g} %",
             "yes" if row.kept else "no", row.source) for row in rows]  # fmt: skip
    head = ("manoeuvre", "index", "published", "simulated", "ratio", "asked", "kept", "source")
    body = table(head, said, words=(0, 1, 6, 7)) if rows else ()
    return Section("Published indices", fields({"published": [asdict(row) for row in rows]}, body))


def _drawn(ship: Ship, runs: Mapping[str, Trial]) -> Section:
    drawn: list[Body] = []
    if "turning" in runs:
        run = runs["turning"]
        fig, (ax,) = figures.canvas(1)
        ax.plot(run["y"] / ship.L_pp, run["x"] / ship.L_pp, color=figures.BLUE)
        ax.set(xlabel="east / L_pp [-]", ylabel="north / L_pp [-]", aspect="equal")
        drawn.append(figure(figures.svg(fig, "turn"), "Turning circle to starboard, north up"))
    if "zigzag" in runs:
        run = runs["zigzag"]
        fig, (ax,) = figures.canvas(1)
        ax.plot(run.t, run["psi"] * _DEGREES, color=figures.BLUE, label="heading")
        if "delta" in run:
            ax.plot(run.t, run["delta"] * _DEGREES, "--", color=figures.VERMILION, label="rudder")
        ax.set(xlabel="t [s]", ylabel="angle [°], starboard positive")
        ax.legend()
        drawn.append(figure(figures.svg(fig, "zigzag"), "Zigzag 10/10"))
    return Section("Manoeuvres", gallery(*drawn) if drawn else soft("It runs neither a turning circle nor a zigzag."))


def _checks(findings: Sequence[tuple[str, str, str]]) -> Section:
    shown = table(("check", "", "found"), findings, words=(0, 1, 2), wide=True)
    said = [{"check": a, "state": b, "found": c} for a, b, c in findings]
    return Section("Checks", fields({"checks": said}, shown))


def _about(ship: Ship) -> Section:
    said = [str(one) for key in ("references", "cautions") for one in _listed(ship.notes.get(key, ()))]
    return Section("References and cautions", bullets(said) if said else ())


def _listed(said: Any) -> Sequence[Any]:
    return [said] if isinstance(said, str) else said
