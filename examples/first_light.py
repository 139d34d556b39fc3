"""The picture of the README: a noisy virtual trial, and what handbook and fitted ship predict of it.

Run from the root of the repository, with the extra `plots`: python examples/first_light.py docs/img/first_light.svg
"""

import math
import sys

import numpy as np
from matplotlib.figure import Figure

import seatrial as st

NOISE = st.demo.NOISE
Turning = st.manoeuvres.turning.Turning
Zigzag = st.manoeuvres.zigzag.Zigzag

DEGREE = math.pi / 180.0
handbook = st.load("kvlcc2_l7")
at_sea = handbook.having(
    {path: factor * st.parameters.read(handbook.model, path) for path, factor in st.demo.HIDDEN.items()}
)
n_P = st.approach(handbook)[1]
rng = np.random.default_rng(7)


def trial(policy, duration, name):
    return st.Sensors(noise=NOISE).read(st.run_policy(at_sea, policy, duration=duration, dt=0.1, name=name), rng)


training = (
    trial(Turning(n_P, 35 * DEGREE), 120.0, "turn"),
    trial(Zigzag(n_P, 20 * DEGREE, 20 * DEGREE), 120.0, "zigzag"),
    trial(Zigzag(n_P, 10 * DEGREE, 10 * DEGREE, -1.0), 120.0, "zigzag, port first"),
)
unseen = trial(Turning(n_P, -25 * DEGREE), 150.0, "unseen turn to port")

free = st.free_everywhere(handbook, tuple(st.demo.HIDDEN), 0.3)
problem = st.Problem(handbook, training, free, st.Loss(NOISE, correlation=0.0), st.Nuisance(initial=NOISE))
fit = st.Trajectory(window=120.0, every=5, method="rk4").fit(problem)

figure = Figure(figsize=(8.4, 4.4), layout="constrained")
axes = figure.subplots()
L = handbook.L_pp
for label, ship, style in (("handbook", handbook, "--"), ("fitted", fit.ship, "-")):
    predicted = st.replay(ship, unseen)
    axes.plot(predicted["y"] / L, predicted["x"] / L, style, lw=1.8, color="#D55E00" if style == "--" else "#0072B2",
              label=f"predicted, {label} coefficients", zorder=3 if style == "-" else 2)  # fmt: skip
east, north = unseen["y"][::12] / L, unseen["x"][::12] / L
axes.plot(east, north, ".", ms=5, color="0.25", label="measured (virtual, noisy)", zorder=4)
axes.set(xlabel="east y / L", ylabel="north x / L", title="An unseen 25 deg turn to port, 7 m KVLCC2", aspect="equal")
axes.grid(alpha=0.3)
figure.legend(loc="outside right center", frameon=False)
target = sys.argv[1] if len(sys.argv) > 1 else "first_light.svg"
figure.savefig(target, metadata={"Date": None} if target.endswith("svg") else None)
sys.stdout.write(f"{target}: fitted in {fit.seconds:.1f} s\n")
