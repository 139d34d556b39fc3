"""A tug berths under model predictive control; the controller knows exported files of a model, not the tug itself.

The plan is a curve to a berth 3 m aside of the approach, along which the tug comes to rest.  Every 1 s the
controller looks 25 s ahead and orders revolutions and directions of both azimuth thrusters within their limits.
What answers is the published tug, actuators included, whichever model the controller has of it: an identified
one is judged by what it does to the true ship.  There is a current, and it is measured.

Run from anywhere: python examples/mpc_berthing.py [MODEL]; the published tug where no other is named
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

STEP, HORIZON, SUBSTEPS = 1.0, 25, 5
"""Time between orders [s], steps of the horizon, steps of the plant between two orders."""

LENGTH, ASIDE, DURATION = 20.0, 3.0, 80.0
"""The plan: metres ahead and to starboard of the start, and the time that it takes [s]."""

LEAST, MOST = 0.5, 10.0
"""Revolutions [1/s]: a propeller that stands still has no direction, and the solver no slope."""

TRUTH = "qiuxin5"
CONTROLS = ("n_1", "alpha_1", "n_2", "alpha_2")

CURRENT = (0.02, -0.03)
"""Velocity of the water north and east [m/s]."""

WEIGHTS = np.array([10.0, 10.0, 20.0, 2.0, 0.5, 2.0])
"""Of errors in x, y [1/m^2], psi, u, v_m, r."""


HOLDS = 1e-2
"""Greatest error of the equations in a plan that is followed, in SI units."""

SOLVER = {
    "print_level": 0, "sb": "yes", "mu_init": 1e-2, "tol": 1e-4, "max_iter": 50,
    # The tug's damping has kinks at v = 0 and r = 0, where slopes never settle: stop once the cost does.
    "acceptable_tol": 1e3, "acceptable_obj_change_tol": 1e-3, "acceptable_constr_viol_tol": 1e-4,
    "acceptable_compl_inf_tol": 1.0, "acceptable_iter": 3,
}  # fmt: skip


def export(folder: Path, model: str = TRUTH) -> None:
    """What `seatrial export MODEL --casadi tug.casadi` does, the rates of its servos, and the true tug with actuators.

    Raises:
        ValueError: a model whose controls are not those of the tug, or whose thrusters turn at any rate.
    """
    import seatrial as st

    ship = st.load(model)
    if tuple(ship.model.controls) != CONTROLS:
        raise ValueError(f"{model}: its controls are {', '.join(ship.model.controls)}; a tug has {', '.join(CONTROLS)}")
    turn = [float(getattr(ship.actuators.of(name), "rate", math.inf)) for name in CONTROLS[1::2]]
    if not np.isfinite(turn).all():
        raise ValueError(f"{model}: give the thrusters a rate of turn, [actuators.alpha_1] and [actuators.alpha_2]")
    st.save_casadi(st.equations_of(ship, STEP / SUBSTEPS), folder / "tug.casadi")
    st.save_casadi(st.equations_of(st.load(TRUTH), STEP / SUBSTEPS), folder / "true.casadi")
    (folder / "turn.json").write_text(json.dumps(turn), encoding="utf-8")


def plan(t: float) -> np.ndarray:
    """Wanted (x, y, psi, u, v_m, r) at time `t`: at 1.5 times the mean speed at first, at rest in the end."""
    s = min(max(t / DURATION, 0.0), 1.0)
    along, speed = LENGTH * (1.5 * s - 0.5 * s**3), LENGTH * (1.5 - 1.5 * s * s) / DURATION
    a = along / LENGTH  # the way aside follows the way ahead, so the heading is that of the curve
    y = ASIDE * a**3 * (10.0 - 15.0 * a + 6.0 * a * a)
    slope = ASIDE / LENGTH * 30.0 * a * a * (1.0 - a) ** 2
    bend = ASIDE / LENGTH**2 * 60.0 * a * (1.0 - a) * (1.0 - 2.0 * a)
    psi, turn = math.atan(slope), bend * speed / (1.0 + slope * slope)
    return np.array([along, y, psi, speed * math.hypot(1.0, slope), 0.0, turn])


def prediction(rates: Any) -> Any:
    """Function (z, w, e) -> z after one step; z: state and both directions, w: n_1, n_2 and both rates of turn."""
    z, w, e = ca.SX.sym("z", 8), ca.SX.sym("w", 4), ca.SX.sym("e", 8)

    def slope(at: Any) -> Any:
        return ca.vertcat(rates(at[:6], ca.vertcat(w[0], at[6], w[1], at[7]), e), w[2], w[3])

    k1 = slope(z)
    k2 = slope(z + 0.5 * STEP * k1)
    k3 = slope(z + 0.5 * STEP * k2)
    k4 = slope(z + STEP * k3)
    return ca.Function("predict", [z, w, e], [z + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)])


class Controller:
    """Multiple shooting over the horizon, solved by IPOPT from the last solution moved on by one step.

    Any iterate that keeps to the tug's equations within `HOLDS` gives orders; without one the last plan goes on.
    """

    def __init__(self, rates: Any, turn: Sequence[float], horizon: int = HORIZON) -> None:
        self.horizon, predict = horizon, prediction(rates)
        Z, W = ca.MX.sym("Z", 8, horizon + 1), ca.MX.sym("W", 4, horizon)
        wanted, start, e = ca.MX.sym("R", 6, horizon + 1), ca.MX.sym("z_0", 8), ca.MX.sym("e", 8)
        cost, links = 0.0, [Z[:, 0] - start]
        for k in range(horizon):
            error, turned = Z[:6, k + 1] - wanted[:, k + 1], W[2:, k]
            cost += ca.dot(ca.DM(WEIGHTS) * error, error) + 1e-3 * ca.dot(W[:2, k], W[:2, k]) + ca.dot(turned, turned)
            links.append(Z[:, k + 1] - predict(Z[:, k], W[:, k], e))
        posed = {"x": ca.veccat(Z, W), "f": cost, "g": ca.veccat(*links), "p": ca.veccat(start, wanted, e)}
        self.solver = ca.nlpsol("mpc", "ipopt", posed, {"expand": True, "print_time": False, "ipopt": SOLVER})
        high = np.array([MOST, MOST, *turn])
        free, low = np.full(8 * (horizon + 1), np.inf), np.array([LEAST, LEAST, *(-w for w in turn)])
        self.low = np.concatenate([-free, np.tile(low, horizon)])
        self.high = np.concatenate([free, np.tile(high, horizon)])
        self.last: np.ndarray | None = None
        self.missed = 0

    def orders(self, t: float, z: np.ndarray, e: np.ndarray) -> np.ndarray:
        """Orders n_1, alpha_1, n_2, alpha_2 for the next step.

        Args:
            t: now [s].
            z: state of the tug and the directions of its thrusters.
            e: the environment, as measured.
        """
        n = self.horizon
        wanted = np.array([plan(t + k * STEP) for k in range(n + 1)])
        if self.last is None:
            Z = np.hstack([wanted, np.tile(z[6:], (n + 1, 1))])
            self.last = np.concatenate([Z.ravel(), np.tile([2.0, 2.0, 0.0, 0.0], n)])
        found = self.solver(x0=self.last, lbx=self.low, ubx=self.high, lbg=0.0, ubg=0.0,
                            p=np.concatenate([z, wanted.ravel(), e]))  # fmt: skip
        held = np.abs(np.asarray(found["g"])).max() < HOLDS
        self.missed += not held
        best = np.asarray(found["x"]).ravel() if held else self.last
        Z, W = best[: 8 * (n + 1)].reshape(n + 1, 8), best[8 * (n + 1) :].reshape(n, 4)
        self.last = np.concatenate([Z[1:].ravel(), Z[-1], W[1:].ravel(), W[-1]])
        return np.array([W[0, 0], Z[1, 6], W[0, 1], Z[1, 7]])


@dataclass(frozen=True)
class Berthing:
    """How it went: times [s], states and orders by step, the slowest solution [s], and how often there was none."""

    t: np.ndarray
    states: np.ndarray
    orders: np.ndarray
    slowest: float
    missed: int

    @property
    def errors(self) -> np.ndarray:
        """Distance from the plan [m] by step."""
        wanted = np.array([plan(t) for t in self.t])
        return np.hypot(*(self.states - wanted)[:, :2].T)


def berth(folder: Path, begin: float = 0.0, end: float = DURATION + 20.0, horizon: int = HORIZON) -> Berthing:
    """Run the tug under the controller from 0.2 m beside the plan.

    Args:
        folder: holds the exported files.
        begin, end: which part of the plan [s].
        horizon: how many steps the controller looks ahead.
    """
    turn = json.loads((folder / "turn.json").read_text(encoding="utf-8"))
    controller = Controller(ca.Function.load(str(folder / "tug.casadi")), turn, horizon)
    tug = ca.Function.load(str(folder / "true_ordered_step.casadi"))
    e = np.array([0.0, 0.0, *CURRENT, 0.0, 0.0, 0.0, 0.0])
    x, a = plan(begin) + np.array([0.0, 0.2, 0.0, 0.0, 0.0, 0.0]), np.array([3.0, 0.3, 3.0, -0.3])
    t = begin + STEP * np.arange(round((end - begin) / STEP) + 1)
    states, orders, slowest = [x], [], 0.0
    for now in t[:-1]:
        begun = time.perf_counter()
        order = controller.orders(float(now), np.concatenate([x, a[1::2]]), e)
        slowest = max(slowest, time.perf_counter() - begun)
        for _ in range(SUBSTEPS):
            x, a = (np.asarray(v).ravel() for v in tug(x, a, order, e))
        states.append(x)
        orders.append(order)
    return Berthing(t, np.array(states), np.array(orders), slowest, controller.missed)


def main(model: str = "qiuxin5") -> None:
    """Berth and say how well."""
    with tempfile.TemporaryDirectory() as folder:
        export(Path(folder), model)
        run = berth(Path(folder))
    x, y, psi, u, v_m, _ = run.states[-1]
    sys.stdout.write(
        f"berth: {x - LENGTH:+.3f} m along, {y - ASIDE:+.3f} m aside, {math.degrees(psi):+.2f} deg, "
        f"{math.hypot(u, v_m):.3f} m/s over ground\n"
        f"way: at most {run.errors.max():.3f} m from the plan; slowest solution {1e3 * run.slowest:.0f} ms, "
        f"{run.missed} of {len(run.orders)} missed\n"
    )


if __name__ == "__main__":
    try:
        main(*sys.argv[1:2])
    except ValueError as error:  # of the ships as well: a model that there is not
        sys.exit(f"error: {error}")
