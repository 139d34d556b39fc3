"""Competing explanations of the same rows: the filter runs again with each suspect in it.

The bank of `suspects` carries signatures of the first order, so that of scores in the thousands the last per cent is
not to be relied on, and it is that by which a late fix differs from one that jumped, or a ramp from a share.  Here each
of the likeliest suspects is taken as true from its onset on: readings are corrected, states moved, controls overridden,
and the rows since the earliest onset of all are taken in again.  Sizes come from a few steps of Gauss and Newton.  A
score is twice the logarithm of the density of the readings with the size integrated out (Laplace), so that a suspect
which needs no luck (a late fix lies astern, a jump may lie anywhere) gains by that.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from functools import cached_property

import numpy as np

from ....core.parameters import values
from ....core.values import dataclass, field, replace
from ....data import Array
from ..follow import Follower, Machine, Step, made, without
from .acting import Override
from .alarms import WRONG, alarm_of
from .cases import Kept, acted, override_of
from .suspects import (
    CARRIED,
    FORM,
    GROWS,
    IMPULSE,
    JUMP,
    LATE,
    LAZY,
    LEVER,
    OF_CONTROL,
    PACE,
    RAMP,
    RESISTED,
    SHARE,
    STUCK,
    Evidence,
    Suspect,
    grown,
    pace,
)

# Signatures of the first order are right to a share of their score.
_ROUGH, _NEAR = 0.3, 30.0
# No more suspects than this are tried, and a reading counts as so many standard deviations at most.
_TRIED, _MOST = 8, 6.0
# Of each channel a reading in so long is taken [s]: ten a second tell little more, at ten times the cost.
_APART = 0.95
# A late reading is as late as this, at most, of the delay of its suspect.
_BEFORE = 2.0
# By what share of its usual size a size is varied; so many steps, until one gains less than so much.
_STEP, _STEPS, _SETTLED = 0.05, 4, 1.0
# By what share each force of the hull may be another, one standard deviation: in shallow water some are twice as large.
_OTHER = 0.4
# Where forces of the hull are among the parameters, and those of resistance.
_HULL, _RESISTANCE = ("hull", "damping"), ("R_0", "X_0", "X_0F", "X_u", "X_uu", "X_uuu")
# A control that is slow may be so by these factors more or less than its suspect.
_ABOUT = (0.5**0.5, 2.0**0.5)


def likeliest(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Those that may be best once the filter has run again: near the first of the bank, or of the same channels."""
    if not evidence:
        return []
    least = evidence[0].score - max(_NEAR, _ROUGH * evidence[0].score)
    what = evidence[0].suspect.what
    return [one for one in evidence if one.score > least or one.suspect.what == what][:_TRIED]


@dataclass(frozen=True)
class Window:
    """Rows in which a fault is sought.

    Attributes:
        rows: in the order of time; those of them are taken in that tell a channel of which `_APART` had none.
        starts: estimates from which a fault may have set in, by time.
        masked: channels that are not believed.
        overrides: controls that are at fault already.
        level: by how much innovations are larger than stated, squared.
        other: gives the ship with the forces of its hull as states; None where they are not known by name.
    """

    rows: Sequence[Kept]
    starts: Sequence[Follower]
    masked: Collection[int] = ()
    overrides: Mapping[str, Override] = field(default_factory=dict[str, Override])
    level: float = 1.0
    other: Callable[[], Machine | None] = lambda: None

    @cached_property
    def taken(self) -> list[Kept]:
        """The rows that are taken in again, with the controls in the middle of those since the one before."""
        out, last, since = list[Kept](), dict[int, float](), list[Array]()
        for row in self.rows:
            since.append(row.acting)
            told = np.flatnonzero(np.isfinite(row.readings)).tolist()
            if any(row.t - last.get(k, -math.inf) >= _APART for k in told):
                out.append(replace(row, acting=since[len(since) // 2]))
                last |= dict.fromkeys(told, row.t)
                since.clear()
        return out

    def compared(self, evidence: Sequence[Evidence]) -> list[Evidence]:
        """The same suspects with sizes and scores by the filter run again, the best first.

        Scores are against each other: that of the first is as the bank has it.
        """
        some = likeliest(evidence)
        if not some or not self.starts:
            return some
        # the readings of one instrument went wrong at one time, however it was
        what, onset = some[0].suspect.what, some[0].onset
        some += [replace(one, onset=onset) for one in some if one.suspect.what == what and one.onset != onset]
        some += [replace(one, suspect=replace(one.suspect, share=factor * one.suspect.share))
                 for one in some if one.suspect.how == LAZY for factor in _ABOUT]  # fmt: skip
        hull = _of_hull(self.other())
        some += [Evidence(one, -math.inf, onset, (), ()) for one in hull]
        # what a late reading shows is from before its onset
        begun = min(one.onset - (_BEFORE * one.suspect.share if one.suspect.how == LATE else 0.0) for one in some)
        start = next((one for one in reversed(self.starts) if one.t <= begun + 1e-9), self.starts[0])
        best: dict[Suspect, Evidence] = {}
        for one in (self._tried(start, one) for one in some):
            best[one.suspect] = max(one, best.get(one.suspect, one), key=lambda found: found.score)
        found = _one_resistance(best, evidence)
        shift = evidence[0].score - found[0].score
        return [replace(one, score=one.score + shift) for one in found]

    def _tried(self, start: Follower, one: Evidence) -> Evidence:
        """Size and score of one suspect."""
        free, size = _free(one), np.array(one.size)
        usual = np.array([one.suspect.size[k] for k in free])
        off, dense = self._off(start, one, size)
        if not free:
            return replace(one, score=-_squares(off) - dense)

        def cost(off: Array, dense: float, size: Array) -> float:
            return _squares(off) + dense + float(np.sum((size[free] / usual) ** 2))

        best, curved = cost(off, dense, size), np.eye(len(free))
        for _ in range(_STEPS):
            columns = [self._off(start, one, size + _nudge(size, k, _STEP * much))[0] - off
                       for k, much in zip(free, usual, strict=True)]  # fmt: skip
            J = np.stack(columns, axis=1) / (_STEP * usual)
            curved = J.T @ J + np.diag(usual**-2)
            moved = size.copy()
            moved[free] -= np.linalg.solve(curved, J.T @ off + size[free] / usual**2)
            tried = self._off(start, one, moved)
            before, better = best, cost(*tried, moved)
            if better < best:
                (off, dense), size, best = tried, moved, better
            if better > before - _SETTLED:
                break
        volume = float(np.linalg.slogdet(curved * usual[:, None] * usual)[1])
        sigma = np.array(one.sigma)
        sigma[free] = np.sqrt(np.diagonal(np.linalg.inv(curved)))
        score = -best - volume
        return replace(one, score=score, size=tuple(size.tolist()), sigma=tuple(sigma.tolist()))

    def _off(self, start: Follower, one: Evidence, size: Array) -> tuple[Array, float]:
        """Whitened innovations of all rows under a fault of this size, and the logarithm of their spreads."""
        if one.suspect.how == FORM and (other := self.other()) is not None:
            start = widened(start, other)
        run = _Run(start, replace(one, size=tuple(size.tolist())), dict(self.overrides))
        whitened, dense = dict[int, Array](), 0.0
        for number, row in run.events([row for row in self.taken if row.t > start.t + 1e-9]):
            step = without(run.row(row, self.masked), self.masked)
            if step.rows.size:
                root = np.linalg.cholesky(step.spread)
                off = np.linalg.solve(root, step.innovation) / math.sqrt(self.level)
                whitened[number] = np.asarray(off, dtype=np.float64)
                dense += 2.0 * float(np.log(np.diagonal(root)).sum())
        return np.concatenate([whitened[k] for k in sorted(whitened)]) if whitened else np.zeros(0), dense


def _of_hull(other: Machine | None) -> list[Suspect]:
    """Suspects of the forces of the hull: all of them, and those of resistance alone."""
    if other is None:
        return []
    forces = tuple(name for name in other.names if name.partition(".")[0] in _HULL)
    resist = tuple(name for name in forces if name.partition(".")[2] in _RESISTANCE)
    return [Suspect(WRONG, FORM, forces, (), "1"), *([Suspect(RESISTED, FORM, resist, (), "1")] if resist else [])]


def _one_resistance(best: dict[Suspect, Evidence], evidence: Sequence[Evidence]) -> list[Evidence]:
    """The best first; a resistance is a force, or a share of the ship's own, whichever explains better."""
    by_share = next((one for suspect, one in best.items() if (suspect.cause, suspect.how) == (RESISTED, FORM)), None)
    by_force = next((one for one in evidence if (one.suspect.cause, one.suspect.how) == (RESISTED, IMPULSE)), None)
    found = [one for one in best.values() if one is not by_share]
    if by_share is not None and by_force is not None:
        known = best.get(by_force.suspect, by_share)
        found = [one for one in found if one.suspect != by_force.suspect]
        found.append(replace(by_force, score=max(by_share.score, known.score), onset=by_share.onset))
    return sorted(found, key=lambda one: -one.score)


def another(machine: Machine) -> Machine | None:
    """The machine with the forces of the hull as further states; None where the model has none by name."""
    known = {path: abs(float(value)) for path, value in values(machine.ship.model).items()
             if path.partition(".")[0] in _HULL and isinstance(value, float) and value
             and path not in machine.names}  # fmt: skip
    settings = machine.settings
    more = {path: _OTHER * size for path, size in known.items()}
    return made(machine.ship, replace(settings, start={**settings.start, **more})) if known else None


def widened(follower: Follower, other: Machine) -> Follower:
    """The estimate with the forces of the hull beside it, as the ship file has them and certain so far."""
    known, n = values(other.ship.model), len(other.names)
    there = {name: k for k, name in enumerate(follower.machine.names)}
    mean = np.array([follower.mean[there[name]] if name in there else float(known[name]) for name in other.names])
    kept = [k for k, name in enumerate(other.names) if name in there]
    some, cov = [there[other.names[k]] for k in kept], np.zeros((n, n))
    cov[np.ix_(kept, kept)] = follower.cov[np.ix_(some, some)]
    return replace(follower, machine=other, mean=mean, cov=cov)


def _squares(off: Array) -> float:
    """Sum of the squares, an outlier clipped."""
    return float(np.sum(np.minimum(off**2, _MOST**2)))


def _nudge(size: Array, k: int, by: float) -> Array:
    """A change of one component."""
    out = np.zeros_like(size)
    out[k] = by
    return out


def _free(one: Evidence) -> list[int]:
    """Which components of a size are found here; states are opened by their prior instead."""
    how = one.suspect.how
    if one.suspect.fixed or how in (IMPULSE, LEVER):
        return [1] if how == STUCK else []
    return list(range(len(one.size)))


@dataclass
class _Run:
    """The filter with one fault in it."""

    follower: Follower
    fault: Evidence
    overrides: dict[str, Override]
    begun: bool = False

    def events(self, rows: Sequence[Kept]) -> list[tuple[int, Kept]]:
        """The rows by time with their numbers; late readings as rows of their own, at the time to which they belong."""
        one, out = self.fault, list(enumerate(rows))
        if one.suspect.how != LATE:
            return out
        times, lag = [row.t for row in rows], max(one.size[0], 0.0)
        late = [self.follower.machine.channels.index(name) for name in one.suspect.what]
        for k, row in out[bisect_right(times, one.onset + 1e-9) :]:
            then, readings = max(row.t - lag, self.follower.t + 1e-6), np.full_like(row.readings, np.nan)
            readings[late] = row.readings[late]
            out.append((len(rows) + k, Kept(then, rows[bisect_left(times, then)].acting, readings)))
            readings = row.readings.copy()
            readings[late] = np.nan
            out[k] = k, replace(row, readings=readings)
        return sorted(out, key=lambda event: event[1].t)

    def row(self, row: Kept, masked: Collection[int]) -> Step:
        """Take in a row as the fault explains it."""
        machine, how, onset = self.follower.machine, self.fault.suspect.how, self.fault.onset
        since, t, readings = row.t - onset, row.t, row.readings
        if since > 1e-9:
            if not self.begun:
                self._begin()
            if how == PACE:
                t = onset + (1.0 - self.fault.size[0]) * since
            elif how in (GROWS, CARRIED):
                self.follower = grown(self.follower, self.fault, row.t)
        acting = acted(machine.ship.model.controls, row, self.overrides, t - self.follower.t)
        if since > 1e-9 and how in (JUMP, RAMP, SHARE):
            readings = self._read(row, acting)
        self.follower, step = self.follower.row(t, acting, readings, masked)
        return step

    def _begin(self) -> None:
        """The fault sets in."""
        self.begun, one, ship = True, self.fault.suspect, self.follower.machine.ship
        self.overrides = {name: copy(value) for name, value in self.overrides.items()}
        if one.how in (IMPULSE, LEVER):
            self.follower = self.follower.opened(one.what, np.array(one.size))
        elif one.how == FORM:
            start = self.follower.machine.settings.start
            self.follower = self.follower.opened(one.what, np.array([start[name] for name in one.what]))
        elif one.how in OF_CONTROL and self.overrides.pop(one.what[0], None) is None:
            alarm = alarm_of(self.fault, self.fault.onset, (), False, pace(ship, one))
            self.overrides[one.what[0]] = override_of(alarm)

    def _read(self, row: Kept, acting: Array) -> Array:
        """The readings as they would be without the fault."""
        one, machine, out = self.fault, self.follower.machine, row.readings.copy()
        for k, name in enumerate(one.suspect.what):
            j = machine.channels.index(name)
            if one.suspect.how == JUMP:
                out[j] -= one.size[k]
            elif one.suspect.how == RAMP:
                out[j] -= one.size[k] * (row.t - one.onset)
            else:  # divided, its noise would be less
                ahead, _ = self.follower.ahead(row.t, acting)
                out[j] -= one.size[0] * float(machine.traced.model.read(ahead.mean, acting)[0][j])
        return out
