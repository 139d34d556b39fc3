"""The library's network (Sawada 2024 Eq. 10) against the model whose random manoeuvres it was trained on."""

from __future__ import annotations

import math

import pytest

from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

NETWORK, TEACHER = load("esso_osaka_3m_network"), load("esso_osaka_3m")


def test_it_is_a_feed_forward_network_that_was_trained_on_random_manoeuvres_alone() -> None:
    network = NETWORK.model.learned
    assert network is not None
    assert (network.kind, network.layers, network.wind, network.trained) == ("feedforward", (64, 64), True, True)
    assert all(name.startswith("random") for name in NETWORK.notes["provenance"]["trained_on"])


@pytest.mark.parametrize(("policy", "index", "within"), [
    (Turning(10.0, math.radians(35.0)), "advance", 0.08),
    (Turning(10.0, math.radians(35.0)), "tactical_diameter", 0.15),
    (Zigzag(10.0, math.radians(20.0), math.radians(20.0)), "initial_turning_distance", 0.08),
])  # fmt: skip
@pytest.mark.slow
def test_it_turns_as_its_caution_says(policy, index: str, within: float) -> None:
    found, wanted = (policy.indices(simulate(ship, policy, duration=120.0, dt=0.1), 3.0)[index].value
                     for ship in (NETWORK, TEACHER))  # fmt: skip
    assert found == pytest.approx(wanted, rel=within)
