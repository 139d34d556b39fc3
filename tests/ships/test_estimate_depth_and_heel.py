"""Estimates that feel the depth of the water, or heel."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.core.parameters import values
from seatrial.environment import CALM, Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import Ship, ShipError
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

PARTICULARS = Path(__file__).parents[2] / "examples" / "particulars"


def turn(ship: Ship, depth: float = math.inf) -> dict[str, float]:
    _, n_P = approach(ship)
    policy = Turning(n_P, math.radians(35.0))
    run = simulate(ship, policy, duration=30 * ship.L_pp / ship.speed, environment=Uniform(depth=depth))
    return {name: one.value for name, one in policy.indices(run, ship.L_pp).items()}


def test_in_deep_water_it_is_the_same_ship() -> None:
    plain, deep = (estimate(PARTICULARS / "kcs.toml", shallow=shallow).ship for shallow in (False, True))
    numbers = values(deep.model)
    assert values(plain.model) == {path: numbers[path] for path in values(plain.model)}
    assert (numbers["hull.B"], numbers["hull.C_b"]) == (32.2, 0.651)
    for state in ((0.0, 0.0, 0.0, 12.0, -2.0, 0.01), (0.0, 0.0, 0.0, 5.0, 1.0, -0.02)):
        one, other = (ship.model.derivative(state, (1.5, 0.4), CALM) for ship in (plain, deep))
        assert one == pytest.approx(other, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kcs", "gms_110"])
def test_the_shallower_the_wider_it_turns(name: str) -> None:
    """Below two draughts: above them the factors of Ankudinov have a dip of some per cent."""
    ship = estimate(PARTICULARS / f"{name}.toml", shallow=True).ship
    d = float(values(ship.model)["body.d"])
    found = [turn(ship, over * d)["tactical_diameter"] for over in (1e6, 1.8, 1.5, 1.35, 1.25)]
    assert found[1:] == sorted(found[1:])
    assert found[0] == pytest.approx(turn(ship)["tactical_diameter"], rel=1e-4)
    assert found[-1] > 1.1 * found[0]


def test_breadth_and_fullness_of_the_shallow_hull_stand_among_the_particulars(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text((PARTICULARS / "kcs.toml").read_text(encoding="utf-8") + "\n[given]\nhull.B = 32.0\n", "utf-8")
    with pytest.raises(ShipError, match=r"B stands in \[particulars\]"):
        estimate(path, shallow=True)


def test_a_ship_heels_about_the_metacentre_of_its_particulars() -> None:
    """KG = KB + BM - GM, KB = d (5/6 - C_b/(3 C_w)), BM = (.1216 C_w - .0410) B^2/(d C_b), C_w = (1 + 2 C_b)/3."""
    numbers = values(estimate(PARTICULARS / "s175.toml", GM=0.3).ship.model)
    B, d, C_b = 25.4, 8.5, 0.5617
    C_w = (1.0 + 2.0 * C_b) / 3.0
    KG = d * (5.0 / 6.0 - C_b / (3.0 * C_w)) + (0.1216 * C_w - 0.0410) * B * B / (d * C_b) - 0.3
    assert numbers["roll.GM"] == 0.3
    assert numbers["roll.z_H"] == pytest.approx(KG - 0.5 * d)


@pytest.mark.slow
def test_the_container_ship_heels_in_its_turn_as_the_published_one_does() -> None:
    """Son and Nomoto's ship of the same GM heels 11.8 deg outwards; both kinds of derivatives are missing here."""
    own, theirs = turn(estimate(PARTICULARS / "s175.toml", GM=0.3).ship), turn(load("container_son_nomoto"))
    assert own["outward_heel"] == pytest.approx(theirs["outward_heel"], rel=0.3)
    assert own["inward_heel"] > 0.0  # the rudder heels it inwards first


@pytest.mark.parametrize(("name", "more", "said"), [
    ("gms_110", ["--gm", "1"], "TwinMmg is another"), ("kcs", ["--gm", "40"], "GM is 40 m"),
    ("kcs", ["--gm", "-1"], "GM is -1 m"),
])  # fmt: skip
def test_what_cannot_heel_is_refused_and_nothing_written(
    name: str, more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "ship.toml"
    assert main(["estimate", str(PARTICULARS / f"{name}.toml"), "-o", str(out), *more]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()
