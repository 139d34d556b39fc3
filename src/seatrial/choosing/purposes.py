"""Purposes of a model (Sawada 2024 sections 3, 5 and 6.2), and the families ranked for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from . import ANSWERS, Need
from .survey import Assessment

# What an unmet need weighs: a part to add is little, a want only good to have less than one that must be.
_WEIGHT = {"yes": 0.0, "part": 0.0, "partly": 1.0, "no": 2.0, "planned": 3.0}
_MUST = 100.0

_WEATHER = ("wind", "waves")
_SERVO, _LIMITS = "delay between command and actuator", "limits of actuators and their rates"
_STEERED = ("steering_speed", "steering_revolutions")


def _items(place: str, *rows: tuple[str, tuple[str, ...]]) -> tuple[Need, ...]:
    return tuple(Need(about, keys, f"{place} {k}", k) for k, (about, keys) in enumerate(rows, 1))


COLLISION_AVOIDANCE = _items(
    "6.2 collision avoidance",
    ("resistance in surge, sway and yaw", ("resistance",)),
    ("stable or unstable by hull form and speed", ("unstable_hull",)),
    ("no improbable motion", ("plausible",)),
    ("turns by rudder angle and hull form", ("turns",)),
    ("speed follows the revolutions", ("revolutions",)),
    ("answer to the rudder varies with speed and revolutions", _STEERED),
    ("drifts and turns in wind and waves", _WEATHER),
    (_SERVO, ()), (_LIMITS, ()), ("time step chosen by scale", ("any_step",)), ("real time", ()),
)  # fmt: skip
BERTHING = _items(
    "6.2 berthing",
    ("comes to rest by itself", ("at_rest",)),
    ("resistance in surge, sway and yaw", ("resistance", "large_drift")),
    ("stable or unstable by hull form and speed", ("unstable_hull",)),
    ("no improbable motion", ("plausible",)),
    ("turns by rudder angle and hull form", ("turns",)),
    ("speed follows the revolutions, astern too", ("revolutions", "reversing")),
    ("answer to the rudder varies with speed and revolutions", _STEERED),
    ("side thrusters that fade with speed", ("side_thrusters",)),
    ("turns by the propeller's hand when it reverses", ("reversing_turns",)),
    ("drifts and turns in wind", ("wind",)),
    (_SERVO, ()), (_LIMITS, ()), ("time step chosen by scale", ("any_step",)), ("real time", ()),
)  # fmt: skip


def _wish(about: str, place: str, *keys: str) -> Need:
    return Need(about, keys, place, must=False)


def _must(about: str, place: str, *keys: str) -> Need:
    return Need(about, keys, place)


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
    """

    key: str
    title: str
    about: str
    needs: tuple[Need, ...]
    reasons: Mapping[str, str]
    used: tuple[str, ...]
    simplest: str
    check: str


_NO_TESTS = _wish("numbers without tests of the ship", "5.2", "from_particulars")

PURPOSES = (
    Purpose(
        "berthing", "berthing and unberthing",
        "High accuracy near the quay: crabbing, reversal of the propeller, turning with large rudder angles, actuators "
        "with dead time (5). A steady feedback loop makes up for modest errors, improbable motion it cannot (6.2).",
        (*BERTHING, _wish("shallow water, near a quay", "5", "shallow"), _NO_TESTS),
        {"lowMMG": "takes the place of r' = rL/U, which fails at U = 0 (4.2.2); meets section 6.2 (Appendix)",
         "MMG": "its standard form assumes sway slow against surge: no berthing, no reversal (4.2.1)",
         "twinMMG": "as the standard form: no berthing, no reversal (4.2.1)",
         "Fossen": "likely to meet the needs (8); has no propeller of its own hand (4.2.2)",
         "modAbk": "likely to meet the needs (8); needs training data (8), has no side thrusters (Eqs. 21-23)",
         "Abkowitz": "small departures from a constant speed (4.2.1)",
         "NN": "trained on random low-speed manoeuvres: T' = 256 (5.4)",
         "KT": "no coefficients of response models for berthing exist (8)",
         "KT2": "no coefficients of response models for berthing exist (8)",
         "Norrbin": "no coefficients of response models for berthing exist (8)"},
        ("lowMMG", "Fossen", "modAbk"),
        "models simpler than MMG have been used for docking (3 [33]); Fossen's has the fewest numbers of those in 8.",
        "seatrial requirements {ship} --scope berthing",
    ),
    Purpose(
        "collision-avoidance", "collision avoidance by heading control",
        "A relatively simple model may do (1), and accuracy may be modest, since feedback makes up for it (5, 6.2); "
        "but speed, wind and waves must act on it (6.2).",
        (*COLLISION_AVOIDANCE, _NO_TESTS),
        {"MMG": "the whole list of 6.2, and regression formulas spare the tests of the ship (5.2)",
         "lowMMG": "the whole list, but more numbers than open water asks for: no chart gives them (5.2)",
         "twinMMG": "the whole list, for a ship of two screws",
         "Fossen": "used to test algorithms of autonomous craft (3 [24, 25])",
         "KT": "used for collision avoidance (3 [15]); from one zigzag, T' = 14 (Table 1)",
         "Norrbin": "as KT, and holds an unstable ship (4.1.1)",
         "Abkowitz": "cannot take changes of revolutions or wind (4.2.1)"},
        ("MMG", "KT", "Fossen"),
        "KT is the least that has been used (3 [15]): no speed loss, drift or wind; keep it to small rudder angles.",
        "seatrial requirements {ship} --scope collision-avoidance",
    ),
    Purpose(
        "training", "ship-handling simulator for crews",
        "Real time with short steps; the kind of motion matters more than its figures, but an unstable ship must be "
        "unstable, and disturbances of every kind must be easy to add (3).",
        (_must("an unstable hull shows", "3", "unstable_hull"), _must("wind and waves", "3", "wind", "waves"),
         _must("engine telegraph and rudder act", "3", "revolutions", "turns", *_STEERED),
         _must("speed loss and drift in a turn", "6.1", "speed_loss", "drift"), _must("real time", "3"),
         _must("no improbable motion", "6.2", "plausible"), _wish("crash stop", "5", "reversing"),
         _wish("low speed", "5", "at_rest", "large_drift"), _wish("side thrusters", "6.2", "side_thrusters"),
         _wish("current", "3", "current"), _wish("shallow water", "1", "shallow"), _NO_TESTS),
        {"MMG": "each disturbance is one term more (4.2.2, Eq. 18); formulas give an average ship (5.2)",
         "lowMMG": "as MMG, with manoeuvres in harbour and crash stops (4.2.2)",
         "Fossen": "takes wind and waves as further force vectors (4.2.2, Eq. 24)",
         "twinMMG": "as MMG, for a ship of two screws",
         "tanker": "shallow water is in it; no place for wind and waves",
         "Abkowitz": "wind and changes of revolutions are not in it (4.2.1)"},
        ("MMG", "lowMMG"), "", "seatrial requirements {ship} --scope collision-avoidance",
    ),
    Purpose(
        "hull-design", "manoeuvring characteristics in hull design",
        "Prediction of the IMO manoeuvres before construction; scale effects; easy when main particulars or the rudder "
        "change (3). The model should be modular (5).",
        (_must("hull and rudder can be changed", "3, 5", "design_changes"),
         _must("turning and course keeping", "3", "turns", "drift", "speed_loss", "unstable_hull"),
         _must("numbers before the ship exists", "3, 5.2", "from_particulars"),
         _must("model scale and full scale", "4.2.2", "design_changes"), _wish("shallow water", "4.2.2", "shallow"),
         _wish("stopping", "3 (MSC.137)", "reversing")),
        {"MMG": "widely used for it: modules with physical meaning, scale effects, regression formulas (3, 4.2.2, 5.2)",
         "lowMMG": "modules too, but no chart for the numbers of low speed (5.2)",
         "twinMMG": "modules too; formulas are for single screws",
         "modAbk": "of some value for partial design changes, not built from parts (4.2.2)",
         "Abkowitz": "cannot take a changed rudder, nor be carried to full scale (4.2.2)",
         "Fossen": "matrices of the whole hull: a changed hull is a new identification (4.2.2)"},
        ("MMG", "twinMMG"), "", "seatrial imo {ship}",
    ),
    Purpose(
        "model-based-control", "model inside a control law",
        "A linear or input-affine system that costs little to make for each ship; it need not be modular, since the "
        "ship is given (5).",
        (Need("linear or affine in the controls", ("input_affine",), "5"),
         _must("turns by the rudder", "3", "turns"), _wish("drift", "3", "drift"),
         _wish("speed by thrust", "3", "revolutions"), _wish("fed forward: wind", "4.2.2 (Eq. 24)", "wind"),
         _wish("current", "4.2.2 (Eq. 29)", "current"), _wish("low speed", "3 [29, 33]", "at_rest", "large_drift"),
         _wish("linear", "5", "linear"), _wish("any step of the controller", "6.2", "any_step")),
        {"Fossen": "matrix form suits stability analysis, made affine as tau = B u (4.2.2, Eqs. 26-29)",
         "KT": "control on response models is long established (4.1.1 [28]); the least numbers",
         "KT2": "as KT, with the lag of sway (Eq. 5)", "Norrbin": "as KT, and affine still (Eq. 8)",
         "ARX": "autopilots on ships were built on it (4.1.2 [56, 57])",
         "VARX": "control was designed on AR models (4.1.2 [57]); here with drift and speed beside yaw",
         "MMG": "used in predictive control of ferry and cargo ship (3 [31, 32]), nonlinear in its controls",
         "lowMMG": "a low-speed hull model was used in predictive control by C/GMRES (3 [29, 30])"},
        ("Fossen", "KT", "VARX", "ARX", "Norrbin"),
        "any family can be linearised about a trim point: seatrial.models.linear.linearise gives A and B.",
        "seatrial show {ship}",
    ),
    Purpose(
        "observer", "state observer or Kalman filter",
        "Unobserved states or parameters by a nonlinear Kalman filter: heading, yaw rate and speed from positions "
        "alone (3 [26, 27]). As light as the measurements allow (5).",
        (_must("yaw rate", "3", "turns"), _must("speed over ground beside speed through water", "4.2.2", "current"),
         _must("drift", "3", "drift"), _must("no improbable motion", "6.2", "plausible"),
         _wish("comes to rest by itself", "6.2 berthing 1", "at_rest"), _wish("speed by thrust", "3", "revolutions"),
         _wish("wind", "4.2.2", "wind"), _wish("affine", "5", "input_affine"),
         _wish("samples as they come", "6.2", "any_step")),
        {"Fossen": "used in extended Kalman filters, for parameters and for states (3 [26, 27])",
         "MMG": "more numbers than an observer needs; its parts can be measured apart (4.2.2)",
         "KT": "yaw only: heading and yaw rate, not drift or speed (4.1.1)",
         "VARX": "linear: a plain Kalman filter does (4.1.2)", "ARX": "yaw only (4.1.2)"},
        ("Fossen",), "for heading and yaw rate alone KT does: one state, two numbers (4.1.1).",
        "seatrial show {ship}",
    ),
)  # fmt: skip
"""All purposes that `seatrial models --for` knows."""


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
