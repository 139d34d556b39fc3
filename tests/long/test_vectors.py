"""Every kernel of a ship is a loop over lanes that the compiler turns into vectors: without, it is three times slower.

A choice between numbers that all lanes share, or too many branches, keeps GCC from it, and nothing else tells.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from seatrial.engine import csource, trace
from seatrial.engine.compilers import compiler
from seatrial.environment.geojson import load_chart
from seatrial.manoeuvres import Given
from seatrial.models import Stepped
from seatrial.models.common import Composed
from seatrial.ships.files import load, variants
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.place import place_of
from seatrial.testing import ships

pytestmark = pytest.mark.long
FUNCTION = re.compile(r"static void (rhs|rhs_held|before|touch|kick_in|kick_out)\(")
LOOP = "for(long b=0;b<LB;b++)"
ALL = ships() | {name: load(name) for name in variants()}
SHIPS = {name: ship for name, ship in ALL.items() if not isinstance(ship.model, Stepped)}
AFLOAT = ("kvlcc2_harbour", "kvlcc2_shallow")


def unvectorised(system: Any, folder: Path) -> list[str]:
    """Lane functions of the kernel of a system whose loop stays scalar."""
    cc = compiler()
    if "gcc" not in cc.command[0]:
        pytest.skip("GCC alone says which loops it vectorises")
    source = csource.rollout_source(
        system, trace.right_hand_side(system), trace.preparation(system), {}, trace.kicks(system)
    )
    file = folder / "kernel.c"
    file.write_text(source, encoding="utf-8")
    command = [*cc.command, *cc.flags, "-fopt-info-vec-optimized", str(file), "-o", str(folder / "kernel.so"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    vectors = {int(line) for line in re.findall(r"kernel\.c:(\d+):\d+: optimized: loop vectorized", done.stderr)}
    parts = re.split(r"\n(?=static void )", source)
    first = [sum(part.count("\n") + 1 for part in parts[:k]) for k in range(len(parts))]
    found = [(named[1], at + part[: part.index(LOOP)].count("\n") + 1) for part, at in zip(parts, first, strict=True)
             if (named := FUNCTION.match(part)) and LOOP in part]  # fmt: skip
    assert "rhs" in dict(found)
    return [name for name, loop in found if loop not in vectors]



@pytest.mark.parametrize("name", list(SHIPS))
def test_the_motion_of_a_ship_is_vectorised(name: str, tmp_path: Path) -> None:
    assert not unvectorised(closed_loop(SHIPS[name], Given(), 0.1), tmp_path)


@pytest.mark.parametrize("name", AFLOAT)
def test_contact_is_vectorised(name: str, tmp_path: Path) -> None:
    ship = SHIPS[name]
    assert isinstance(ship.model, Composed)
    assert not unvectorised(closed_loop(ship, Given(), 0.1, place_of(ship, load_chart("tanker_quay"))), tmp_path)
