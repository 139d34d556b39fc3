"""A ship that is not that of its file, among causes that look like it, on logs of an independent simulator."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.realtime.twin.faults.explained import another, widened
from seatrial.realtime.twin.follow import begun, made
from seatrial.realtime.twin.settings import usual
from seatrial.ships.files import load
from twin_faults.kinds import KINDS
from twin_faults.run import planted, weathers
from twin_faults.vessels import VESSELS

CHANNELS = ("x", "y", "psi", "r", "u_w", "v_north", "v_east")
pytestmark = pytest.mark.slow


def test_forces_of_the_hull_stand_beside_the_estimate_as_the_file_has_them() -> None:
    ship = load("kvlcc2_l7")
    machine = made(ship, usual(ship, CHANNELS))
    other, known = another(machine), values(ship.model)
    assert other is not None
    more = other.names[len(machine.names) :]
    assert {"hull.R_0", "hull.Y_v", "hull.N_r"} <= {*more}
    assert not [name for name in more if not name.startswith("hull.") or not known[name]]
    assert [other.settings.start[name] for name in more] == pytest.approx([0.4 * abs(known[name]) for name in more])
    here = begun(machine, 3.0, np.array([5.0, 6.0, 0.3, 0.01, 1.0, 1.0, 0.1]))
    wider, n = widened(here, other), len(machine.names)
    assert wider.t == 3.0
    np.testing.assert_array_equal(wider.mean[:n], here.mean)
    np.testing.assert_array_equal(wider.cov[:n, :n], here.cov)
    assert wider.mean[n:].tolist() == [known[name] for name in more]
    assert not wider.cov[n:].any()
    acting = np.array([ship.n_P or 0.0, 0.1, *[0.0] * 8])
    # the same ship goes on the same way
    np.testing.assert_allclose(wider.ahead(8.0, acting)[0].mean[:n], here.ahead(8.0, acting)[0].mean, rtol=1e-9)


def test_a_ship_without_forces_by_name_has_no_other() -> None:
    ship = load("mariner_nomoto")
    assert another(made(ship, usual(ship, CHANNELS))) is None


@pytest.mark.parametrize("kind", ["wrong ship", "revolutions scaled", "rudder slow", "antenna elsewhere"])
def test_another_ship_and_what_looks_like_one_are_told_apart(kind: str) -> None:
    """Seed 12, not that of the table; the gear of this coaster is three times as quick as its file says."""
    vessel = VESSELS["mmg_24"]
    (found,) = planted(vessel, [KINDS[kind]], 12, weathers(vessel)["calm"])
    assert found.verdict == "right", found.said
