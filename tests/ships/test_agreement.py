"""Speed and revolutions that are given together: met by what is least certain, or refused with the reason."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.ships import ShipError
from seatrial.ships.agreement import agree, revolutions
from seatrial.ships.estimate import SCATTER, Estimate, estimate
from seatrial.simulate.approach import approach, surge_balance

KNOT = 1852.0 / 3600.0
SHIP = """schema = "seatrial-particulars/1"
[particulars]
L_pp = 42.0
B = 9.2
d = 3.1
C_b = 0.52
"""


def made(folder: Path, more: str) -> Estimate:
    path = folder / "own.toml"
    path.write_text(SHIP + more, encoding="utf-8")
    return estimate(path)


class TestNearest:
    def test_a_line_is_met_at_its_foot_point(self) -> None:
        """g = 1 + 3 a + 4 b: nearest to zero is -(3, 4)/25, and sigma shrinks by sqrt(1 - cos^2)."""
        found = agree(lambda z: 1.0 + 3.0 * z["a"] + 4.0 * z["b"], ("a", "b"))
        assert found is not None
        assert found.moves == pytest.approx({"a": -3.0 / 25.0, "b": -4.0 / 25.0})
        assert found.left == pytest.approx({"a": 0.8, "b": 0.6})
        assert found.distance == pytest.approx(0.2)

    def test_a_curve_is_met_at_its_nearest_point_by_brute_force(self) -> None:
        def left(z: dict[str, float]) -> float:
            return math.exp(0.5 * z["a"]) * (1.0 + 0.3 * z["b"]) - 1.6

        found = agree(left, ("a", "b"))  # type: ignore[arg-type]
        a = np.linspace(-3.0, 3.0, 200_001)
        distance = np.hypot(a, (1.6 * np.exp(-0.5 * a) - 1.0) / 0.3)
        assert found is not None
        assert left(dict(found.moves)) == pytest.approx(0.0, abs=1e-6)
        assert found.distance == pytest.approx(float(distance.min()), abs=1e-4)

    def test_what_nothing_moves_is_not_met(self) -> None:
        assert agree(lambda z: 1.0, ("a",)) is None
        assert agree(lambda z: 1.0 + z["a"] ** 2, ("a",)) is None

    def test_revolutions_by_bisection(self) -> None:
        assert revolutions(lambda n: n * n - 4.0, 1.0) == pytest.approx(2.0, rel=1e-5)
        assert revolutions(lambda n: -1.0, 1.0) is None


GIVEN = 'speed = { value = 11.5, unit = "kn" }\nn_P = { value = 300.0, unit = "rpm" }\nD_P = 1.9\n'
PROPELLER = """[given]
propeller.w_P0 = 0.2
propeller.t_P = 0.2
propeller.k_0 = 0.32
propeller.k_1 = -0.28
propeller.k_2 = -0.15
"""


class TestShip:
    @pytest.mark.slow
    @pytest.mark.parametrize("rpm", [270.0, 300.0, 340.0])
    def test_sails_as_told(self, tmp_path: Path, rpm: float) -> None:
        ship = made(tmp_path, GIVEN.replace("300.0", str(rpm))).ship
        assert (ship.speed, ship.n_P) == (pytest.approx(11.5 * KNOT), pytest.approx(rpm / 60.0))
        assert approach(ship, n_P=ship.n_P)[0] == pytest.approx(11.5 * KNOT, rel=1e-6)

    @pytest.mark.slow
    def test_the_speed_alone_needs_no_move(self, tmp_path: Path) -> None:
        bare = made(tmp_path, GIVEN.replace('n_P = { value = 300.0, unit = "rpm" }\n', ""))
        _, n_P = approach(bare.ship)
        met = made(tmp_path, GIVEN.replace("300.0", f"{60.0 * n_P:.12g}"))
        before, after = ({n.path: n.value for n in one.numbers} for one in (bare, met))
        assert after == pytest.approx(before, rel=1e-6)
        assert not any("so that" in line for line in met.cautions)

    @pytest.mark.slow
    def test_what_is_least_certain_moves_most_and_what_is_given_not_at_all(self, tmp_path: Path) -> None:
        caution = next(line for line in made(tmp_path, GIVEN).cautions if line.startswith("so that 300 rpm hold"))
        assert "pitch_ratio by -0." in caution
        pitch = GIVEN + "pitch_ratio = 0.75\n"
        met = {n.path: n for n in made(tmp_path, pitch).numbers}
        bare = {n.path: n for n in made(tmp_path, pitch.replace("n_P", "# n_P")).numbers}
        moved = {path for path in met if met[path].value != pytest.approx(bare[path].value, rel=1e-9)}
        assert moved == {"hull.R_0", "propeller.w_P0", "propeller.t_P", "propeller.k_0", "propeller.k_1",
                         "propeller.k_2", "propeller.C_2p", "propeller.C_2n", "rudder.epsilon",
                         "rudder.kappa"}  # fmt: skip
        held = pitch + '[given]\nhull.R_0 = { prime = 0.0155, source = "tank" }\n'
        kept = {n.path: n.value for n in made(tmp_path, held).numbers}
        assert kept["hull.R_0"] == 0.0155

    def test_sigma_shrinks_as_of_a_normal_density_on_the_balance(self, tmp_path: Path) -> None:
        """With wake, thrust deduction and propeller given, R_0 alone is open, and the balance determines it."""
        ship = made(tmp_path, GIVEN.replace("300.0", "317.0") + "pitch_ratio = 0.8\nA_R = 2.8\n" + PROPELLER).ship
        q, nD, u_P = 0.5 * 42.0 * 3.1 * ship.speed**2, 317.0 / 60.0 * 1.9, 0.8 * ship.speed
        thrust = 0.8 * 1.9**2 * (0.32 * nD**2 - 0.28 * nD * u_P - 0.15 * u_P**2)
        assert ship.entries["hull.R_0"].given == pytest.approx(thrust / q, rel=1e-6)
        assert ship.entries["hull.R_0"].sigma == pytest.approx(0.0, abs=1e-6)

    @pytest.mark.slow
    def test_a_propeller_moves_as_a_whole_by_the_sigma_of_its_pull(self, tmp_path: Path) -> None:
        """With all else given K_T alone is open: its curve keeps its form, and its move is told in sigmas of k_0."""
        held = "pitch_ratio = 0.8\n[given]\nhull.R_0 = 0.0185\npropeller.w_P0 = 0.2\npropeller.t_P = 0.2\n"
        met, bare = (made(tmp_path, more + held) for more in (GIVEN, GIVEN.replace("n_P", "# n_P")))
        after, before = ({n.path: n.value for n in one.numbers} for one in (met, bare))
        factor = after["propeller.k_0"] / before["propeller.k_0"]
        assert abs(factor - 1.0) > 0.01
        for k in ("propeller.k_1", "propeller.k_2"):
            assert after[k] / before[k] == pytest.approx(factor)
        z = (factor - 1.0) * before["propeller.k_0"] / SCATTER["propeller.k_0"]
        assert any(f"moved: propeller.k_0 by {z:+.2g} sigma" in line for line in met.cautions)

    @pytest.mark.slow
    def test_without_a_speed_the_assumed_one_moves(self, tmp_path: Path) -> None:
        bare, ship = (made(tmp_path, more).ship for more in ("", "n_P = 4.5\nD_P = 1.9\npitch_ratio = 0.8\n"))
        assert abs(surge_balance(ship, ship.speed, 4.5)) < 1e-6
        assert 0.7 < ship.speed / bare.speed < 1.3
        assert "moved by" in ship.entries["approach.speed"].source

    @pytest.mark.slow
    @pytest.mark.parametrize("more", ["", "screws = 2\ny_P = 2.0\n"], ids=["one screw", "two"])
    def test_revolutions_of_the_engine_are_refused_in_one_line(
        self, tmp_path: Path, more: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        path, out = tmp_path / "own.toml", tmp_path / "ship.toml"
        path.write_text(SHIP + GIVEN.replace("300.0", "1500.0") + more, encoding="utf-8")
        assert main(["estimate", str(path), "-o", str(out)]) == 2
        told = capsys.readouterr().err.strip()
        assert "\n" not in told
        assert "11.5 kn at 1500 rpm" in told
        assert "rpm hold it" in told
        assert "not of the engine" in told
        assert not out.exists()

    @pytest.mark.slow
    def test_where_all_is_given_revolutions_must_fit(self, tmp_path: Path) -> None:
        exact = "pitch_ratio = 0.8\n" + PROPELLER + "hull.R_0 = 0.0185\n"
        _, n_P = approach(made(tmp_path, GIVEN.replace("n_P", "# n_P") + exact).ship)
        assert made(tmp_path, GIVEN.replace("300.0", str(round(60.0 * n_P))) + exact).ship.n_P is not None
        with pytest.raises(ShipError, match=r"out of reach"):
            made(tmp_path, GIVEN.replace("300.0", str(round(72.0 * n_P))) + exact)
