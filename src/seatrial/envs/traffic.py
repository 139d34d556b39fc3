"""A task among traffic: an own ship that meets others, judged in the end as a safety case judges it.

Each episode draws encounters, conducts of the others and, of a fit, the ship from its posterior (`encounters.sailing`);
what is seen and said is of `encounters.learning`, so a policy that was learned here is a stack of `seatrial case`
(`speaks = "gymnasium"`).  Ships of a vector are in encounters of their own, which begin and end together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import Env
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..belief.reading import posterior
from ..core.errors import TaskError
from ..data import Array
from ..encounters.learning import ACTIONS, SIZE, Sight
from ..encounters.meeting import Meeting, Ranges, drawn, role, shared, together
from ..encounters.rules import Limits, judge
from ..encounters.sailing import STEP, Sailing, Sea, paced, stepped
from ..encounters.sensing import Eyes, Sensing
from ..ships import Ship
from ..ships.files import load
from ..simulate.approach import approach

Observation = NDArray[np.float32]
_LONG = 2.2
"""An episode over the latest meeting: that of a safety case."""
KEPT, BROKEN, CONTACT, OFF = 1.0, -1.0, -10.0, -0.5
"""Rewards: at the end for keeping every rule, for each rule that is broken and for contact; on the way for a whole
episode at the greatest alteration of course."""


class EncounterVectorEnv(VectorEnv[Observation, Observation, Any]):
    """Own ships side by side, each among ships of its own; where an episode is over, the next action begins another."""

    def __init__(
        self, ship: str | Ship = "kvlcc2", num_envs: int = 1, *, roles: Sequence[str] = ("give-way",),
        traffic: Sequence[str] = ("rules", "ignores"), fit: str | Path | None = None, sensing: Sensing | None = None,
        period: float | None = None, length: float | None = None, own: int = 1,
    ) -> None:  # fmt: skip
        """Prepare encounters.

        Args:
            ship: a ship, the name of one, or a fit's model.toml.
            num_envs: number of own ships, those of one encounter side by side.
            roles: of the own ship towards each other one, such as "give-way"; of several own ships that of the first
                towards the others, own ones before all, which have its speed.
            traffic: conducts of the others, drawn for each.
            fit: a run whose posterior the own ship is drawn from, anew in each episode.
            sensing: radar and AIS between it and the others; None: it sees everybody as they are.
            period: time between two actions [s], a whole number of rows of the tracks, which are 10 s apart, of a ship
                of less than 300 m less, by the root of its length, as when it meets others; two of them unless given.
            length: of the other ships [m]; that of the own one unless given.
            own: own ships in one encounter.

        Raises:
            TaskError: a period that is none, or own ships that do not fit.
            RequestError: a role or a conduct that is none.
        """
        super().__init__()
        self._ship = load(ship) if isinstance(ship, str) else ship
        row = stepped(paced(self._ship.L_pp))
        period = 2.0 * row if period is None else period
        if not (period >= row and abs(period / row - round(period / row)) < 1e-9):
            raise TaskError(f"period is {period:g} s; it is a whole number of {row:g} s")
        if own < 1 or num_envs % own:
            raise TaskError(f"{num_envs} own ships, {own} in an encounter: num_envs is a multiple of own, from 1 on")
        if own - 1 > len(roles):
            raise TaskError(f"{own} own ships meet in {own - 1} roles at least, of the first to each; "
                            f"{len(roles)} are given")  # fmt: skip
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}
        self.num_envs, self.render_mode = num_envs, None
        self.single_observation_space: Any = Box(-1.0, 1.0, (SIZE,), np.float32)
        self.single_action_space: Any = Box(-1.0, 1.0, (len(ACTIONS),), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._posterior = None if fit is None else posterior(fit)
        self._roles, self._traffic, self._sensing = [role(one) for one in roles], tuple(traffic), sensing
        limits, longest = Limits(), max(self._ship.L_pp, length or 0.0)
        soon, late = (paced(self._ship.L_pp, T) for T in Ranges().T)
        self._ranges = Ranges((soon, late), apart=float(limits.passing.of(np.array(longest))))
        self._actions = math.ceil(_LONG * self._ranges.T[1] / period)
        self._sea = Sea(self._actions * period, row, length, limits, own=own)
        self._each, self._rng, self._done = round(period / STEP), np.random.default_rng(), -1

    @property
    def meeting(self) -> Meeting:
        """Who is met in this episode."""
        return self._meeting

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode on every ship: with a seed the first one of that seed, else the next one."""
        if seed is not None or self._done < 0:
            self._rng = np.random.default_rng(seed if isinstance(seed, int) or seed is None else
                                              [0 if one is None else one for one in seed])  # fmt: skip
        return self._begun(), {}

    def _begun(self) -> Observation:
        first, runs = int(self._rng.integers(2**31)), self.num_envs
        self._meeting, start = shared(self._drawn(first, runs // self._sea.own), self._sea.own)
        held = self._posterior
        draws = None if held is None else dict(zip(held.names, held.draws(runs, first).T, strict=True))
        self._sailing = Sailing(self._ship, self._meeting, replace(self._sea, start=start), self._traffic, first, draws)
        scene = self._sailing.scene
        self._eyes = None if self._sensing is None else Eyes(self._sensing, scene, np.random.default_rng((first, 3)))
        self._kept, self._done = [self._sailing.fleet.motion], 0
        self._sight = Sight(scene if self._eyes is None else self._eyes.look(scene), self._sea.limits)
        return self._seen()

    def _drawn(self, seed: int, count: int) -> Meeting:
        """As many encounters in which nobody begins near an own ship."""
        own, U, asked = self._sea.own, approach(self._ship)[0], count
        alike = replace(self._ranges, k=dict.fromkeys(self._ranges.k, (1.0, 1.0)))
        while True:
            some = [drawn(roles, asked, U, first, ranges) for roles, first, ranges in (
                (self._roles[: own - 1], seed + 2**31, alike), (self._roles[own - 1 :], seed, self._ranges)) if roles]
            met = together(some)
            x, y = (np.column_stack([np.zeros(asked), one]) for one in (met.x, met.y))
            far = np.hypot(x[:, :own, None] - x[:, None], y[:, :own, None] - y[:, None])
            far[:, np.arange(own), np.arange(own)] = np.inf
            apart = np.flatnonzero((far >= self._ranges.apart).all(axis=(1, 2)))[:count]
            if len(apart) == count:
                return Meeting(U, *(getattr(met, name)[apart] for name in ("x", "y", "psi", "U_target")))
            asked *= 2

    def _seen(self) -> Observation:
        scene = self._sailing.scene
        return self._sight.observed(scene if self._eyes is None else self._eyes.look(scene))

    def step(
        self, actions: Observation
    ) -> tuple[Observation, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One action on every ship, held for a period; ValueError: not such actions.

        The last step of an episode is truncated, and its reward has the verdicts.
        """
        given = np.asarray(actions, dtype=np.float64)
        if given.shape != (self.num_envs, len(ACTIONS)) or not np.isfinite(given).all():
            raise ValueError(f"actions of shape {given.shape}; {(self.num_envs, len(ACTIONS))} finite ones are taken")
        none = np.zeros(self.num_envs, dtype=bool)
        if self._done < 0:
            raise TaskError("no episode has begun; call reset first")
        if self._done == self._actions:
            return self._begun(), np.zeros(self.num_envs), none, none, {}
        orders = self._sight.ordered(given)
        for k in range(1, self._each + 1):
            self._sailing.advance(orders)
            if k % round(self._sea.every / STEP) == 0:
                self._kept.append(self._sailing.fleet.motion)
        self._done += 1
        reward, info = OFF * np.abs(np.clip(given[:, 0], -1.0, 1.0)) / self._actions, dict[str, Any]()
        if self._done == self._actions:
            verdict, info = self._judged()
            reward = reward + verdict
        return self._seen(), reward, none, none | (self._done == self._actions), info

    def _judged(self) -> tuple[Array, dict[str, Any]]:
        """Rewards of the verdicts; which rules were broken, in `broken`; a run whose model failed has none of both."""
        t: Array = self._sea.every * np.arange(len(self._kept), dtype=np.float64)
        sailed = self._sailing.ended(t, np.stack(self._kept, axis=-1))
        reward, broken = np.zeros(self.num_envs), np.full(self.num_envs, None, dtype=object)
        if len(sailed.runs):
            own = judge(sailed.tracks, self._sea.limits, own=True)
            for k, run in enumerate(sailed.runs.tolist()):
                rules = {rule for one in own for rule in one.broken((k,))}
                touched = any(bool(one.contact[k]) for one in own)
                broken[run] = tuple(sorted(rules | ({"contact"} if touched else set())))
                reward[run] = (KEPT if not broken[run] else BROKEN * len(rules)) + CONTACT * touched
        return reward, {"broken": broken}


class EncounterEnv(Env[Observation, Observation]):
    """The same of one own ship."""

    metadata = {"render_modes": []}  # noqa: RUF012 -- as in Gymnasium

    def __init__(self, ship: str | Ship = "kvlcc2", render_mode: str | None = None, **given: Any) -> None:
        """Arguments as of `EncounterVectorEnv`."""
        self._all, self.render_mode = EncounterVectorEnv(ship, 1, **given), render_mode
        self.observation_space = self._all.single_observation_space
        self.action_space = self._all.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        return self._all.reset(seed=seed)[0][0], {}

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One action, held for a period."""
        seen, reward, _, over, info = self._all.step(np.asarray(action)[None])
        return seen[0], float(reward[0]), False, bool(over[0]), {name: one[0] for name, one in info.items()}
