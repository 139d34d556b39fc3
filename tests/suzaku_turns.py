"""SUZAKU's turning tests as Suyama 2023 tunes on them: four runs of 600 s, twelve parameters, Euler at 1 s."""

import math
from dataclasses import replace

import numpy as np

from seatrial.core.parameters import near
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.forces.wind import Fujiwara, fujiwara1998
from seatrial.identify import Loss, Problem
from seatrial.manoeuvres.turning import Turning
from seatrial.sensors import Sensors
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

PATHS = ("hull.R_0", "propeller.t_P", "propeller.w_P0", "propeller.C_w", "rudder.t_R", "rudder.a_H", "rudder.x_H",
         "rudder.epsilon", "rudder.kappa", "rudder.l_R", "rudder.gamma_Rp", "rudder.gamma_Rn")  # fmt: skip
GNSS = {"x": 1.0, "y": 1.0, "psi": math.radians(0.2)}
SHIP, TRUTH = load("suzaku"), load("suzaku_tuned_05")
SPEED, N_P = approach(SHIP)
PAPER = Loss({"x": SHIP.L_pp**-0.5, "y": SHIP.L_pp**-0.5, "psi": (0.25 * math.pi) ** -0.5}, correlation=0.0)


def manoeuvre(degrees: float) -> Turning:
    return Turning(n_P=N_P, delta=math.radians(degrees))


def turn(ship: Ship, degrees: float, duration: float = 600.0, environment=None) -> Trial:
    return simulate(
        ship, manoeuvre(degrees), speed=SPEED, duration=duration, dt=1.0, method="euler", name=f"turn {degrees:+g}",
        environment=environment,
    )  # fmt: skip


def problem(truth=TRUTH, *, noise=GNSS, seed=1, ratio=0.6, loss=PAPER, angles=(10, -20, 35, -40), paths=PATHS,
            environment=None, duration=600.0) -> Problem:  # fmt: skip
    """Tune SUZAKU to noisy turns of `truth`; a wind or current of `environment` is not told."""
    rng, sensors, trials = np.random.default_rng(seed), Sensors(noise), []
    for degrees in angles:
        run = sensors.read(turn(truth, degrees, duration, environment), rng)
        kept = {k: v for k, v in run.channels.items() if k not in ("U_T", "gamma_T", "U_C", "gamma_C")}
        trials.append(Trial(run.name, run.t, kept, run.units, run.meta))
    return Problem(SHIP, tuple(trials), near(SHIP.model, *paths, ratio=ratio), loss)


def unmodelled(seed: int, *, angles=(10, -20, 35, -40), noise=GNSS) -> Problem:
    """Turns in a steady wind of 3 m/s from 60 deg that is not logged, the rudder logged 2 s before it acts."""
    shape = fujiwara1998(A_T=150.0, A_L=520.0, A_OD=260.0, C=-2.0, C_BR=-28.0, H_BR=14.0, H_C=4.5, B=13.5, L=83.0)
    wind = Fujiwara(rho_air=1.225, A_T=150.0, A_L=520.0, L_wind=83.0, **shape)
    blown = replace(TRUTH, model=replace(TRUTH.model, wind=wind, still_air="resistance"))
    told = problem(blown, seed=seed, angles=angles, noise=noise,
                   environment=Uniform(U_T=3.0, gamma_T=math.radians(60.0)))  # fmt: skip
    early = tuple(t.having(delta=np.interp(t.t + 2.0, t.t, t["delta"])) for t in told.trials)
    return replace(told, trials=early)
