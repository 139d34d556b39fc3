"""Figures of You 2023 without numbers: inputs (7 and 8), held-out manoeuvres (16 to 20) and steps (23 and 24)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import seatrial as st

legend_below, panels, svg = st.figures.legend_below, st.figures.panels, st.figures.svg
STATES = st.models.STATES
figure = st.blocks.figure

_DEGREES = math.degrees(1.0)
# One sample in so many is drawn.
_DRAWN = 3
_STEPS = (1, 10, 25, 50)
_MEASURED: Mapping[str, Any] = {"color": "#c9d0d6", "lw": 3.2}
_STEP: Mapping[str, Any] = {"color": st.figures.BLUE, "lw": 1.2}
_RUN: Mapping[str, Any] = {"color": st.figures.VERMILION, "lw": 1.2, "ls": (0, (5, 1.5))}


def inputs(ship: st.Ship, trials: Sequence[st.Trial]) -> str:
    """Figs. 7 and 8: revolutions, azimuths as ordered and measured, and the forces that they make, of all trials."""
    drawn, axes = panels(5, 1, (11.0, 6.6))
    edges = np.cumsum([0.0, *(trial.duration + trial.dt for trial in trials)])
    for k, trial in enumerate(trials):
        t = edges[k] + (trial.t - trial.t[0])
        turned = _DEGREES * trial["alpha_1"]
        dotted: dict[str, Any] = {"color": st.figures.GREY, "lw": 1.0, "ls": (0, (1, 1.5))}
        axes[0, 0].plot(t, trial["n_1"], color=st.figures.INK, lw=1.2)
        axes[1, 0].step(t, _DEGREES * trial["alpha_1_cmd"], label="" if k else "as ordered", **dotted)
        axes[1, 0].plot(t, turned, color=st.figures.INK, lw=1.2, label="" if k else "measured")
        for ax, force in zip(axes[2:, 0], forces(ship, trial).T, strict=True):
            ax.plot(t, force, color=st.figures.INK, lw=1.0)
    axes[-1, 0].set_xlim((0.0, edges[-1]))
    for ax, name in zip(axes[:, 0], ("n_1 [1/s]", "alpha_1 [°]", "X [N]", "Y [N]", "N [N m]"), strict=True):
        ax.set_ylabel(name)
        for edge in edges[1:-1]:
            ax.axvline(edge, color=st.figures.RULE, lw=0.8)
    axes[-1, 0].set_xticks(0.5 * (edges[1:] + edges[:-1]), [t.name for t in trials])
    axes[-1, 0].x.size = 6.5
    legend_below(drawn, axes[1, 0])
    return svg(drawn, "inputs")


def forces(ship: st.Ship, trial: st.Trial) -> st.Array:
    """Surge and sway force and yaw moment of both thrusters by Eqs. 7, 8 and 20, shape (rows, 3)."""
    model: Any = ship.model
    out = np.zeros((len(trial), 3))
    for name, one in model.thrusters.items():
        pull = np.array([float(one.thrust(float(n))) for n in trial[f"n_{name}"]])
        along, across = pull * np.cos(trial[f"alpha_{name}"]), pull * np.sin(trial[f"alpha_{name}"])
        out += np.column_stack([along, across, float(one.x) * across - float(one.y) * along])
    return out


def held_out(ship: st.Ship, tests: Sequence[st.Trial], servo: st.servo.ServoFit) -> st.blocks.Body:
    """Figs. 16 to 20: tracks, headings and azimuths of held-out zigzags by revolutions, and of the turns."""
    steps = dict(zip((t.name for t in tests), st.rivals.one_step_states(ship, tests), strict=True))
    out: st.blocks.Body = ()
    for number, kind, n in ((16, "zigzag", 3), (17, "zigzag", 5), (18, "zigzag", 7), (19, "zigzag", 10),
                            (20, "turn", 3), (20, "turn", 10)):  # fmt: skip
        some = [t for t in tests if kind in t.name and t.name.endswith(f" {n}")]
        missing = " (its caption is missing in our text)" if number == 17 else ""
        caption = f"Fig. {number}{missing}: {kind}s at {n} revolutions a second"
        out += figure(tracks(ship, some, steps), caption) + figure(angles(ship, some, steps, servo), "")
    remark = (
        "Held-out manoeuvres as sailed, 22 parameters of B: single steps from the measured row before, as in section "
        "5.1 of the paper, and whole runs; azimuths by the fitted servo."
    )
    return out + st.blocks.soft(remark)


def tracks(ship: st.Ship, trials: Sequence[st.Trial], steps: Mapping[str, st.Array]) -> str:
    """Tracks of some trials beside each other, at equal scale."""
    drawn, axes = panels(1, len(trials), (3.6 * len(trials), 3.6))
    for ax, trial in zip(axes[0], trials, strict=True):
        run, step = st.replay(ship, trial), steps[trial.name][::_DRAWN]
        ax.plot(trial["y"][::_DRAWN], trial["x"][::_DRAWN], label="measured", **_MEASURED)
        ax.plot(step[:, STATES.index("y")], step[:, STATES.index("x")], label="single steps", **_STEP)
        ax.plot(run["y"][::_DRAWN], run["x"][::_DRAWN], label="whole run", **_RUN)
        ax.set(xlabel="east y [m]", title=trial.name.removeprefix("unseen "))
        ax.set_aspect("equal", adjustable="datalim")
    axes[0, 0].set_ylabel("north x [m]")
    legend_below(drawn, axes[0, 0])
    return svg(drawn, f"tracks {trials[0].name}")


def angles(ship: st.Ship, trials: Sequence[st.Trial], steps: Mapping[str, st.Array], servo: st.servo.ServoFit) -> str:
    """Heading, and azimuth measured and by its servo, of some trials beside each other, over time."""
    drawn, axes = panels(2, len(trials), (3.6 * len(trials), 3.4))
    for (heading, angle), trial in zip(axes.T, trials, strict=True):
        run, step = st.replay(ship, trial), steps[trial.name][::_DRAWN]
        heading.plot(trial.t[::_DRAWN], _DEGREES * st.unwrapped(trial["psi"])[::_DRAWN], label="measured", **_MEASURED)
        heading.plot(trial.t[::_DRAWN], _DEGREES * step[:, STATES.index("psi")], label="single steps", **_STEP)
        heading.plot(run.t[::_DRAWN], _DEGREES * st.unwrapped(run["psi"])[::_DRAWN], label="whole run", **_RUN)
        angle.plot(trial.t, _DEGREES * trial["alpha_1"], **_MEASURED)
        angle.plot(trial.t, _DEGREES * (st.servo.answered(servo, trial) + servo.offset), **_RUN)
        angle.set_xlabel("time t [s]")
    axes[0, 0].set_ylabel("ψ [°]")
    axes[1, 0].set_ylabel("alpha_1 [°]")
    legend_below(drawn, axes[0, 0])
    return svg(drawn, f"angles {trials[0].name}")


def by_steps(ship: st.Ship, tests: Sequence[st.Trial]) -> st.blocks.Body:
    """Figs. 23 and 24: velocities of two zigzags predicted over several numbers of steps."""
    drawn = []
    for number, name in ((23, "unseen zigzag -20-20 10"), (24, "unseen zigzag +30+30 10")):
        trial = next(t for t in tests if t.name == name)
        missing = "its caption is missing in our text; " if number == 23 else ""
        caption = f"Fig. {number} ({missing}{trial.name.removeprefix('unseen ')}): restarted after so many steps"
        drawn.append(figure(restarted(ship, trial), caption))
    return st.blocks.gallery(*drawn) + st.blocks.soft(
        "As sailed, 22 parameters of B; 50 steps are 10 s. The errors are those of Fig. 22."
    )


def restarted(ship: st.Ship, trial: st.Trial) -> str:
    """Velocities over time, measured and predicted over each number of steps."""
    drawn, axes = panels(3, 1, (6.4, 5.4))
    single = st.rivals.one_step_states(ship, [trial])[0]
    for ax, (name, (label, factor)) in zip(axes[:, 0], st.rivals_page.AXES.items(), strict=True):
        ax.plot(trial.t, factor * trial[name], label="measured", **_MEASURED)
        for (colour, dashes, _), steps in zip(st.figures.LINES, _STEPS, strict=False):
            values = (
                single[:, STATES.index(name)] if steps == 1 else st.replay(ship, trial, restart=steps * trial.dt)[name]
            )
            ax.plot(trial.t[: len(values)], factor * values, color=colour, ls=dashes, lw=1.1, label=f"{steps} steps")
        ax.set_ylabel(label)
    axes[-1, 0].set_xlabel("time t [s]")
    legend_below(drawn, axes[0, 0])
    return svg(drawn, f"restarted {trial.name}")
