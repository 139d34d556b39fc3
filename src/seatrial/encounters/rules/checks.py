"""The rules of the road as checks on recorded tracks, each a small function with its definition.

A `Check` has a margin: zero or above where the rule is kept, as a share of what is allowed or asked, so that it also
says how far a run is from a breach.  COLREG 1972 as amended; figures are in `limits`, each with its source.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from .action import Action
from .geometry import Array, Bools, Closest, Pair, taken
from .limits import Limits
from .roles import MUST_ACT, Encounter, Role


@dataclass(frozen=True, eq=False)
class View:
    """One encounter as one ship has it, with what the checks need of it.

    Attributes:
        at: the closest approach of the tracks until past and clear.
        own, other: what each ship does until then.
        excused: rows where the own ship has to act for another one (Rule 17 knows two ships only), shape (..., rows).
    """

    pair: Pair
    limits: Limits
    met: Encounter
    at: Closest
    own: Action
    other: Action
    excused: Bools

    @property
    def begins(self) -> Array:
        """Time at which risk began [s]."""
        return self.pair.t[self.met.begins]

    @property
    def acts(self) -> Array:
        """Time at which the own ship acts [s]; that of the closest approach where it does not."""
        return np.where(self.own.exists, self.pair.t[self.own.row], self.at.t)

    @property
    def deadline(self) -> Array:
        """Time until which action is early [s]."""
        return self.begins + self.limits.early.value * self.met.tcpa

    @property
    def due(self) -> Bools:
        """Whether action was due: risk that lasted to the deadline, or action before it.

        Where the other ship has made an end of the risk by then, or the record ends before, nothing is due.
        """
        row = np.searchsorted(self.pair.t, self.deadline)
        last = len(self.pair.t) - 1
        dcpa, tcpa = (taken(one, np.minimum(row, last)) for one in self.pair.approach)
        lasting = (dcpa < self.limits.passing.of(self.pair.lengths[..., 0])) & (tcpa > 0.0) & (row <= last)
        return self.met.exists & (lasting | (self.own.exists & (self.acts <= self.deadline)))

    def first(self, rows: Bools) -> tuple[Bools, NDArray[np.intp]]:
        """Whether and where the encounter has a row of these."""
        found = rows & self.met.during(len(self.pair.t))
        return np.asarray(found.any(axis=-1)), found.argmax(axis=-1)


@dataclass(frozen=True, eq=False)
class Check:
    """One rule of one encounter for one ship, in all runs.

    Attributes:
        rule: its number.
        roles: the parts that it is for.
        applies: whether it can be judged in a run, given one of these parts.
        margin: zero or above where it is kept; shape (...).
    """

    rule: str
    roles: tuple[Role, ...]
    applies: Bools
    margin: Array


def early(view: View) -> Check:
    """Rule 8(a): action in ample time: before a share `early` of the time to the closest approach has gone by."""
    spent = (view.acts - view.begins) / (view.limits.early.value * np.where(view.met.exists, view.met.tcpa, 1.0))
    return Check("8(a)", MUST_ACT, view.due, 1.0 - spent)


def apparent(view: View) -> Check:
    """Rule 8(b): large enough to be seen: `apparent` in one move (`window`, `at_once`), or speed less by `halving`."""
    size = np.maximum(view.own.shown / view.limits.apparent.value, view.own.slowed / view.limits.halving.value)
    return Check("8(b)", MUST_ACT, view.due, size - 1.0)


def distance(view: View) -> Check:
    """Rule 8(d): passing at a safe distance, until past and clear and without coming back."""
    return Check("8(d)", (Role.HEAD_ON, Role.GIVE_WAY, Role.UNSEEN, Role.YIELDS), view.met.exists,
                 _least(view) / view.limits.passing.of(view.pair.lengths[..., 0]) - 1.0)  # fmt: skip


def overtaking(view: View) -> Check:
    """Rule 13(a): an overtaking ship keeps out of the way: `overtaking` away, and not close ahead of the other."""
    L = view.pair.lengths[..., 0]
    aside = np.abs(view.at.angle(view.pair.alpha)) / view.limits.stem.value - 1.0
    close = view.at.distance < view.limits.bow.of(L)
    margin = np.minimum(_least(view) / view.limits.overtaking.of(L) - 1.0, np.where(close, aside, np.inf))
    return Check("13", (Role.OVERTAKING,), view.met.exists, margin)


def head_on(view: View) -> Check:
    """Rule 14(a): each alters its course to starboard, detectably, and none to port."""
    size = view.limits.detectable.value
    margin = np.minimum(view.own.starboard / size - 1.0, 1.0 - view.own.port / size)
    return Check("14", (Role.HEAD_ON,), view.due | (view.met.exists & (view.own.port > size)), margin)


def crossing_ahead(view: View) -> Check:
    """Rule 15: the ship that gives way does not cross ahead of the other within `bow`.

    It crosses ahead where it passes from the port bow of the other to its starboard bow.
    """
    alpha, far = view.pair.alpha, view.pair.range / view.limits.bow.of(view.pair.lengths)
    over = (alpha[..., :-1] < 0.0) & (alpha[..., 1:] >= 0.0) & (alpha[..., 1:] - alpha[..., :-1] < np.pi)
    here = over & view.met.during(len(view.pair.t))[..., 1:]
    crossed = here.any(axis=-1)
    margin = np.where(here, far[..., 1:], np.inf).min(axis=-1) - 1.0
    return Check("15", (Role.GIVE_WAY,), view.met.exists, np.where(crossed, margin, 1.0))


def giving_way(view: View) -> Check:
    """Rule 16: early and substantial action to keep well clear."""
    return Check("16", (Role.GIVE_WAY, Role.OVERTAKING, Role.YIELDS), view.due,
                 np.minimum(early(view).margin, apparent(view).margin))  # fmt: skip


def standing_on(view: View) -> Check:
    """Rule 17(a)(i): course and speed are kept until less than `alone` is left and the risk still stands.

    Action for a third ship, towards which this one has to act, is no breach.
    """
    dcpa, tcpa = view.pair.approach
    stands = (dcpa < view.limits.passing.of(view.pair.lengths)) & (tcpa > 0.0)
    free, row = view.first(stands & (tcpa < view.limits.alone.of(view.pair.lengths)))
    rows = np.arange(len(view.pair.t))
    until = np.where(free, row, view.at.row + 1)
    held = view.met.during(len(rows)) & (rows < until[..., None]) & ~view.excused
    course = np.where(held, np.abs(view.own.course), 0.0).max(axis=-1) / view.limits.steady.value
    speed = np.where(held, np.abs(view.own.speed), 0.0).max(axis=-1) / view.limits.keeping.value
    margin = 1.0 - np.maximum(course, speed)
    return Check("17(a)(i)", (Role.STAND_ON, Role.OVERTAKEN), np.asarray(held.any(axis=-1)), margin)


def stand_on_to_port(view: View) -> Check:
    """Rule 17(c): in a crossing of ships of one rank, no alteration to port for a ship on the own port side."""
    held = view.met.during(len(view.pair.t)) & ~view.excused & (np.arange(len(view.pair.t)) <= view.at.row[..., None])
    port = np.where(held, -view.own.course, 0.0).max(axis=-1)
    held = held & view.met.alike
    return Check("17(c)", (Role.STAND_ON,), np.asarray(held.any(axis=-1)), 1.0 - port / view.limits.detectable.value)


def last_moment(view: View) -> Check:
    """Rule 17(b): action where the other ship alone can no longer avoid a collision.

    That is where the ships would pass within half the sum of their lengths and the time left falls below `extremis`
    lengths at the own speed; what the ship does must be under way by then.
    """
    dcpa, tcpa = view.pair.approach
    U = np.maximum(np.hypot(view.pair.own.u, view.pair.own.v_m), 0.1)
    left = view.limits.extremis.value * view.pair.own.L / U
    hits = dcpa < 0.5 * (view.pair.own.L + view.pair.other.L)
    found, row = view.first(hits & (tcpa > 0.0) & (tcpa < left))
    margin = (view.pair.t[row] - view.acts) / taken(left, row)
    return Check("17(b)", (Role.STAND_ON, Role.OVERTAKEN), found, margin)


def keeping_out(view: View) -> Check:
    """Rule 18: action that can be detected, of either kind, for a ship that goes before it by its kind."""
    turned = np.maximum(view.own.starboard, view.own.port) / view.limits.detectable.value
    size = np.maximum(turned, view.own.slowed / view.limits.slowing.value)
    return Check("18", (Role.YIELDS,), view.due, size - 1.0)


def unseen(view: View) -> Check:
    """Rule 19(d): in restricted visibility no turn to port for a ship ahead, nor towards one abeam or abaft the beam.

    A ship forward of the beam that is being overtaken may be passed on either side.
    """
    beta, alpha = (taken(one, view.met.begins) for one in (view.pair.beta, view.pair.alpha))
    forward, overtaken = np.abs(beta) < 0.5 * np.pi, np.abs(alpha) > np.radians(112.5)
    towards = np.where(beta > 0.0, view.own.starboard, view.own.port)
    wrong = np.where(forward, view.own.port, towards)
    return Check("19(d)", (Role.UNSEEN,), view.met.exists & ~(forward & overtaken),
                 1.0 - wrong / view.limits.detectable.value)  # fmt: skip


def close_quarters(view: View) -> Check:
    """Rule 19(e): speed less by `halving` before a close approach to a ship forward of the beam that cannot be avoided.

    It cannot where the ships would still pass nearer than `passing` when `alone` is left.
    """
    dcpa, tcpa = view.pair.approach
    near = (dcpa < view.limits.passing.of(view.pair.lengths)) & (tcpa > 0.0)
    ahead = np.abs(view.pair.beta) < 0.5 * np.pi
    found, _ = view.first(near & ahead & (tcpa < view.limits.alone.of(view.pair.lengths)))
    return Check("19(e)", (Role.UNSEEN,), found, view.own.slowed / view.limits.halving.value - 1.0)


def _least(view: View) -> Array:
    """Least distance from the beginning on [m], with the one ahead where the record ends before they are clear."""
    rows = np.arange(len(view.pair.t))
    so_far = np.where(rows > view.met.ends[..., None], view.pair.range, np.inf).min(axis=-1)
    dcpa, tcpa = (one[..., -1] for one in view.pair.approach)
    heads = np.where(~view.met.over & (tcpa > 0.0), dcpa, np.inf)
    return np.minimum(np.minimum(view.at.distance, so_far), heads)


CHECKS: tuple[Callable[[View], Check], ...] = (
    early, apparent, distance, overtaking, head_on, crossing_ahead, giving_way, standing_on, stand_on_to_port,
    last_moment, keeping_out, unseen, close_quarters,
)  # fmt: skip
"""The checks of a pair of ships, in the order of the rules."""
