"""The space of encounters: cells by brute force, ships counted once, and a picture that tells empty cells."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.encounters.meeting import Meeting, drawn, imazu
from seatrial.encounters.rules import Role
from seatrial.report.blocks import Figure
from seatrial.report.judging import space as module
from seatrial.report.judging.space import CELLS, space


def cell(angle: float) -> int:
    return min(int((angle + 180.0) / 30.0), CELLS - 1)


def one(beta: float, psi: float, far: float = 5000.0) -> Meeting:
    b = math.radians(beta)
    return Meeting(np.array([8.0]), np.array([[far * math.cos(b)]]), np.array([[far * math.sin(b)]]),
                   np.array([[math.radians(psi)]]), np.array([[8.0]]))  # fmt: skip


def test_a_ship_is_counted_in_the_cell_of_its_bearing_and_course() -> None:
    for beta, psi in ((45.0, -100.0), (-170.0, 10.0), (5.0, 175.0), (-95.0, 200.0)):
        found = space(one(beta, psi), np.array([True]))
        k, j = cell(beta), cell((psi + 180.0) % 360.0 - 180.0)
        assert found.tried.sum() == found.broken.sum() == found.tried[k, j] == 1
        assert not space(one(beta, psi), np.array([False])).broken.any()
    assert not space(one(45.0, -100.0, 1e6), np.array([True])).tried.any()  # stands for nobody


def test_failed_runs_are_counted_by_run_and_ships_by_ship() -> None:
    met = drawn([Role.GIVE_WAY, Role.STAND_ON], 200, 8.0, 1)
    failed = np.arange(200) % 4 == 0
    found = space(met, failed)
    assert found.tried.sum() == 400
    assert found.broken.sum() == 100
    assert (found.broken <= found.tried).all()
    starboard = np.arange(CELLS) >= CELLS // 2
    assert found.tried[starboard].sum() == 200  # who has to give way has the other to starboard


@pytest.mark.slow
def test_possible_cells_are_those_where_a_march_finds_a_meeting() -> None:
    """By brute force: ships on a fine grid of angles and ratios, those that pass within a hundredth of the distance."""
    angles = np.radians(np.arange(-179.0, 180.0, 2.0))
    beta, psi, k = np.meshgrid(angles, angles, np.linspace(0.25, 2.0, 120), indexing="ij")
    x, y = np.cos(beta), np.sin(beta)
    w_x, w_y = k * np.cos(psi) - 1.0, k * np.sin(psi)
    t = -(x * w_x + y * w_y) / np.maximum(w_x**2 + w_y**2, 1e-12)
    miss = np.hypot(x + t * w_x, y + t * w_y)
    meets = (t > 0.0) & (miss < 0.01)
    found = np.zeros((CELLS, CELLS), dtype=np.intp)
    at = np.clip(((np.degrees(beta) + 180.0) / 30.0).astype(int), 0, 11), np.clip(
        ((np.degrees(psi) + 180.0) / 30.0).astype(int), 0, 11)  # fmt: skip
    np.add.at(found, (at[0][meets], at[1][meets]), 1)
    possible = module._possible()
    assert possible[found > 60].all()  # but for cells that are touched at a corner
    assert not (possible & (found == 0)).any()
    assert (possible == possible[::-1, ::-1]).all()  # mirror: port for starboard


def test_imazus_ships_are_in_possible_cells_and_leave_others_empty() -> None:
    some = [met for met in imazu(8.0, 600.0) if len(met.x) == 3]
    met = Meeting(np.full(len(some), 8.0), *(np.stack([getattr(one_, name) for one_ in some])
                                             for name in ("x", "y", "psi", "U_target")))  # fmt: skip
    found = space(met, np.zeros(len(some), dtype=bool))
    hit, possible = found.hit
    assert 0 < hit < possible
    body = module.drawn(found)
    [picture] = [block for block in body if isinstance(block, Figure)]
    crossed = int((found.possible & (found.tried == 0)).sum())
    assert picture.svg.count("<polyline") == crossed == possible - hit
