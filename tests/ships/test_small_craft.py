"""Craft without a rudder: unequal thrust, side thrusters and ordered moments obey the helm as a demand in percent."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from seatrial.cli.app import main
from seatrial.core.parameters import Parts
from seatrial.data import DataError, Trial
from seatrial.forces import HARD_OVER
from seatrial.forces.thruster import Tunnel
from seatrial.forces.thruster_fixed import Fixed, Screw
from seatrial.manoeuvres import Index, by_demand
from seatrial.ships.files import load
from seatrial.ships.steering import by_angle, helm_limit, throttled
from seatrial.simulate.replay import inputs
from seatrial.simulate.run import approach
from seatrial.validate.imo import NOT_APPLICABLE, imo_table
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.propulsion import reversing
from seatrial.validate.requirements.steering import answer_varies
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Approach, Orders, Span
from seatrial.workflow.simulation import simulate

KNOT = 0.5144  # as the Otter's source rounds it


@pytest.fixture(scope="module")
def otter():
    return load("otter")


@pytest.fixture(scope="module")
def throttle_boat(otter):
    """The Otter by throttle: full throttle is full revolutions."""
    parts = {name: Fixed(y=y, T_2=119.7, astern=0.58) for name, y in (("port", -0.395), ("starboard", 0.395))}
    model = replace(otter.model, thrusters=Parts(tuple(parts), tuple(parts.values())))
    return replace(otter, name="throttle boat", model=model, actuators=type(otter.actuators)())


def published(t, nu, n_port, n_starboard):
    """Surge, sway, yaw of Fossen's Otter, written from its source: mass and added mass about midship, by itself."""
    m, m_p, x_hull, T_d, L = 55.0, 25.0, 0.2, 80.0 / 1025.0 / (2 * 0.4 * 0.25 * 2.0), 2.0
    x_G = m * x_hull / (m + m_p)
    I_G = m * 0.5**2 + m * x_G**2
    M_A = np.diag([0.1 * m, 1.5 * m, 1.7 * I_G])
    M_RB = np.array([[80.0, 0, 0], [0, 80.0, 80.0 * x_G], [0, 80.0 * x_G, I_G + 80.0 * x_G**2]])
    M = M_RB + M_A
    u, v, r = nu
    C_RB = np.array([[0, 0, -80.0 * (x_G * r + v)], [0, 0, 80.0 * u], [80.0 * (x_G * r + v), -80.0 * u, 0]])
    C_A = np.array([[0, 0, -M_A[1, 1] * v], [0, 0, M_A[0, 0] * u], [0, 0, 0]])  # without the Munk moment
    D = np.diag([24.4 * 9.81 / (6 * KNOT), 0.0, M[2, 2]])
    strips = (np.arange(400) + 0.5) / 400 * L - L / 2
    across = 0.5 * 1025.0 * T_d * 1.0042 * np.abs(v + strips * r) * (v + strips * r) * L / 400
    thrust = [(0.02216 if n > 0 else 0.01289) / 2 * (2 * math.pi * n) * abs(2 * math.pi * n)
              for n in (n_port, n_starboard)]  # fmt: skip
    tau = np.array([sum(thrust), -across.sum(),
                    0.395 * (thrust[0] - thrust[1]) - (strips * across).sum() - 10 * M[2, 2] * abs(r) * r])  # fmt: skip
    return np.linalg.solve(M, tau - (C_RB + C_A) @ nu - D @ nu)


def test_the_otter_moves_as_its_source(otter):
    run = simulate(otter, "turning", orders=Orders(steer=25.0), span=Span(20.0)).trial
    n_port, n_starboard = run["n_port_cmd"][-1], run["n_starboard_cmd"][-1]
    begun = int(np.searchsorted(run.t, 10.0))  # propellers settled
    nu = run.stack("u", "v_m", "r")
    truth = solve_ivp(published, (run.t[begun], run.t[-1]), nu[begun], args=(n_port, n_starboard), rtol=1e-8)
    assert nu[-1] == pytest.approx(truth.y[:, -1], rel=2e-3)


def test_full_ahead_is_the_six_knots_of_the_source(otter):
    full = simulate(otter, "acceleration", begin=Approach(rps=16.541)).indices["final_speed"].value
    assert full == pytest.approx(6 * KNOT, rel=1e-3)


@pytest.mark.parametrize("side", ["starboard", "port"])
def test_the_demand_turns_to_its_side_by_more_thrust_on_the_other(otter, side):
    run = simulate(otter, "turning", orders=Orders(steer=30.0, side=side)).trial
    sign = 1.0 if side == "starboard" else -1.0
    assert sign * run["r"][-1] > 0.05
    unequal = run["n_port_cmd"][-1] - run["n_starboard_cmd"][-1]
    assert unequal == pytest.approx(sign * 2 * 0.3 * 16.541)
    assert run["n_port_cmd"][-1] + run["n_starboard_cmd"][-1] == pytest.approx(2 * run["n_P_cmd"][-1])
    assert run["delta_cmd"][-1] == pytest.approx(sign * 0.3 * HARD_OVER)


def test_throttle_is_the_order_ahead_and_is_found_for_a_speed(throttle_boat):
    assert throttled(throttle_boat)
    assert not throttled(load("otter"))
    U, share = approach(throttle_boat, speed=1.5)
    drag = 77.55443234836702 * U
    assert 2 * 119.7 * share**2 == pytest.approx(drag)
    ran = simulate(throttle_boat, "zigzag", orders=Orders(steer=25.0, heading=20.0), begin=Approach(throttle=60.0))
    assert ran.complete
    assert ran.settings["throttle"] == pytest.approx(60.0)
    assert ran.settings["steer"] == pytest.approx(25.0)
    assert "rudder" not in ran.settings
    assert "rps" not in ran.settings
    assert ran.indices["first_overshoot"].value > 0


@pytest.mark.slow
def test_a_side_thruster_steers_where_its_file_says_so(otter):
    bow = Tunnel(x=0.8, D=0.1, T_0=20.0, n_0=20.0, n_per_delta=20.0 / HARD_OVER)
    screw = Screw(y=0.0, k=0.8, n_max=16.5)
    model = replace(otter.model, thrusters=Parts(("bow", "stern"), (bow, screw)))
    craft = replace(otter, model=model, actuators=type(otter.actuators)())
    assert model.obeying("delta") == ("n_bow",)
    run = simulate(craft, "turning", orders=Orders(steer=50.0)).trial
    assert run["n_bow_cmd"][-1] == pytest.approx(10.0)
    assert run["r"][-1] > 0.01
    assert not by_angle(craft)


def test_what_steers_by_an_angle_keeps_its_rudder():
    for name in ("kvlcc2_l7", "qiuxin5", "milliampere", "twin_virtual"):
        ship = load(name)
        assert by_angle(ship)
        assert not any(ship.model.differential)
    assert helm_limit(load("kvlcc2_l7")) == pytest.approx(math.radians(35.0))
    assert helm_limit(load("otter")) == HARD_OVER


@pytest.mark.parametrize(
    ("ship", "given", "said"),
    [
        ("otter", Orders(10.0), "has no rudder; give --steer"),
        ("kvlcc2_l7", Orders(steer=10.0), "steered by an angle; give --rudder"),
        ("otter", Orders(steer=101.0), "at most 100"),
        ("otter", Approach(throttle=10.0), "driven by revolutions; give --rps"),
        ("otter", Orders(steer=math.nan), "at most 100"),
    ],
)
def test_the_wrong_word_for_helm_or_engine_is_refused(ship, given, said):
    with pytest.raises(RequestError, match=said):
        simulate(ship, "zigzag", **{"orders" if isinstance(given, Orders) else "begin": given})


def test_rps_of_a_throttle_boat_is_refused(throttle_boat):
    with pytest.raises(RequestError, match="give --throttle in percent"):
        simulate(throttle_boat, "zigzag", begin=Approach(rps=1.0))


def test_figures_of_the_rudder_become_percent_of_the_demand():
    found = by_demand({
        "neutral_rudder": Index(0.1 * HARD_OVER, "rad", helm=1), "slope": Index(HARD_OVER, "s", helm=1),
        "turning_quality": Index(100.0 / HARD_OVER, "-", helm=-1), "advance": Index(3.0, "m", 1.5),
    })  # fmt: skip
    assert found["neutral_steer"].value == pytest.approx(10.0)
    assert found["neutral_steer"].unit == "%"
    assert found["slope"].unit == "% s/rad"
    assert found["slope"].value == pytest.approx(100.0)
    assert found["turning_quality"].value == pytest.approx(1.0)
    assert found["advance"] == Index(3.0, "m", 1.5)


@pytest.mark.slow
def test_a_spiral_has_its_neutral_demand_at_the_unequal_thrust(otter):
    weak = replace(otter.model.thrusters.components[1], k=0.9 * otter.model.thrusters.components[1].k)
    model = replace(otter.model, thrusters=Parts(("port", "starboard"), (otter.model.thrusters.components[0], weak)))
    ran = simulate(replace(otter, model=model), "spiral")
    # Straight where both push alike: k n_1^2 = 0.9 k n_2^2 with n_1 + n_2 = 2 n and n_1 - n_2 = 2 d n_max.
    n = approach(replace(otter, model=model))[1]
    d = n * (math.sqrt(0.9) - 1) / (math.sqrt(0.9) + 1) / 16.541
    near = 0.05 * ran.indices["resolution"].value  # linear between two steps of the spiral
    assert ran.indices["neutral_steer"].value == pytest.approx(100 * d, abs=near)


@pytest.mark.slow
def test_the_standards_angles_are_not_applicable_and_hard_over_is(otter):
    table = imo_table(otter)
    assert [row.verdict == NOT_APPLICABLE for row in table.rows if "rudder 10" in row.name] == [True, True]
    advance = next(row for row in table.rows if row.name == "advance, full steering demand")
    assert advance.value == pytest.approx(simulate(otter, "turning").indices["advance"].over_L)


def test_requirements_judge_unequal_thrust_as_such(otter):
    assert answer_varies(Probe.of(otter)).verdict == "pass"
    assert reversing(Probe.of(otter)).verdict == "pass"


@pytest.mark.parametrize("fault", ["sides swapped", "one side twice as strong astern"])
def test_requirements_find_wrong_thrusters(otter, fault):
    port, starboard = otter.model.thrusters.components
    if fault == "sides swapped":  # the file names the places of each other: a wrong sign of the lever in the force

        class Crossed(Screw):
            def force(self, flow, control):
                X, Y, N = super().force(flow, control)
                return type(super().force(flow, control))(X, Y, -N)

        names = ("y", "k", "astern", "n_max")
        parts = tuple(Crossed(**{n: getattr(part, n) for n in names}) for part in (port, starboard))
        model = replace(otter.model, thrusters=Parts(("port", "starboard"), parts))
        assert answer_varies(Probe.of(replace(otter, model=model))).verdict == "fail"
    else:
        model = replace(otter.model, thrusters=Parts(("port", "starboard"), (port, replace(starboard, astern=1.2))))
        judgement = reversing(Probe.of(replace(otter, model=model)))
        assert judgement.verdict == "fail"
        assert "swing the stern" in judgement.reason


def test_a_log_without_the_revolutions_of_each_side_cannot_be_replayed(otter):
    run = simulate(otter, "turning", orders=Orders(steer=25.0), span=Span(10.0)).trial
    kept = {name: run[name] for name in ("x", "y", "psi", "u", "v_m", "r")}
    whole = Trial("whole", run.t, {**kept, "n_port": run["n_port"], "n_starboard": run["n_starboard"]})
    assert len(inputs(whole, otter.model)) == len(run)
    common = Trial("common", run.t, {**kept, "n_P": run["n_P_cmd"], "delta": run["delta_cmd"]})
    with pytest.raises(DataError, match="no channel n_port"):
        inputs(common, otter.model)


@pytest.mark.parametrize(("word", "status"), [("steer", 0), ("rudder", 2)])
def test_a_campaign_takes_the_demand_too(word, status, tmp_path, capsys):
    path = tmp_path / "campaign.toml"
    path.write_text(f"""schema = "seatrial-campaign/1"
ships = ["otter"]
runs = 4
[manoeuvre]
kind = "zigzag"
{word} = 40.0
heading = 20.0
duration = 20.0
[inputs]
"ship.damping.N_r" = {{ normal = [-41.4, 2.0] }}
""")
    assert main(["campaign", str(path), "-o", str(tmp_path / "runs")]) == status
    assert ("give --steer" in capsys.readouterr().err) is (status == 2)
