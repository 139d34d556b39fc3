"""Nothing of the package goes untried: what no ship and no example has is named, in each of its published forms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.engine.rollout import simulator
from seatrial.environment import CHANNELS, Environment
from seatrial.models import Sampled, unit
from seatrial.ships.files import library, load
from seatrial.simulate.approach import approach
from seatrial.simulate.loop import open_loop, open_loop_parameters
from seatrial.testing import discovery, examples, force_modules, forces, manoeuvres, models, parts_of, ships
from seatrial.testing.manoeuvres import _states as states_of
from seatrial.testing.manoeuvres import ordered


def test_a_family_that_no_ship_has_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    without = {name: ship for name, ship in ships().items() if type(ship.model).__name__ != "Unified"}
    assert len(without) < len(ships())
    monkeypatch.setattr(models.discovery, "ships", lambda: without)
    assert models.untried_families() == ["Unified"]


def test_a_force_and_a_form_that_nothing_has_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    jets = {name: part for name, part in force_modules().items()
            if type(part.module).__name__ not in ("Bank", "Tunnel") or "loss_form=none" in name}  # fmt: skip
    fewer = {name: ship for name, ship in ships().items() if not any(
        type(part).__name__ in ("Bank", "Tunnel") for _, part in discovery.components(ship.model))}  # fmt: skip
    monkeypatch.setattr(forces.found, "force_modules", lambda: jets)
    monkeypatch.setattr(forces.found, "ships", lambda: fewer)
    untried = forces.untried_forces()
    assert "Bank" in untried
    tunnel = next(one for one in examples.MODULES if type(one).__name__ == "Tunnel")
    forms = discovery.choices(tunnel)["loss_form"]
    kept = {vars(part.module)["loss_form"] for part in jets.values() if type(part.module).__name__ == "Tunnel"}
    named = {one for one in untried if one.startswith("Tunnel[loss_form")}
    assert named == ({f"Tunnel[loss_form={form}]" for form in set(forms) - kept} if kept else set())
    assert kept or "Tunnel" in untried


def test_each_published_form_with_its_numbers_is_a_variant() -> None:
    jet = examples.JET
    found = dict(discovery.variants(jet))
    assert "thruster:Tunnel[loss_form=jet]" in found
    assert all(vars(one)["loss_form"] in name for name, one in found.items())
    assert found["thruster:Tunnel[loss_form=jet]"] == jet
    assert set(discovery.options(jet)) == {("loss_form", form) for form in discovery.choices(jet)["loss_form"]}
    assert discovery.key_of(jet) == "thruster:Tunnel"
    plain = load("kvlcc2_l7").model.part("hull")
    assert list(discovery.variants(plain)) == [("hull:Polynomial", plain)]


def test_subjects_are_the_library_the_examples_and_one_ship_for_each_option() -> None:
    assert {*library(), *examples.SHIPS} <= set(ships())
    more = set(ships()) - {*library(), *examples.SHIPS}
    for name in more:
        base, _, option = name.rstrip("]").partition("[")
        field, _, value = option.partition("=")
        assert base in ships()
        assert any(vars(part).get(field) == value for _, part in discovery.components(ships()[name].model))
        assert not any(vars(part).get(field) == value for _, part in discovery.components(ships()[base].model))


def test_parts_of_a_ship_have_its_sizes() -> None:
    ship = load("kvlcc2_l7")
    found = dict(parts_of(ship))
    kinds = {name.partition("[")[0] for name in found}
    assert {"hull:Polynomial", "propeller:Standard", "rudder:Standard"} <= kinds
    for part in found.values():
        assert (part.rho, part.L_pp, part.d, part.U) == (1000.0, 7.0, 0.46, 1.179)
        assert part.n == pytest.approx(40.0 * 1.179 / 7.0)
    example = force_modules()["anchor:DredgedAnchor"]
    assert (example.rho, example.L_pp, example.d, example.U, example.n) == (1000.0, 7.0, 0.46, 1.179, 7.0)


def test_paths_of_components_lead_to_their_numbers() -> None:
    from seatrial.core.parameters import read

    model: Any = ships()["dressed"].model
    found = dict(discovery.components(model))
    assert found[""] is model
    assert found["rudder."] is model.rudder
    assert read(model, "thrusters.bow.D") == vars(found["thrusters.bow."])["D"] == 0.06


@pytest.mark.slow
def test_controls_are_as_large_as_at_the_approach_and_as_usual_where_they_rest() -> None:
    ship = load("kvlcc2_l7")
    told = dict(zip(ship.model.controls, discovery.control_size(ship), strict=True))
    assert told == {"n_P": pytest.approx(approach(ship)[1]), "delta": 0.5}
    for name, one in ships().items():
        for control, size in zip(one.model.controls, discovery.control_size(one), strict=True):
            assert size > 0.0, name
            if unit(control) == "rad":
                assert size == 0.5, name
            if unit(control) == "-":
                assert size <= 1.0, name


def test_a_vector_of_all_inputs_is_taken_apart_in_order() -> None:
    """States, controls, the eight channels, then the memory of a sampled model."""
    for name in ("kvlcc2_l7", "esso_osaka_3m", "kvlcc2_l7_arx"):
        ship = ships()[name]
        rates, size = discovery.flat(ship)
        model: Any = ship.model
        n, c = len(model.states), len(model.controls)
        memory = len(model.memory) if isinstance(model, Sampled) else 0
        assert size.size == n + c + len(CHANNELS) + memory
        x = (np.random.default_rng(4).uniform(0.2, 0.8, size.size) * size).tolist()
        around = Environment(*x[n + c : n + c + 8])
        wanted = list(model.derivative(tuple(x[:n]), tuple(x[n : n + c]), around))
        if memory:
            change, after = model.advance(tuple(x[:n]), tuple(x[n : n + c]), around, tuple(x[-memory:]))
            wanted += [*change, *after]
            assert (size[-memory:] == 0.1).all()
        assert list(rates(tuple(x))) == pytest.approx(wanted)


def test_a_run_of_a_check_holds_what_runs_at_the_approach_and_turns_every_angle() -> None:
    ship = load("kvlcc2_l7")
    start = np.array([[0.0, 0.0, 0.3, 1.1, 0.0, 0.0]])
    around = Environment(current_x=0.1)
    found = models._run(ship, start, around, 0.05)
    held = np.array([[[approach(ship)[1], 0.4, *around]]])
    steps = round(5 * 7.0 / 1.179 / 0.05) + 1
    wanted = simulator(open_loop(ship)).run(
        start, held, open_loop_parameters(ship), dt=0.05, steps=steps, every=steps // 50
    )
    np.testing.assert_array_equal(found.values, wanted.values)
    assert found.t[-1] == pytest.approx(5 * 7.0 / 1.179, rel=0.03)
    assert 50 <= len(found.t) <= 55


def test_a_manoeuvre_is_ordered_for_the_ship() -> None:
    ship = load("kvlcc2_l7")
    policy: Any = ordered(manoeuvres()["turning"], ship)
    assert policy.n_P == pytest.approx(approach(ship)[1])
    assert policy.delta == pytest.approx(float(ship.actuators.rudder.high))
    assert set(manoeuvres()) >= {"turning", "zigzag", "spiral"}
    rows = states_of(ship, 200) / np.array(discovery.state_size(ship))
    assert rows.shape == (200, 6)
    assert (np.ptp(rows, axis=0) > 1.8).all()
    assert np.abs(rows).max() <= 1.0


def test_a_thruster_has_its_partner_on_the_other_side() -> None:
    from seatrial.forces.thruster_fixed import Fixed

    port = Fixed(x=-3.3, y=-0.3, T_1=2.0, T_2=3.0)
    pair = {"port": port, "starboard": replace(port, y=0.3), "middle": replace(port, y=0.0)}
    assert [discovery.other_side(pair, name) for name in pair] == ["starboard", "port", "middle"]
    with pytest.raises(discovery.ContractError, match="port has no partner"):
        discovery.other_side({"port": port, "starboard": replace(port, y=0.31)}, "port")
