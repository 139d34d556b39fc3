"""Families of models: the table says what the code does, no more, and the ranking follows from it."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from seatrial.choosing import ANSWERS, CAPABILITIES, Finding
from seatrial.choosing.probing import Probe, findings, outputs
from seatrial.choosing.purposes import BERTHING, COLLISION_AVOIDANCE, PURPOSES, fittest, recommend, unmet
from seatrial.choosing.survey import FAMILIES, Assessment, assess, nanoseconds, vector_arx
from seatrial.environment import CALM
from seatrial.identify.design.excitation import TABLE_1
from seatrial.models import Model
from seatrial.models.common import Surroundings
from seatrial.models.linear import straight
from seatrial.ships.files import library, load

pytestmark = pytest.mark.slow

KEYS = {c.key for c in CAPABILITIES}
NAMES = [family.key for family in FAMILIES]


@pytest.fixture(scope="module")
def families(surveyed: tuple[Assessment, ...]) -> Mapping[str, Assessment]:
    return {a.family.key: a for a in surveyed}


@pytest.fixture(scope="module")
def kt() -> Any:
    return next(family for family in FAMILIES if family.key == "KT")


def answers(families: Mapping[str, Assessment], key: str, *names: str) -> set[str]:
    return {families[name].findings[key].answer for name in names}


def test_every_ship_of_the_library_is_of_one_family(families) -> None:
    placed = [ship for a in families.values() for ship in a.ships]
    assert sorted(placed) == sorted(library())


def test_every_answer_is_known_and_says_how(families) -> None:
    for a in families.values():
        assert set(a.findings) == KEYS
        for key, found in a.findings.items():
            assert found.answer in ANSWERS
            assert found.how, key
            assert "neither measured nor declared" not in found.how, f"{a.family.key}: {key}"
            assert (found.answer == "planned") == (not a.family.classes)


def test_networks_are_judged_by_a_trained_one_as_the_other_families_are(families) -> None:
    network = families["NN"]
    assert network.ships == ("esso_osaka_3m_network",)
    assert network.outputs == ("u", "v_m", "r")
    assert network.environment == ("wind", "current")
    assert network.coefficients == (7 * 64 + 64 + 64 * 64 + 64 + 64 * 3,) * 2
    assert answers(families, "any_step", "NN") == {"partly"}
    assert answers(families, "from_particulars", "NN") == answers(families, "waves", "NN") == {"no"}
    assert 13 in unmet(network, BERTHING, "partly")


@pytest.mark.parametrize(
    ("key", "able", "unable"),
    [
        ("speed_loss", ("MMG", "lowMMG", "twinMMG", "Fossen", "tanker", "modAbk"), ("KT", "KT2", "Norrbin", "VARX")),
        ("drift", ("VARX", "Abkowitz", "MMG"), ("KT", "KT2", "Norrbin", "ARX")),
        ("revolutions", ("modAbk", "tanker", "MMG", "Fossen"), ("KT", "Norrbin", "VARX", "Abkowitz")),
        ("wind", ("lowMMG",), ("KT", "Norrbin", "ARX", "VARX", "Abkowitz", "modAbk", "tanker")),
        ("at_rest", ("lowMMG", "Fossen"), ("KT", "KT2", "Norrbin", "VARX")),
        ("large_drift", ("lowMMG", "Fossen"), ("MMG", "twinMMG", "Abkowitz", "VARX", "KT")),
        ("reversing_turns", ("lowMMG",), ("MMG", "KT", "Abkowitz")),
        ("shallow", ("tanker",), ("KT", "Abkowitz", "modAbk")),
        ("design_changes", ("MMG", "lowMMG", "twinMMG"), ("KT", "ARX", "Abkowitz")),
        ("linear", ("KT", "KT2", "ARX", "VARX"), ("Norrbin", "Abkowitz", "MMG", "Fossen")),
        ("input_affine", ("KT", "Norrbin", "Fossen"), ("MMG", "lowMMG", "Abkowitz", "modAbk", "tanker")),
        ("any_step", ("KT", "MMG"), ()),
        ("current", tuple(NAMES), ()),
    ],
)
def test_known_abilities(families, key: str, able: tuple[str, ...], unable: tuple[str, ...]) -> None:
    assert answers(families, key, *able) <= {"yes"}
    assert answers(families, key, *unable) <= {"no"}


def test_parts_that_the_library_does_not_fit_are_found_by_fitting_them(families) -> None:
    assert answers(families, "wind", "twinMMG", "Fossen") == {"part"}
    assert answers(families, "side_thrusters", "twinMMG", "Fossen") == {"part"}


def test_a_declaration_lowers_an_answer_and_never_raises_one(kt) -> None:
    ships = [load("mariner_nomoto")]
    proud = replace(kt, declared={**kt.declared, "wind": Finding("yes", "so it says"), "turns": Finding("no", "shy")})
    found = assess(proud, ships, costs=False).findings
    assert found["wind"].answer == "no"
    assert found["turns"] == Finding("no", "shy")


@dataclass(frozen=True)
class Deaf(Model):
    """A ship that nothing moves."""

    def derivative(self, state, control, environment):
        return Surroundings.of(state, environment).rates((0.0, 0.0, 0.0))


def test_a_deaf_model_represents_nothing() -> None:
    deaf = replace(load("mariner_nomoto"), model=Deaf())
    found = findings(Probe.of(deaf))
    able = {key for key, finding in found.items() if finding.answer not in ("no",)}
    assert able <= {"plausible", "any_step", "linear", "input_affine", "current"}
    assert outputs(Probe.of(deaf)) == ()


@dataclass(frozen=True)
class Sick(Deaf):
    """A ship that divides by its speed."""

    def derivative(self, state, control, environment):
        return Surroundings.of(state, environment).rates((0.0, 0.0, control[1] / state[3] - state[5]))


def test_a_model_without_an_answer_at_rest_is_found_out() -> None:
    sick = replace(load("mariner_nomoto"), model=Sick())
    found = findings(Probe.of(sick))["plausible"]
    assert found.answer == "no"
    assert " 0 of" not in found.how


def test_counts_are_counted(families) -> None:
    assert families["KT"].coefficients == (2, 2)
    assert families["KT2"].coefficients[0] == 4
    assert families["Fossen"].coefficients == (6, 22)
    assert families["MMG"].coefficients[0] > 40


def test_data_are_those_of_table_1(families) -> None:
    assert families["KT"].length == (14.0, 14.0)
    assert families["MMG"].length == (8.8, 50.8)
    assert families["lowMMG"].length == (258.0, 269.5)
    assert families["ARX"].length is None
    placed = sorted(row.reference for a in families.values() for row in a.studies)
    assert placed == sorted(row.reference for row in TABLE_1)


def test_outputs_and_inputs_are_found(families) -> None:
    assert families["KT"].outputs == ("r",)
    assert families["KT2"].outputs == ("r", "lead")
    assert families["VARX"].outputs == ("u", "v_m", "r")
    assert families["KT"].environment == ("current",)
    assert {"wind", "current"} <= set(families["lowMMG"].environment)


def test_the_specimen_answers_as_the_ship_it_was_made_from() -> None:
    ship, base = vector_arx(), load("mariner")
    model: Any = ship.model
    at = straight(base.model, base.speed).at
    u, v_m, r = at.state[3:6]
    state, control = (0.0, 0.0, 0.0, u + 1e-4, v_m + 1e-5, r + 1e-8), (0.0, at.orders["delta"] + 1e-6)
    rates = model.advance(state, control, CALM, model.begin(state, control))[0]
    np.testing.assert_allclose(rates, base.model.derivative(state, control, CALM)[3:6], rtol=1e-3, atol=1e-10)


def test_items_of_section_6_2(families) -> None:
    assert unmet(families["MMG"], COLLISION_AVOIDANCE) == ()
    assert unmet(families["lowMMG"], BERTHING) == ()
    assert unmet(families["KT"], COLLISION_AVOIDANCE) == unmet(families["Norrbin"], COLLISION_AVOIDANCE) == (1, 5, 6, 7)
    assert set(unmet(families["MMG"], BERTHING)) == {2, 6, 9}
    assert 13 in unmet(families["VARX"], BERTHING, "partly")
    assert [need.item for need in COLLISION_AVOIDANCE] == list(range(1, 12))
    assert [need.item for need in BERTHING] == list(range(1, 15))


@pytest.mark.parametrize(
    ("purpose", "first"),
    [("berthing", "lowMMG"), ("collision-avoidance", "MMG"), ("hull-design", "MMG"), ("training", "lowMMG"),
     ("model-based-control", "Fossen"), ("observer", "Fossen")],
)  # fmt: skip
def test_the_best_family(families, purpose: str, first: str) -> None:
    wanted = next(p for p in PURPOSES if p.key == purpose)
    advice = recommend(wanted, tuple(families.values()))
    assert advice[0].assessment.family.key == first
    assert advice[-1].verdict != "meets it"
    assert not advice[0].lacks
    assert fittest(wanted, advice[0].assessment) in library()
    costly = tuple(replace(a, cost=1e9 / (1 + k)) for k, a in enumerate(families.values()))
    assert [a.assessment.family.key for a in recommend(wanted, costly)] == [a.assessment.family.key for a in advice]


def test_the_check_is_of_a_ship_that_has_what_it_takes(families) -> None:
    wanted = next(p for p in PURPOSES if p.key == "berthing")
    ship = fittest(wanted, families["lowMMG"])
    assert findings(Probe.of(load(ship)))["wind"].answer == "yes"


@pytest.mark.parametrize("purpose", PURPOSES, ids=lambda p: p.key)
def test_purposes_name_what_exists(purpose) -> None:
    assert set(purpose.reasons) <= set(NAMES)
    assert set(purpose.used) <= set(NAMES)
    assert {key for need in purpose.needs for key in need.keys} <= KEYS
    assert all(need.place for need in purpose.needs)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.key)
def test_next_commands_name_ships_that_exist(family) -> None:
    for line in family.next:
        command, verb, *words = shlex.split(line)
        assert command == "seatrial"
        if verb in ("simulate", "show", "design"):
            assert words[0] in library()
        else:
            assert verb in ("estimate", "identify")
            assert words[0].endswith(".toml")


def test_the_cost_is_measured() -> None:
    for name in ("mariner_nomoto", "kvlcc2_l7_arx"):
        assert 0 < nanoseconds(Probe.of(load(name))) < math.inf
