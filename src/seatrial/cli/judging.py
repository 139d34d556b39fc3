"""Commands that choose and judge: models, design (of trials), imo, requirements."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..report.blocks import Body, bullets, fields, line, table
from ..workflow.asked import Bands, Draws
from . import options as o
from .render import answer, figure, note

if TYPE_CHECKING:
    from ..choosing.purposes import Advice, Purpose
    from ..choosing.survey import Assessment
    from ..identify.design.excitation import Plan
    from ..workflow.evidence.designed import Foreseen

_CELL = {"planned": "–"}
_BEST, _WIDTH = 3, 150


def models(purpose: o.Purpose = None, json: bool = False) -> None:
    """Compare model families, or recommend one for a purpose."""
    if purpose is None:
        from ..choosing.survey import survey

        answer(_families(survey()), json)
        return
    from ..workflow.judging import recommend

    wanted, advice = recommend(purpose)
    answer(_advised(wanted, advice), json)


def design(
    ship: o.ShipName, free: o.FreeParameters, budget: o.Budget = 60.0, noise: o.Noise = None,
    interval: o.Interval = None, repeats: o.Repeats = 1, *, bands: Draws, json: bool = False,
) -> None:  # fmt: skip
    """Design sea trials that determine parameters of a ship."""
    from ..workflow.judging import design as run

    made = run(ship, free, budget=budget, noise=noise, interval=interval, repeats=repeats, bands=bands,
               note=note)  # fmt: skip
    body = _planned(made.ship.name, made.plan)
    body += () if bands.level is None else _foreseen(made.foreseen, bands.level)
    answer(fields({"ship": made.ship.name, "budget": budget, "noise": made.noise}, body), json)


def _foreseen(found: Sequence[Foreseen], level: float) -> Body:
    from ..workflow.evidence.designed import document

    rows = [(one.name, one.unit, figure(one.value), *map(figure, (*one.before, *one.after)), f"{one.share:.0%}")
            for one in found]  # fmt: skip
    head = ("index", "unit", "value", "before: from", "to", "after: from", "to", "width left")
    drawn = table(head, [tuple("–" if cell == "nan%" else cell for cell in row) for row in rows], words=(1,))
    said = (f"bands of {level:g} % by what is open about the free parameters, without and with these trials; a dash: "
            "too few draws give the index")  # fmt: skip
    return fields({"bands": document(found, level)}, drawn + line(said))


def imo(
    ship: o.ShipName, out: o.Page = None, *, bands: Bands, json: bool = False
) -> None:
    """Judge a ship by the criteria of IMO MSC.137(76)."""
    from ..report.judging.imo import brief
    from ..workflow.judging import imo as run

    answer(brief(run(ship, out, note, bands=bands)), json)


def requirements(
    ship: o.ShipName, scope: o.Scope = "collision-avoidance", out: o.Page = None, *, bands: Draws, json: bool = False
) -> None:
    """Judge a ship by the requirements of Sawada 2024 section 6."""
    from ..report.judging.requirements import brief
    from ..workflow.judging import requirements as run

    answer(brief(run(ship, scope, out, note, bands=bands)), json)


def _families(families: Sequence[Assessment]) -> Body:
    from ..choosing import CAPABILITIES
    from ..choosing.purposes import PURPOSES

    body = table(
        ("family", "equation", "controls", "feels", "gives", "numbers", "T'", "numbers from", "ns", "ships"),
        [_row(f) for f in families], words=(1, 2, 3, 4, 7, 9),
    ) + bullets((
        "numbers: coefficients of the library's ships. T': length of the data that identified it, T V/L (Sawada 2024 "
        "Table 1). ns: one right-hand side",
        "and lane, measured now on one thread. All families give x, y and psi too; actuators (lag, dead time, limits) "
        "are apart from the family.",
    ))  # fmt: skip
    rows = [
        (c.about, *(_CELL.get(f.findings[c.key].answer, f.findings[c.key].answer) for f in families))
        for c in CAPABILITIES
    ]
    body += table(("what it can represent", *(f.family.key for f in families)), rows, words=range(1, len(families) + 1))
    body += bullets((
        "part: with a part added to the ship file. –: planned, not in the library. Answers are measured on the ships; "
        "--json says how each is known.",
        f"Next: seatrial models --for {' | '.join(p.key for p in PURPOSES)}",
    ))  # fmt: skip
    return fields({"families": [*map(_document, families)]}, body)


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


def _advised(purpose: Purpose, advice: Sequence[Advice]) -> Body:
    about = f"{purpose.title}, by Sawada 2024 (sections in brackets): {purpose.about}"
    body = bullets((*textwrap.wrap(about, _WIDTH), ""))
    listed = bool(purpose.needs[0].item)
    rows = [
        (str(k), a.assessment.family.key, a.assessment.family.name, a.verdict, *([_numbers(a)] if listed else []),
         _span(a.assessment.coefficients), figure(a.assessment.cost, 2), a.reason)
        for k, a in enumerate(advice, 1)
    ]  # fmt: skip
    head = ("", "family", "", "verdict", *(["items unmet"] if listed else []), "numbers", "ns", "what they say of it")
    body += table(head, rows, words=[k for k in range(1, len(head)) if k - listed not in (4, 5)])
    asked = [
        (*([str(need.item or "")] if listed else []), need.about if need.item else f"{need.about} [{need.place}]",
         "must" if need.must else "wish", *(_cell(a.assessment, need.keys) for a in advice))
        for need in purpose.needs
    ]  # fmt: skip
    head = (*(["6.2"] if listed else []), "what it asks for", "", *(a.assessment.family.key for a in advice))
    body += table(head, asked, words=range(1, len(head)))
    said = ["part: with a part added to the ship file. any: apart from the family. –: planned. Best family first."]
    said += [f"Simplest: {purpose.simplest}"] if purpose.simplest else []
    said += ["", "Next:", *(f"  {one}" for one in _next(purpose, advice))]
    return fields(_advice_document(purpose, advice), body + bullets(said))


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


def _document(f: Assessment) -> dict[str, Any]:
    from ..choosing import CAPABILITIES
    from ..choosing.purposes import BERTHING, COLLISION_AVOIDANCE, unmet

    family = f.family
    return {
        "family": family.key, "name": family.name, "status": "available" if family.classes else "planned",
        "classes": family.classes, "form": family.form, "section": family.section, "source": family.source,
        "controls": f.controls, "environment": f.environment, "outputs": f.outputs, "coefficients": f.coefficients,
        "data": {"length": f.length, "routes": family.routes, "studies": [
            {key: value for key, value in vars(study).items() if key != "model"} for study in f.studies]},
        "cost_ns": f.cost, "example": f.example, "ships": f.ships, "next": family.next,
        "represents": {c.key: {"about": c.about, **vars(f.findings[c.key])} for c in CAPABILITIES},
        **{name: {"collision-avoidance": unmet(f, COLLISION_AVOIDANCE, answer), "berthing": unmet(f, BERTHING, answer)}
           for name, answer in (("items_unmet", "no"), ("items_in_part", "partly"))},
    }  # fmt: skip


def _advice_document(purpose: Purpose, advice: Sequence[Advice]) -> dict[str, Any]:
    return {
        "purpose": purpose.key, "title": purpose.title, "about": purpose.about, "simplest": purpose.simplest,
        "next": _next(purpose, advice),
        "ranking": [
            {"family": a.assessment.family.key, "name": a.assessment.family.name, "verdict": a.verdict,
             "lacks": a.lacks, "partly": a.poor, "to_add": a.add, "misses": a.misses, "items_unmet": a.items,
             "items_in_part": a.in_part, "reason": a.reason, "cost_ns": a.assessment.cost,
             "coefficients": a.assessment.coefficients or (), "next": a.assessment.family.next}
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
            for f, sigma, share, verdict in zip(found.free, found.sigma, found.share, found.verdicts, strict=False)
        },
        "open": [{"combination": v.subject, "text": v.text} for v in found.verdicts[len(found.free) :]],
        "left_out": found.left_out, "published": TABLE_1,
    }  # fmt: skip


def _planned(name: str, found: Plan) -> Body:
    from ..identify.design.excitation import TABLE_1

    rows = [(what, figure(length), figure(gain)) for what, length, gain in found.chosen]
    rows.append(("together", figure(found.length), figure(found.log_det)))
    body = table((f"{name}: manoeuvre", "T'", "adds to log det"), rows)
    parameters = [
        (f.path, figure(f.start), figure(float(sigma), 2), f"{share:.0%}", verdict.status)
        for f, sigma, share, verdict in zip(found.free, found.sigma, found.share, found.verdicts, strict=False)
    ]
    body += table(("parameter", "value", "expected +-", "prior removed", "status"), parameters, words=(4,))
    body += bullets(f"{one.subject}: {one.text}" for one in found.verdicts if one.status != "identified")
    published = [(f"[{p.reference}]", p.model, ", ".join(map(str, p.parameters)), p.manoeuvres, _span(p.length))
                 for p in TABLE_1]  # fmt: skip
    body += table(("Sawada 2024 Table 1", "model", "parameters", "manoeuvres", "T'"), published, words=(1, 3))
    return fields(_plan_document(found), body)
