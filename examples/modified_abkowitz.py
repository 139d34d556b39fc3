"""Fit the modified Abkowitz model to another ship, for no coefficients of it were ever found in public.

The 7 m KVLCC2 (an MMG model) runs turning circles, zigzags, straight runs at several revolutions and short runs
that begin with drift; the modified Abkowitz model is linear in its derivatives, so least squares on the
accelerations give them at once.  Without an argument the script compares both ships on manoeuvres that the fit
never saw; with a file name it writes the ship file that the library holds.

    python examples/modified_abkowitz.py [modified_abkowitz_kvlcc2_l7.toml]
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import fields, replace
from math import degrees, radians
from typing import Any

import casadi as ca
import numpy as np

import seatrial as st

Turning = st.manoeuvres.turning.Turning
Zigzag = st.manoeuvres.zigzag.Zigzag
Derivatives, ModifiedAbkowitz = st.models.abkowitz_modified.Derivatives, st.models.abkowitz_modified.ModifiedAbkowitz

CHANNELS = ("u", "v_m", "r", "n_P", "delta")
FITTED = tuple(f.name for f in fields(Derivatives) if f.name not in ("C_R", "S"))
DIGITS = 6
NOTES = {
    "title": "KVLCC2 tanker, 7 m model, modified Abkowitz model fitted to simulated data of KVLCC2 L7",
    "references": [
        "Abkowitz, M. A. (1980): Measurement of hydrodynamic characteristics from ship maneuvering trials by system "
        "identification. SNAME Transactions 88, 283-318",
        "Sawada et al.: Perspective on the marine simulator for autonomous vessel development, Eqs. 21 to 23",
    ],
    "cautions": [
        "Not a published set: least squares on the accelerations that the MMG model of kvlcc2_l7 gave "
        "(examples/modified_abkowitz.py).",
        "It knows one flow straightening for both sides: of manoeuvres it never saw it gives advance and tactical "
        "diameter within 3 %, steady diameters within 8 % and overshoots within 3 deg of kvlcc2_l7.",
        "The validity limits are the range of the data: ahead, propeller ahead.",
    ],
}


def records(ship: st.Ship) -> np.ndarray:
    """What the ship goes through, one row of `CHANNELS` every half second; shape (samples, 5)."""
    U, n = st.approach(ship)
    free = replace(ship, validity={})
    turns = [(Turning(a * n, radians(deg)), min(a, 1.0) * U)
             for a in (0.7, 1.0, 1.2) for deg in (35, -35, 20, -20, 10, -10, 5, -5, 0)]  # fmt: skip
    zigzags = [(Zigzag(a * n, radians(rudder), radians(heading), side), a * U)
               for rudder, heading in ((10, 10), (20, 20), (10, 5), (20, 10), (35, 20))
               for a in (0.7, 1.0) for side in (1.0, -1.0)]  # fmt: skip
    straight = [(Turning(a * n, 0.0), b * U) for a in (0.5, 0.8, 1.0, 1.2) for b in (0.4, 0.7, 0.85, 1.0)]
    trials = [
        st.run_policy(free, policy, speed=speed, duration=duration, dt=0.05, every=10)
        for runs, duration in ((turns, 150.0), (zigzags, 150.0), (straight, 60.0)) for policy, speed in runs
    ]  # fmt: skip
    trials += [
        st.run_policy(
            free, Turning(n, radians(deg)), duration=15.0, dt=0.05, every=10, start=(0.0, 0.0, 0.0, 1.0, v, r)
        )
        for v in (0.25, 0.4, -0.25, -0.4) for r in (0.0, 0.06, -0.06) for deg in (0, 25, -25)
    ]  # fmt: skip
    rows = np.vstack([np.column_stack([trial.channels[name] for name in CHANNELS]) for trial in trials])
    return rows[np.isfinite(rows).all(axis=1)]


def known(ship: st.Ship) -> ModifiedAbkowitz:
    """The model with all that needs no fit: masses, propeller, rudder's share of the race, resistance."""
    mmg: Any = ship.model
    hull, L, d = mmg.body, mmg.body.L_pp, mmg.body.d
    mass, inertia = 0.5 * hull.rho * L**3, 0.5 * hull.rho * L**5
    body = st.models.abkowitz.Body(
        L_pp=L, m=hull.m / mass, I_z=(hull.I_zG + hull.m * hull.x_G**2) / inertia, x_G=hull.x_G / L,
        X_udot=-hull.m_x / mass, Y_vdot=-hull.m_y / mass, Y_rdot=0.0, N_vdot=0.0, N_rdot=-hull.J_z / inertia,
    )  # fmt: skip
    screw = mmg.propeller
    race = st.models.abkowitz_modified.Race(D_P=screw.D_P, k_0=screw.k_0, k_1=screw.k_1, k_2=screw.k_2, w=screw.w_P0,
                k=mmg.rudder.kappa, washed=mmg.rudder.eta)  # fmt: skip
    wetted = 1.7 * L * d + hull.m / hull.rho / d  # Denny and Mumford
    nothing = dict.fromkeys(FITTED, 0.0)
    derivatives = Derivatives(**nothing, S=wetted / L**2, C_R=mmg.hull.R_0 * L * d / wetted)
    U, n = st.approach(ship)
    return ModifiedAbkowitz(body=body, race=race, derivatives=derivatives, c_0=race.flow(U, n)[0] / U)


def least_squares(ship: st.Ship, model: ModifiedAbkowitz, rows: np.ndarray) -> dict[str, float]:
    """The derivatives that give the ship's accelerations at the rows, each row of (u, v_m, r) by its spread."""
    x, p = ca.SX.sym("x", len(CHANNELS)), ca.SX.sym("p", len(FITTED))
    state, control = (0.0, 0.0, 0.0, x[0], x[1], x[2]), (x[3], x[4])
    trial = st.parameters.update(model, {f"derivatives.{name}": p[k] for k, name in enumerate(FITTED)})
    theirs = ca.vertcat(*ship.model.derivative(state, control, st.environment.CALM)[3:])
    ours = ca.vertcat(*trial.derivative(state, control, st.environment.CALM)[3:])
    at_zero = [ca.substitute(e, p, ca.DM.zeros(len(FITTED))) for e in (ca.jacobian(ours, p), theirs - ours)]
    design, target = ca.Function("f", [x], at_zero).map(len(rows))(rows.T)
    A = design.full().reshape(3, len(rows), len(FITTED))
    y = target.full()
    weight = 1.0 / y.std(axis=1)
    A, y = (A * weight[:, None, None]).reshape(-1, len(FITTED)), (y * weight[:, None]).ravel()
    size = np.linalg.norm(A, axis=0)
    found = np.linalg.lstsq(A / size, y, rcond=None)[0] / size
    return {name: float(f"{value:.{DIGITS}g}") for name, value in zip(FITTED, found, strict=True)}


def provenance(model: ModifiedAbkowitz) -> Mapping[str, st.Entry]:
    """Where each number comes from."""
    taken = "as kvlcc2_l7"
    said = {"derivatives.S": f"1.7 L d + volume/d (Denny and Mumford) over L^2, {taken}",
            "derivatives.C_R": f"R_0 L d/S, {taken}", "race.w": f"w_P0 {taken}", "race.k": f"kappa {taken}",
            "race.washed": f"eta {taken}", "c_0": "c at the approach of kvlcc2_l7, over its speed"}  # fmt: skip
    said |= {f"derivatives.{name}": "fitted to simulated data of kvlcc2_l7" for name in FITTED}
    primed = ("derivatives.", "c_0", "body.")
    found: dict[str, st.Entry] = {}
    for path, value in st.parameters.values(model).items():
        system = " over 0.5 rho L^3 (masses), 0.5 rho L^5 (inertia)" if path.startswith("body.") else ""
        prime = path.startswith(primed) and path != "body.L_pp"
        unit = {"body.L_pp": "m", "race.D_P": "m"}.get(path, "")
        found[path] = st.Entry(said.get(path, taken + (system if prime else "")), float(value), prime=prime, unit=unit)
    return found


def fitted(ship: st.Ship) -> st.Ship:
    """The modified Abkowitz ship that behaves like `ship`."""
    model, rows = known(ship), records(ship)
    found = least_squares(ship, model, rows)
    model = st.parameters.update(model, {f"derivatives.{name}": value for name, value in found.items()})
    low, high = rows.min(axis=0), rows.max(axis=0)
    validity = {name: (float(np.floor(a * 100) / 100), float(np.ceil(b * 100) / 100))
                for name, a, b in zip(CHANNELS, low, high, strict=True)}  # fmt: skip
    kept = {k: e for k, e in ship.entries.items() if k.startswith(("approach.", "actuators."))}
    return st.Ship("modified_abkowitz_kvlcc2_l7", model, ship.actuators, ship.L_pp, ship.speed, validity=validity,
                entries={**kept, **provenance(model)}, notes=NOTES)  # fmt: skip


def unseen(ship: st.Ship) -> tuple[tuple[Any, float], ...]:
    """Manoeuvres that the fit never saw, with their durations [s]."""
    n = st.approach(ship)[1]
    return (
        *((Turning(n, radians(deg)), 250.0) for deg in (30, -30, 25, -25, 15, -15)),
        (Turning(0.85 * n, radians(30)), 250.0),
        *((Zigzag(n, radians(15), radians(15), side), 250.0) for side in (1.0, -1.0)),
        *((Zigzag(n, radians(20), radians(15), side), 250.0) for side in (1.0, -1.0)),
    )


def compared(ship: st.Ship, other: st.Ship) -> list[tuple[str, str, float, float]]:
    """(manoeuvre, index, figure of the ship, figure of the other) over the unseen ones."""
    shown = ("advance", "tactical_diameter", "steady_diameter", "speed_loss", "first_overshoot", "second_overshoot")
    found: list[tuple[str, str, float, float]] = []
    for policy, duration in unseen(ship):
        a, b = (
            policy.indices(
                st.run_policy(replace(s, validity={}), policy, speed=ship.speed, duration=duration), ship.L_pp
            )
            for s in (ship, other)
        )
        label = f"{policy.kind} {degrees(policy.delta) * getattr(policy, 'side', 1.0):+.0f} at {policy.n_P:.2f} 1/s"
        found += [(label, name, a[name].value, b[name].value) for name in shown if name in a and name in b]
    return found


if __name__ == "__main__":
    origin = st.load("kvlcc2_l7")
    copy = fitted(origin)
    if len(sys.argv) > 1:
        st.save(copy, sys.argv[1])
    for manoeuvre, name, a, b in compared(origin, copy):
        sys.stdout.write(f"{manoeuvre:26} {name:18} {a:8.3f} {b:8.3f}\n")
