"""The page inside a co-simulation slave: what it is, what goes in and out, and every number with its source."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from .fmu_layout import Layout, Real


def page(made: Layout) -> str:
    """documentation/index.html."""
    title = escape(made.plant.title)
    moves = "a right-hand side, by the Runge-Kutta method of fourth order" if made.network is None else (
        "a network; body accelerations are those over its last sample")  # fmt: skip
    return "\n".join([
        "<!DOCTYPE html>", f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title></head><body>',
        f"<h1>{title}</h1>",
        f"<p>Written by seatrial. Internal step {made.step:g} s; it moves by {moves}. SI units and radians; forces and "
        "velocities are those of midship, ahead, to starboard and turning to starboard positive; wind and waves have "
        "the direction they come from. It needs the C library and nothing else.</p>",
        *_table("Outputs", made.outputs), *_table("Inputs", made.inputs),
        *_table("Parameters", (*made.numbers, *made.servos, *made.starts)), "</body></html>", "",
    ])  # fmt: skip


def _table(title: str, reals: Sequence[Real]) -> list[str]:
    rows = [f"<tr><td>{escape(r.name)}</td><td>{escape(r.unit)}</td><td>{escape(r.about)}</td>"
            f"<td>{f'{r.start:g}' if r.causality != 'output' else ''}</td></tr>" for r in reals if r.shown]  # fmt: skip
    head = "<table><tr><th>name</th><th>unit</th><th>meaning</th><th>start</th></tr>"
    return [f"<h2>{title}</h2>", head, *rows, "</table>"]
