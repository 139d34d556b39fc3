"""Purposes of a model (Sawada 2024 sections 3, 5 and 6.2), and the families ranked for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..core.values import dataclass
from ..validate.fitness import Limit
from . import ANSWERS, Need, table
from .survey import Assessment

# What an unmet need weighs: a part to add is little, a want only good to have less than one that must be.
_WEIGHT = {"yes": 0.0, "part": 0.0, "partly": 1.0, "no": 2.0, "planned": 3.0}
_MUST = 100.0

@dataclass(frozen=True)
class Purpose:
    """What a model is wanted for.

    Attributes:
        key, title: as typed, and in words.
        about: requirements of Sawada et al. (2024) on such a model.
        needs: what it must have and what is good to have.
        reasons: their statement on a family for this purpose, with the section.
        used: families that they name in use for it; they go first where needs are met alike.
        simplest: the least that has been used, and its price; empty where there is no simpler way.
        check: how to test a ship for the purpose.
        accuracy: errors of a model that the purpose accepts; none where only the family decides.
    """

    key: str
    title: str
    about: str
    needs: tuple[Need, ...]
    reasons: Mapping[str, str]
    used: tuple[str, ...]
    simplest: str
    check: str
    accuracy: tuple[Limit, ...] = ()


def _purpose(found: Mapping[str, Any]) -> Purpose:
    needs = [Need(about, tuple(keys), place, must=kind == "must")
             for kind in ("must", "wish") for about, place, *keys in found.get(kind, ())]  # fmt: skip
    words = {name: found.get(name, "") for name in ("key", "title", "about", "simplest", "check")}
    return Purpose(needs=(*_ITEMS.get(found["key"], ()), *needs), reasons=found["reasons"], used=tuple(found["used"]),
                   accuracy=tuple(Limit(**row) for row in found.get("accuracy", ())), **words)  # fmt: skip


_TABLE = table("purposes.toml")
_ITEMS = {
    key: tuple(Need(about, tuple(keys), f"6.2 {key.replace('-', ' ')} {k}", k)
               for k, (about, *keys) in enumerate(rows, 1))
    for key, rows in _TABLE["items"].items()
}  # fmt: skip
COLLISION_AVOIDANCE, BERTHING = _ITEMS["collision-avoidance"], _ITEMS["berthing"]
PURPOSES = tuple(map(_purpose, _TABLE["purpose"]))
"""All purposes that `seatrial models --for` knows, as purposes.toml declares them."""


@dataclass(frozen=True)
class Advice:
    """How a family stands for a purpose.

    Attributes:
        verdict: "meets it", "meets it with parts added", "meets it in part", "does not meet it" or "planned".
        lacks, poor: needs that are not met, and those met in part only, of those that must be.
        add: needs met once a part is added to the ship file.
        misses: what would be good to have and is not there.
        items, in_part: numbers of the section 6.2 list of this purpose that it cannot meet, or only in part.
        reason: statement of Sawada et al. (2024), with the section.
    """

    assessment: Assessment
    verdict: str
    lacks: tuple[str, ...]
    poor: tuple[str, ...]
    add: tuple[str, ...]
    misses: tuple[str, ...]
    items: tuple[int, ...]
    in_part: tuple[int, ...]
    reason: str


def recommend(purpose: Purpose, families: Sequence[Assessment]) -> tuple[Advice, ...]:
    """Families for a purpose, best first: by needs unmet, then those in use for it, then by fewest coefficients."""
    return tuple(advise(purpose, family) for family in sorted(families, key=lambda family: _rank(purpose, family)))


def _rank(purpose: Purpose, family: Assessment) -> tuple[bool, float, bool, int]:
    musts, wishes = (
        sum(_WEIGHT[family.answer(need.keys)] for need in purpose.needs if need.must is must) for must in (True, False)
    )
    size = family.coefficients[1] if family.coefficients else 10**6
    return not family.family.classes, _MUST * musts + wishes, family.family.key not in purpose.used, size


def advise(purpose: Purpose, family: Assessment) -> Advice:
    """How one family stands for a purpose."""
    named = {answer: [need for need in purpose.needs if need.must and family.answer(need.keys) == answer]
             for answer in ANSWERS}  # fmt: skip
    text = {answer: tuple(f"{need.about} ({need.place})" for need in needs) for answer, needs in named.items()}
    verdict = ("planned" if not family.family.classes else "does not meet it" if named["no"]
               else "meets it in part" if named["partly"] else "meets it with parts added" if named["part"]
               else "meets it")  # fmt: skip
    misses = tuple(need.about for need in purpose.needs
                   if not need.must and ANSWERS.index(family.answer(need.keys)) > ANSWERS.index("part"))  # fmt: skip
    reason = purpose.reasons.get(family.family.key, f"not named for this (described in {family.family.section})")
    items, in_part = (unmet(family, purpose.needs, answer) for answer in ("no", "partly"))
    return Advice(family, verdict, text["no"], text["partly"], text["part"], misses, items, in_part, reason)


def fittest(purpose: Purpose, family: Assessment) -> str:
    """The ship of a family that meets most of what a purpose must have; empty where there is none."""
    keys = {key for need in purpose.needs if need.must for key in need.keys}

    def short(name: str) -> float:
        found = family.by_ship[name]
        return sum(_WEIGHT[found[key].answer] + (found[key].answer == "part") for key in keys if key in found)

    return min(family.ships, key=short, default="")


def unmet(family: Assessment, needs: Sequence[Need], answer: str = "no") -> tuple[int, ...]:
    """Numbers of the items of section 6.2 that a family cannot meet ("no"), or only in part ("partly")."""
    return tuple(need.item for need in needs if need.item and family.answer(need.keys) == answer)
