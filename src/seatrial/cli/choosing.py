"""Commands that choose: models (families, or a recommendation for a purpose) and design (of trials)."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import options as o
from .render import emit, figure, note, say, show_table

if TYPE_CHECKING:
    from ..choosing.purposes import Advice, Purpose
    from ..choosing.survey import Assessment
    from ..identify.design.excitation import Plan

_CELL = {"planned": "–"}
_BEST, _WIDTH = 3, 150


def models(purpose: o.Purpose = None, json: o.Json = False) -> None:
    """Compare model families, or recommend one for a purpose."""
    if purpose is None:
        from ..choosing.survey import survey

        families = survey()
        emit({"families": [_document(f) for f in families]}) if json else _show(families)
        return
    from ..workflow.judging import recommend

    wanted, advice = recommend(purpose)
    emit(_advice_document(wanted, advice)) if json else _show_advice(wanted, advice)


def design(
    ship: o.ShipName, free: o.FreeParameters, budget: o.Budget = 60.0, noise: o.Noise = None,
    interval: o.Interval = None, repeats: o.Repeats = 1, json: o.Json = False,
) -> None:  # fmt: skip
    """Design sea trials that determine parameters of a ship."""
    from ..workflow.judging import design as run

    made = run(ship, free, budget=budget, noise=noise, interval=interval, repeats=repeats, note=note)
    if json:
        emit({"ship": made.ship.name, "budget": budget, "noise": made.noise, **_plan_document(made.plan)})
    else:
        _show_plan(made.ship.name, made.plan)


def _show(families: Sequence[Assessment]) -> None:
    from ..choosing import CAPABILITIES
    from ..choosing.purposes import PURPOSES

    show_table(
        ("family", "equation", "controls", "feels", "gives", "numbers", "T'", "numbers from", "ns", "ships"),
        [_row(f) for f in families], right=(5, 6, 8),
    )  # fmt: skip
    _say(
        "numbers: coefficients of the library's ships. T': length of the data that identified it, T V/L (Sawada 2024 "
        "Table 1). ns: one right-hand side",
        "and lane, measured now on one thread. All families give x, y and psi too; actuators (lag, dead time, limits) "
        "are apart from the family.",
    )
    rows = [
        (c.about, *(_CELL.get(f.findings[c.key].answer, f.findings[c.key].answer) for f in families))
        for c in CAPABILITIES
    ]
    show_table(("what it can represent", *(f.family.key for f in families)), rows)
    _say(
        "part: with a part added to the ship file. –: planned, not in the library. Answers are measured on the ships; "
        "--json says how each is known.",
        f"Next: seatrial models --for {' | '.join(p.key for p in PURPOSES)}",
    )


def _row(f: Assessment) -> tuple[str, ...]:
    family = f.family
    ships = ", ".join(f.ships) or ("planned" if not family.classes else "none yet; probed on a specimen")
    return (
        f"{family.key}: {family.name}", family.form, _controls(f), ", ".join(f.environment) or "–",
        ", ".join(f.outputs) or "–", _span(f.coefficients), _span(f.length), ", ".join(family.routes),
        figure(f.cost, 2), ships,
    )  # fmt: skip


def _controls(f: Assessment) -> str:
    kinds = dict.fromkeys(name if name in ("n_P", "delta") else f"{name.partition('_')[0]}_*" for name in f.controls)
    return ", ".join(kinds) or "–"


def _span(pair: Sequence[float] | None) -> str:
    if pair is None:
        return "–"
    return f"{pair[0]:g}" if pair[0] == pair[1] else f"{pair[0]:g}-{pair[1]:g}"


def _show_advice(purpose: Purpose, advice: Sequence[Advice]) -> None:
    _say(*textwrap.wrap(f"{purpose.title}, by Sawada 2024 (sections in brackets): {purpose.about}", _WIDTH), "")
    listed = bool(purpose.needs[0].item)
    rows = [
        (str(k), a.assessment.family.key, a.assessment.family.name, a.verdict, *([_numbers(a)] if listed else []),
         _span(a.assessment.coefficients), figure(a.assessment.cost, 2), a.reason)
        for k, a in enumerate(advice, 1)
    ]  # fmt: skip
    head = ("", "family", "", "verdict", *(["items unmet"] if listed else []), "numbers", "ns", "what they say of it")
    show_table(head, rows, right=(4 + listed, 5 + listed))
    asked = [
        (*([str(need.item or "")] if listed else []), need.about if need.item else f"{need.about} [{need.place}]",
         "must" if need.must else "wish", *(_cell(a.assessment, need.keys) for a in advice))
        for need in purpose.needs
    ]  # fmt: skip
    head = (*(["6.2"] if listed else []), "what it asks for", "", *(a.assessment.family.key for a in advice))
    show_table(head, asked)
    _say("part: with a part added to the ship file. any: apart from the family. –: planned. Best family first.")
    if purpose.simplest:
        _say(f"Simplest: {purpose.simplest}")
    _say("", "Next:", *(f"  {line}" for line in _next(purpose, advice)))


def _numbers(advice: Advice) -> str:
    whole, part = (", ".join(map(str, items)) for items in (advice.items, advice.in_part))
    return " ".join([*([whole] if whole else []), *([f"(partly {part})"] if part else [])]) or "–"


def _cell(f: Assessment, keys: Sequence[str]) -> str:
    answer = f.answer(keys) if keys and f.family.classes else "any" if f.family.classes else "planned"
    return _CELL.get(answer, answer)


def _next(purpose: Purpose, advice: Sequence[Advice]) -> list[str]:
    """Next commands: how to get the coefficients of the best families, and the check on one of their ships."""
    from ..choosing.purposes import fittest

    best = [a.assessment for a in advice[:_BEST]]
    lines = [line for f in best for line in f.family.next]
    ship = next((fittest(purpose, f) for f in best if f.ships), None)
    return [*dict.fromkeys(lines), *([purpose.check.format(ship=ship)] if ship else [])]


def _say(*lines: str) -> None:
    say("".join(f"{line}\n" for line in lines))


def _document(f: Assessment) -> dict[str, Any]:
    from ..choosing import CAPABILITIES
    from ..choosing.purposes import BERTHING, COLLISION_AVOIDANCE, unmet

    family = f.family
    return {
        "family": family.key, "name": family.name, "status": "available" if family.classes else "planned",
        "classes": list(family.classes), "form": family.form, "section": family.section, "source": family.source,
        "controls": list(f.controls), "environment": list(f.environment), "outputs": list(f.outputs),
        "coefficients": list(f.coefficients) if f.coefficients else None,
        "data": {"length": list(f.length) if f.length else None, "routes": dict(family.routes), "studies": [
            {"reference": s.reference, "parameters": list(s.parameters), "manoeuvres": s.manoeuvres,
             "length": list(s.length)} for s in f.studies]},
        "cost_ns": f.cost, "example": f.example, "ships": list(f.ships), "next": list(family.next),
        "represents": {
            c.key: {"about": c.about, "answer": f.findings[c.key].answer, "how": f.findings[c.key].how}
            for c in CAPABILITIES
        },
        **{name: {"collision-avoidance": list(unmet(f, COLLISION_AVOIDANCE, answer)),
                  "berthing": list(unmet(f, BERTHING, answer))}
           for name, answer in (("items_unmet", "no"), ("items_in_part", "partly"))},
    }  # fmt: skip


def _advice_document(purpose: Purpose, advice: Sequence[Advice]) -> dict[str, Any]:
    return {
        "purpose": purpose.key, "title": purpose.title, "about": purpose.about, "simplest": purpose.simplest,
        "next": _next(purpose, advice),
        "ranking": [
            {"family": a.assessment.family.key, "name": a.assessment.family.name, "verdict": a.verdict,
             "lacks": list(a.lacks), "partly": list(a.poor), "to_add": list(a.add), "misses": list(a.misses),
             "items_unmet": list(a.items), "items_in_part": list(a.in_part), "reason": a.reason,
             "cost_ns": a.assessment.cost,
             "coefficients": list(a.assessment.coefficients or ()), "next": list(a.assessment.family.next)}
            for a in advice
        ],
    }  # fmt: skip


def _plan_document(found: Plan) -> dict[str, Any]:
    from ..identify.design.excitation import TABLE_1

    return {
        "manoeuvres": [{"name": name, "length": length, "gain": gain} for name, length, gain in found.chosen],
        "length": found.length, "log_det": found.log_det,
        "parameters": {
            f.path: {"value": f.start, "sigma": sigma, "removed": share, "status": verdict.status}
            for f, sigma, share, verdict in zip(
                found.free, found.sigma.tolist(), found.share.tolist(), found.verdicts, strict=False
            )
        },
        "open": [{"combination": v.subject, "text": v.text} for v in found.verdicts[len(found.free) :]],
        "left_out": list(found.left_out),
        "published": [
            {"reference": p.reference, "model": p.model, "parameters": list(p.parameters),
             "manoeuvres": p.manoeuvres, "length": list(p.length)} for p in TABLE_1
        ],
    }  # fmt: skip


def _show_plan(name: str, found: Plan) -> None:
    from ..identify.design.excitation import TABLE_1

    rows = [(what, figure(length), figure(gain)) for what, length, gain in found.chosen]
    rows.append(("together", figure(found.length), figure(found.log_det)))
    show_table((f"{name}: manoeuvre", "T'", "adds to log det"), rows, right=(1, 2))
    parameters = [
        (f.path, figure(f.start), figure(sigma, 2), f"{share:.0%}", verdict.status)
        for f, sigma, share, verdict in zip(
            found.free, found.sigma.tolist(), found.share.tolist(), found.verdicts, strict=False
        )
    ]
    show_table(("parameter", "value", "expected +-", "prior removed", "status"), parameters, right=(1, 2, 3))
    for verdict in found.verdicts:
        if verdict.status != "identified":
            say(f"{verdict.subject}: {verdict.text}\n")
    published = [
        (f"[{p.reference}]", p.model, ", ".join(map(str, p.parameters)), p.manoeuvres,
         figure(p.length[0]) if p.length[0] == p.length[1] else f"{p.length[0]:g}-{p.length[1]:g}")
        for p in TABLE_1
    ]  # fmt: skip
    show_table(("Sawada 2024 Table 1", "model", "parameters", "manoeuvres", "T'"), published, right=(2, 4))
