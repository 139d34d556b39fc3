"""The small network of a hybrid: silent at rest, bounded, and the same on either side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seatrial.belief.freer import with_units
from seatrial.core.parameters import ParameterError, Terms, values
from seatrial.environment import Environment
from seatrial.forces import Flow
from seatrial.models.residual import inward, network, outward
from seatrial.ships import Ship
from seatrial.ships.files import load, save

BARE = load("esso_osaka_3m_hybrid")


def drawn(units: int = 6, seed: int = 3) -> Ship:
    ship, outputs = with_units(BARE, units, seed)
    rng = np.random.default_rng(seed)
    return ship.having({f.path: float(rng.normal()) for f in outputs})


SHIP = drawn()
REST = Flow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 998.0, 3.0, 0.2)


def force(**changes: float) -> np.ndarray:
    return np.array(SHIP.model.residual(REST._replace(**changes), changes.get("n_P", 0.0)), dtype=float)


def test_one_unit_is_the_tanh_of_its_terms() -> None:
    factors = {"u": 0.5, "v": -0.2, "d": 0.3, "n": 0.8}
    found = network(Terms(("h1_u", "h1_v", "h1_d_n", "h1_0"), (2.0, 1.0, -3.0, 0.1)),
                    Terms(("h1_X", "h1_Y"), (1.5, 0.5)), factors)  # fmt: skip
    even, odd = 0.1 + 2.0 * 0.5, -0.2 - 3.0 * 0.3 * 0.8
    assert pytest.approx(1.5 * ((np.tanh(even + odd) + np.tanh(even - odd)) / 2 - np.tanh(0.1))) == found.X
    assert pytest.approx(0.5 * (np.tanh(even + odd) - np.tanh(even - odd)) / 2) == found.Y
    assert found.N == 0.0


def test_silent_at_rest_whatever_the_rudder_does() -> None:
    for delta in (-0.6, 0.0, 0.6):
        assert force(delta=delta) == pytest.approx(np.zeros(3), abs=1e-12)


def test_no_force_beyond_what_the_outputs_allow() -> None:
    model, rng = SHIP.model, np.random.default_rng(0)
    most = [sum(abs(w) for name, w in model.unit_out.items() if name.endswith(axis)) for axis in "XYN"]
    limit = np.array([2.0, 1.0, 1.0]) * most * (model.scale.X_0, model.scale.Y_0, model.scale.N_0)
    for _ in range(50):
        u, v_m, r, n_P, delta, u_A, v_A = rng.normal(size=7) * 1e3
        assert (np.abs(force(u=u, v_m=v_m, r=r, n_P=n_P, delta=delta, u_A=u_A, v_A=v_A)) <= limit + 1e-9).all()


def test_the_mirror_image_feels_the_mirrored_force() -> None:
    one = force(u=0.3, v_m=0.05, r=0.02, n_P=9.0, delta=0.3, u_A=1.0, v_A=2.0)
    other = force(u=0.3, v_m=-0.05, r=-0.02, n_P=9.0, delta=-0.3, u_A=1.0, v_A=-2.0)
    assert other == pytest.approx(one * (1.0, -1.0, -1.0), rel=1e-9)
    assert np.abs(one).min() > 1e-3


def test_units_that_say_nothing_leave_the_ship_as_it_was() -> None:
    silent, outputs = with_units(BARE, 4, 0)
    assert [f.path for f in outputs][:4] == ["unit_out.h1_X", "unit_out.h1_Y", "unit_out.h1_N", "unit_out.h2_X"]
    state, control, calm = (0.0, 0.0, 0.1, 0.3, 0.02, 0.01, 0.0, 0.0, 8.0), (9.0, 0.2), (0.0,) * 8
    around = Environment(*calm)
    rates = BARE.model.derivative(state, control, around)
    assert silent.model.derivative(state, control, around) == pytest.approx(rates)


def test_more_units_take_names_of_their_own() -> None:
    again, outputs = with_units(SHIP, 2, 0)
    assert {f.path.split(".")[1].partition("_")[0] for f in outputs} == {"h7", "h8"}
    kept = {p: v for p, v in values(SHIP.model).items() if p.startswith("unit_")}
    assert kept.items() <= values(again.model).items()


def test_a_saved_network_reads_back(tmp_path) -> None:
    again = load(save(SHIP, tmp_path / "model.toml"))
    assert values(again.model) == values(SHIP.model)


@pytest.mark.parametrize(("make", "name", "told"), [
    (inward, "u_U", "names no hidden unit"), (inward, "h1", "names no hidden unit"), (inward, "h1_k", "no factor 'k'"),
    (inward, "h1_d_D", "rudder at rest"), (outward, "h1_Z", "goes to no force"), (outward, "hx_X", "names no hidden"),
])  # fmt: skip
def test_names_that_cannot_be(make, name: str, told: str) -> None:
    with pytest.raises(ParameterError, match=told):
        make(name)


def test_only_a_hybrid_has_units() -> None:
    with pytest.raises(TypeError, match="no hybrid"):
        with_units(replace(load("esso_osaka_3m")), 2, 0)
