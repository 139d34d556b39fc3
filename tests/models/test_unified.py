"""The unified model: free motion and response against the frequency domain, energy, and manoeuvring left as it was."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from seatrial.core.parameters import Parts
from seatrial.environment import Environment, InWaves
from seatrial.environment.sea.hydrodynamics import Hydrodynamics
from seatrial.environment.sea.reading import read_hydrodynamics
from seatrial.manoeuvres.turning import Turning
from seatrial.models.mmg_roll import MmgRoll, Roll
from seatrial.models.unified import Heave, Unified
from seatrial.ships import Ship, ShipError
from seatrial.ships.at_sea import fast_masses, with_memory
from seatrial.ships.files import load, save
from seatrial.simulate.run import simulate

pytest.importorskip("h5netcdf")
HULL = Path(__file__).parent.parent / "environment" / "sea" / "wigley.nc"


@cache
def data() -> Hydrodynamics:
    return read_hydrodynamics(HULL)


@cache
def horizontal() -> Ship:
    """An MMG ship of the size of the parabolic hull: KVLCC2's primes on 100 m, a numerical ship of no towing tank."""
    big: Any = load("kvlcc2")
    m = float(data().M[2, 2])
    body = replace(big.model.body, L_pp=100.0, B=10.0, d=6.25, m=m, x_G=0.0, I_zG=m * 625.0, m_x=0.05 * m,
                   m_y=0.9 * m, J_z=0.7 * m * 625.0)  # fmt: skip
    model = replace(
        big.model, body=body, propeller=replace(big.model.propeller, D_P=4.0, x_P=-48.0), wind=None, waves=None,
        rudder=replace(big.model.rudder, A_R=12.0, x_H=-46.4, x_R=-50.0, l_R=-71.0),
    )  # fmt: skip
    return replace(big, name="parabolic", model=model, L_pp=100.0, speed=5.0, n_P=None, validity={}, entries={})


@cache
def ship(added: str = "ship") -> Ship:
    return with_memory(horizontal(), data(), 0.05, added)


@cache
def linear() -> tuple[np.ndarray, np.ndarray, Any]:
    """State matrix and wave-force matrix at rest, added masses those of the data."""
    model: Any = ship("data").model
    n = len(model.states)
    x, f = ca.SX.sym("x", n), ca.SX.sym("f", 6)
    around = InWaves(Environment(), tuple(f[i] for i in range(6)))  # type: ignore[arg-type]
    rates = ca.vertcat(*model.derivative(tuple(x[i] for i in range(n)), (0.0, 0.0), around))
    both = ca.Function("j", [x, f], [ca.jacobian(rates, x), ca.jacobian(rates, f)])(np.zeros(n), np.zeros(6))
    return both[0].full(), both[1].full(), model


def places(*names: str) -> list[int]:
    return [linear()[2].states.index(name) for name in names]


def followed(step: np.ndarray, start: np.ndarray, rows: int) -> np.ndarray:
    """States from a start by the matrix of one step, shape (rows, states)."""
    out = [start]
    for _ in range(rows - 1):
        out.append(step @ out[-1])
    return np.array(out)


SIX = ("x", "y", "z", "phi", "theta", "psi")


@pytest.mark.long
def test_small_motions_are_those_of_the_frequency_domain() -> None:
    """Sway, heave, roll, pitch and yaw per metre of wave: amplitudes to 1 %, phases to 1 deg.

    Of each motion at each frequency the directions count that have a tenth of its largest response there.
    """
    A, B, model = linear()
    here = data().moved(0.0, 0.0, data().z_G)
    wanted = here.rao(0.0, further=np.diag([0.0, 0.0, 0.0, float(model.roll.B_1), 0.0, 0.0]))
    rows, unit = places(*SIX), np.eye(len(A))
    for k, omega in enumerate(here.omega):
        if not 0.25 < omega < 1.8 or k % 2:
            continue
        found = np.linalg.solve(1j * omega * unit - A, B)[rows] @ here.F[k].T
        for mode in range(1, 6):
            exact = wanted.R[k, :, mode]
            counts = np.abs(exact) > 0.1 * np.abs(exact).max()
            ratio = (found[mode] / exact)[counts]
            assert np.abs(np.abs(ratio) - 1.0).max() < 0.01, f"{SIX[mode]} at {omega:.2f} rad/s"
            assert np.abs(np.angle(ratio)).max() < math.radians(1.0), f"{SIX[mode]} at {omega:.2f} rad/s"


@pytest.mark.slow
def test_a_decay_is_that_of_the_impulse_response() -> None:
    """Released from 0.5 m of heave and from a degree of pitch: the inverse transform of the data's own response.

    z(t) = (2/pi) int Re[Z(omega)] cos(omega t) d omega,
    Z = (i omega (M + A) + B) z_0 / (-omega^2 (M + A) + i omega B + C),
    whose data end at 3.2 rad/s; to 2 % of the start.
    """
    A, _, _ = linear()
    here = data().moved(0.0, 0.0, data().z_G)
    own = np.ix_((2, 4), (2, 4))
    omega = np.linspace(0.005, here.omega[-1], 1500)
    added, damping = here.at(omega)
    damping = damping * np.minimum(omega / here.omega[0], 1.0)[:, None, None] ** 2
    t = np.arange(0.0, 30.0, 0.5)
    start = np.zeros(len(A))
    start[places("z", "theta")] = 0.5, math.radians(1.0)
    found = followed(expm(A * 0.5), start, t.size)[:, places("z", "theta")]
    M = (here.M + added)[:, own[0], own[1]]
    K = damping[:, own[0], own[1]]
    C = here.C[own]
    w = omega[:, None, None]
    first = start[places("z", "theta")]
    Z = np.linalg.solve(-(w**2) * M + 1j * w * K + C, ((1j * w * M + K) @ first)[..., None])[..., 0]
    exact = 2.0 / math.pi * np.trapezoid(Z.real[None] * np.cos(np.outer(t, omega))[..., None], omega, axis=1)
    size = np.abs(first)
    assert (np.abs(found - exact)[2:] / size).max() < 0.02


@pytest.mark.slow
def test_energy_never_exceeds_what_it_began_with() -> None:
    """Kinetic and potential energy of a hull that is struck and released in water at rest.

    A blow changes the velocity, and with it h of each section by as much.
    """
    A, _, model = linear()
    along, aside = fast_masses(model)
    groups = ((("u", "w", "q"), along), (("v_m", "p", "r"), aside))
    weight = float(model.body.m) * 9.81 * float(model.roll.GM)
    stiff = np.array([[model.heave.C_33, model.heave.C_35], [model.heave.C_35, model.heave.C_55]])
    t = np.arange(0.0, 60.0, 0.2)
    step = expm(A * 0.2)
    scale = {"z": 1.0, "theta": 0.02, "phi": 0.1, "u": 1.0, "v_m": 1.0, "w": 1.0, "q": 0.02, "p": 0.1, "r": 0.01}
    for seed in range(5):
        random = np.random.default_rng(seed)
        start = np.zeros(len(A))
        start[places(*scale)] = random.normal(size=len(scale)) * np.array(list(scale.values()))
        for k, name in enumerate(model.states):
            if name.startswith("h_"):
                of = {"u": "u", "w": "w", "q": "q", "v": "v_m", "p": "p", "r": "r"}[name[2]]
                start[k] = start[model.states.index(of)]
        states = followed(step, start, t.size)
        energy = np.zeros(t.size)
        for names, mass in groups:
            v = states[:, places(*names)]
            energy += 0.5 * np.einsum("ti,ij,tj->t", v, mass, v)
        moved = states[:, places("z", "theta")]
        energy += 0.5 * np.einsum("ti,ij,tj->t", moved, stiff, moved)
        energy += 0.5 * weight * states[:, places("phi")[0]] ** 2
        assert energy.max() <= energy[0] * (1.0 + 1e-6)
        assert energy[-1] < 0.9 * energy[0]


@pytest.mark.slow
def test_all_modes_fade() -> None:
    """No eigenvalue to the right; those at zero are place and heading, and what drifts on without damping."""
    A, _, _ = linear()
    assert np.linalg.eigvals(A).real.max() < 1e-6


@pytest.mark.slow
def test_manoeuvres_in_calm_water_are_those_of_the_ship_that_rolls() -> None:
    """A 35 degree turn: what is steady equal to 1e-4, what changes to 2 %: the memory sees accelerations alone."""
    whole: Any = ship()
    shared = {name: vars(whole.model)[name] for name in MmgRoll.__dataclass_fields__}
    plain = replace(whole, model=MmgRoll(**shared))
    policy = Turning(delta=math.radians(35.0), n_P=2.2239)
    one, other = (simulate(each, policy, speed=5.0, duration=600.0, dt=0.1, every=10) for each in (whole, plain))
    for name in ("u", "v_m", "r", "phi"):
        assert one[name][-1] == pytest.approx(other[name][-1], rel=1e-4), name
    apart = np.hypot(one["x"] - other["x"], one["y"] - other["y"]).max()
    assert 1e-6 < apart < 0.02 * 100.0
    a, b = (policy.indices(each, 100.0) for each in (one, other))
    for name in ("advance", "tactical_diameter", "transfer"):
        assert a[name].value == pytest.approx(b[name].value, rel=0.02), name


@pytest.mark.slow
def test_without_memory_it_is_the_ship_that_rolls() -> None:
    """No sections: the eight rates to rounding."""
    model: Any = ship().model
    bare = replace(model, longitudinal=Parts(), transverse=Parts())
    bare = replace(bare, heave=replace(bare.heave, A_13=0.0, A_15=0.0))
    shared = {name: vars(bare)[name] for name in MmgRoll.__dataclass_fields__}
    eight = (0.0, 0.0, 0.4, 5.0, 0.3, 0.02, 0.05, 0.01)
    one = bare.derivative((*eight, 0.1, 0.05, 0.01, -0.01), (2.2, 0.3), Environment())
    other = MmgRoll(**shared).derivative(eight, (2.2, 0.3), Environment())
    assert one[:8] == pytest.approx(other, rel=1e-12)


@pytest.mark.slow
def test_a_file_keeps_it(tmp_path: Path) -> None:
    save(ship(), tmp_path / "a.toml")
    back: Any = load(tmp_path / "a.toml")
    assert back.model == ship().model
    assert back.model.states[8:12] == ("z", "w", "theta", "q")
    text = (tmp_path / "a.toml").read_text()
    (tmp_path / "b.toml").write_text(text.replace("radiation:Lateral", "radiation:Longitudinal", 1))
    with pytest.raises(ShipError) as told:
        load(tmp_path / "b.toml")
    assert "\n" not in str(told.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda d: replace(d, M=d.M * 1e-3), "kg; give the data of this hull"),  # tonnes
        (lambda d: replace(d, C=d.C * np.diag([1.0, 1.0, 1e3, 1.0, 1.0, 1.0])), "water plane"),
        (lambda d: replace(d, M=d.M * np.diag([1.0] * 4 + [9.0, 1.0])), "radius of gyration"),
        (lambda d: d.moved(20.0, 0.0, 0.0), "begin the axes midship"),
        (lambda d: replace(d, C=d.C * np.diag([1.0] * 3 + [-1.0, 1.0, 1.0])), "GM"),
        (lambda d: replace(d, A=d.A * 6.0, B=d.B * 6.0), "--added data"),
        (lambda d: replace(d, modes=(0, 1, 2, 5)), "no heave, roll or pitch"),
    ],
)
def test_data_of_another_hull_are_refused(spoil: Any, said: str) -> None:
    with pytest.raises(ShipError, match=said) as told:
        with_memory(horizontal(), spoil(data()))
    assert "\n" not in str(told.value)
    with pytest.raises(ShipError, match="another family"):
        with_memory(load("naval_blanke"), data())


@pytest.mark.slow
def test_its_sections_are_of_their_group() -> None:
    model: Any = ship().model
    with pytest.raises(Exception, match="radiation:Longitudinal"):
        replace(model, longitudinal=model.transverse)
    assert isinstance(model, Unified)
    assert len(model.sides) == len(model.states) - 6


ROLL_OF_L7 = Roll(I_x=800.0, J_x=150.0, GM=0.1, B_1=20.0, z_H=0.05, z_R=0.1, l_x=0.02, l_y=0.07)
HEAVE_OF_L7 = Heave(I_y=9000.0, A_13=40.0, A_15=-70.0, A_33=3100.0, A_35=250.0, A_55=8000.0, A_26=110.0, A_46=-35.0,
                    C_33=7e4, C_35=-3e3, C_55=2e5, B_33=5e3, B_55=9e3)  # fmt: skip


def afloat_at_rest() -> Any:
    """A ship without memory whose centre of gravity is ahead of midship."""
    ship: Any = load("kvlcc2_l7")
    assert float(ship.model.body.x_G) > 0.1
    return Unified(**vars(ship.model), roll=ROLL_OF_L7, heave=HEAVE_OF_L7)


def accelerations(model: Any, state: tuple[float, ...], forces: np.ndarray) -> np.ndarray:
    """Of surge, sway, heave, roll, pitch, yaw."""
    rates = model.derivative(state, (0.0, 0.0), InWaves(Environment(), tuple(forces.tolist())))
    u, v_m, r, p, w, q = (model.states.index(name) for name in ("u", "v_m", "r", "p", "w", "q"))
    return np.array([float(rates[k]) for k in (u, v_m, w, p, q, r)])


def test_the_mass_of_a_ship_at_rest_is_its_own_about_midship_and_what_the_water_adds() -> None:
    """Rigid body with the centre of gravity x_G ahead (Fossen 2011, eq. 3.44), by a unit force on each motion."""
    model, b = afloat_at_rest(), load("kvlcc2_l7").model.body
    rest, h, roll = (0.0,) * len(model.states), HEAVE_OF_L7, ROLL_OF_L7
    found = np.linalg.inv(np.column_stack([accelerations(model, rest, one) for one in 1e3 * np.eye(6)]) / 1e3)
    m, x_G = float(b.m), float(b.x_G)
    rigid = np.diag([m, m, m, roll.I_x, h.I_y, float(b.I_zG) + m * x_G**2])
    rigid[2, 4] = rigid[4, 2] = -m * x_G
    rigid[1, 5] = rigid[5, 1] = m * x_G
    added = np.diag([float(b.m_x), float(b.m_y), h.A_33, roll.J_x, h.A_55, float(b.J_z)])
    for (i, j), value in {(0, 2): h.A_13, (0, 4): h.A_15, (2, 4): h.A_35, (1, 5): h.A_26, (3, 5): h.A_46,
                          (1, 3): -float(b.m_y) * roll.l_y}.items():  # fmt: skip
        added[i, j] = added[j, i] = value
    assert found == pytest.approx(rigid + added, rel=1e-9, abs=1e-6)


def test_a_ship_out_of_its_trim_is_pushed_back_and_damped_as_its_stiffness_and_damping_say() -> None:
    model, h = afloat_at_rest(), HEAVE_OF_L7
    names, rest = model.states, [0.0] * len(model.states)
    mass = np.linalg.inv(np.column_stack([accelerations(model, tuple(rest), one) for one in np.eye(6)]))
    for name, force, moment in (("z", -h.C_33, -h.C_35), ("theta", -h.C_35, -h.C_55), ("w", -h.B_33, 0.0),
                                ("q", 0.0, -h.B_55)):  # fmt: skip
        state = list(rest)
        state[names.index(name)] = 0.01
        found = mass @ accelerations(model, tuple(state), np.zeros(6))
        assert found[[2, 4]] == pytest.approx([0.01 * force, 0.01 * moment], rel=1e-9, abs=1e-9)
        assert found[0] == pytest.approx(0.0, abs=1e-9)
