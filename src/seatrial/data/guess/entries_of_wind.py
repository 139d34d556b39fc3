"""Entries of the wind in a mapping file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from .answers import ASK, Answer, Entry, quoted
from .roles import Signal
from .wind import WindVerdict, differences


def wind_entries(
    found: Mapping[str, Signal], pair: tuple[str, str], verdict: WindVerdict
) -> Iterator[Entry]:
    """Entries of one wind, with the evidence and a doubt for each reading that fits about as well.

    Args:
        found: quantities of the log.
        pair: roles of its speed and its direction.
        verdict: how it is read.
    """
    best, rival, close = verdict.best, verdict.rival, verdict.close
    speed, direction = found[pair[0]], found[pair[1]]
    evidence = f"{speed.column.said} and {direction.column.said}; {'apparent, from the bow' if best.relative else 'true, from north'}"
    evidence += f", where it {'goes to' if best.towards else 'comes from'}"
    if rival is not None and not close:
        evidence += (f"; the true wind would change by {best.miss:.0%} of itself, and by {rival.miss:.0%} if "
                     f"{' and '.join(differences(best, rival))}")  # fmt: skip
    doubts = [f"it may also be {said[0]}; nothing in the log decides" for one in close if len(said := differences(best, one)) == 1]
    unit = best.unit
    if not speed.unit and any(one.unit != unit for one in close):
        unit = ASK
        doubts.append("nothing shows the unit of its speed; write m/s or kn in place of ?")
    answer = Answer(evidence, tuple(dict.fromkeys(doubts)))
    file = {"file": quoted(speed.file)} if speed.file else {}
    if best.relative and not best.towards and best.side > 0:
        keys = {"speed": quoted(speed.column.head), "direction": quoted(direction.column.head), "unit": quoted(unit),
                "direction_unit": quoted(best.angle)}  # fmt: skip
        if direction.column.letters:
            sides = (f"{one} = {-1 if one[0] in 'PpLlBb' else 1}" for one in direction.column.letters)
            keys["letters"] = f"{{ {', '.join(sides)} }}"
        yield Entry("apparent", keys | file, answer)
        return
    names = ("U_A", "gamma_A") if best.relative else ("U_T", "gamma_T")
    yield Entry(f"channels.{names[0]}", {"column": quoted(speed.column.head), "unit": quoted(unit), **file}, answer)
    more = {"sign": "-1"} if best.side < 0 else {}
    more |= {"offset": "180.0" if best.angle == "deg" else f"{np.pi:.12g}"} if best.towards else {}
    keys = {"column": quoted(direction.column.head), "unit": quoted(best.angle), **more, **file}
    yield Entry(f"channels.{names[1]}", keys)
