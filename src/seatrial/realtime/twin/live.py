"""The twin itself: takes one row of a log after the other, and knows state, alarms and what it has learnt."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...data import Array
from ...identify.filters.filtering import inside
from ...identify.filters.horizon import Horizon
from ...ships import Ship
from .ahead import Trust
from .faults.acting import Acting, Override
from .faults.alarms import CLOCK, FROZEN, STEERING, UNEXPLAINED, WRONG, Alarm, Judge, alarm_of, strayed
from .faults.cases import History, Kept, acted, growing, judged, masks, opening, override_of, restless, together
from .faults.explained import Window, another
from .faults.stuck import FOLLOWS, JAMMED, Repeats, steerings
from .faults.suspects import (
    CARRIED,
    FORM,
    GROWS,
    IMPULSE,
    JUMP,
    LATE,
    LEVER,
    OF_CONTROL,
    PACE,
    SHARE,
    Bank,
    Evidence,
    pace,
    suspects,
    threshold,
)
from .follow import Follower, Machine, Step, begun, made, surprise, without
from .settings import MHE, Seaway, Settings, afloat_in
from .tally import Counts, Tally
from .waves import Roughness, Swell, settled

# A gap of so many times L/U begins the motion anew.
_GAP = 5.0
# Over a gap of so many times L/U the controls are not known: it is no evidence of a fault.
_BLIND = 0.3
# A sensor that is left out is believed again after it has agreed for so long [s].
_AGREES = 60.0
# A jump of the position that lasts is taken as true after so long [s].
_RETEST = 300.0
# So many alarms in an hour mean that the model is not that of the ship.
_MANY, _HOUR = 6, 3600.0
# Without a suspect, innovations beyond so many times their level over a minute are unexplained.
_UNEXPLAINED, _MINUTE = 4.0, 60.0
# Moving horizon estimation is repeated after so long [s].
_SOLVE = 1.0

MODEL = "model"


class Live:
    """A twin; feed it rows in the order of time.

    Attributes:
        machine: ship, settings and traced functions.
        follower: the estimate; None before the first row with heading and position.
        last: the last row's innovations; None at a gap.
        alarms: all of them, in the order of naming.
        tally: statistics of the innovations by hour.
        counts: rows that could not be taken in.
        trust: how forecasts have turned out.
        swell: what waves do to the readings, as it was found while the twin settled and has changed since.
    """

    def __init__(
        self, ship: Ship, settings: Settings, channels: tuple[str, ...] = (), held: tuple[str, ...] = ()
    ) -> None:  # fmt: skip
        """A twin before its first row.

        Args:
            ship: as it is known beforehand.
            settings: what is assumed.
            channels: of the log, where they are known; orders beside angles are then watched.
            held: controls that keep the value of a row until the next one; others act with the mean of both.
        """
        self.machine: Machine = made(ship, settings)
        self.follower: Follower | None = None
        self.last: Step | None = None
        self.alarms: list[Alarm] = []
        self.tally, self.counts, self.trust = Tally(), Counts(), Trust()
        self._settling: tuple[Roughness, list[Kept]] | None = None
        self.swell = Swell()
        self._bank = Bank(self.machine, suspects(self.machine))
        self._judge = Judge(threshold(len(self._bank.suspects), settings.spacing, settings.false_alarms))
        self._repeats, self._steering = Repeats(), steerings(ship, channels)
        self._controls = ship.model.controls
        self._acting = Acting(ship.model, held)
        self._masked: dict[int, Alarm] = {}
        self._agreed: dict[int, float] = {}
        self._overrides: dict[str, Override] = {}
        self._rows: deque[Kept] = deque()
        self._snapshots: deque[Follower] = deque()
        self._history = History()
        self._horizon: Horizon | None = None
        self._other: tuple[Machine, Machine | None] | None = None
        self._solved = -math.inf
        self._quiet, self._bad, self._misfit = -math.inf, deque[tuple[float, float, int]](), -math.inf

    def feed(self, t: float, values: Mapping[str, float]) -> bool:
        """Take in a row; whether it counted.

        Args:
            t: time [s].
            values: channels by name, SI units; NaN, or no entry, is no reading.
        """
        readings = np.array([values.get(name, math.nan) for name in self.machine.channels])
        before = self._acting.now.copy()
        self._acting.heed(values, None if self.follower is None else self.follower.mean)
        if not self._acting.known:
            self.counts.waiting += 1
            return False
        if self.follower is None:
            return self._begin(t, readings)
        span = t - self.follower.t
        if span <= 0.0:
            return self._earlier(t, readings, self.follower)
        if span > _GAP * self.machine.unit:
            self.counts.gaps += 1
            return self._anew(t, readings, self.follower)
        acting = self._acting.between(before)
        self._repeats.note(t, dict(zip(self.machine.channels, readings.tolist(), strict=True)))
        for one in self._steering:
            one.note(t, values)
        if span > _BLIND * self.machine.unit:
            self._forget(t, 0.0)
        follower, step = self._take(Kept(t, acting, readings), self.follower)
        self.trust.note(follower, step.acting, np.where(self._blind, math.nan, readings))
        if self._settling is not None:
            sea, rows = self._settling
            sea.note(step)
            rows.append(Kept(t, acting, readings))
            if t >= self._quiet:
                self._settling = None
                self._settle_in(sea.found(), rows)
        self._watch(t)
        return True

    @property
    def _blind(self) -> NDArray[np.bool_]:
        """Which channels are not believed."""
        out = np.zeros(len(self.machine.channels), dtype=np.bool_)
        out[list(self._masked)] = True
        return out

    @property
    def acting(self) -> Array:
        """Controls and environment as they are now, and as they are believed to act."""
        return self._acted(Kept(0.0, self._acting.now, self._acting.now), 0.0)

    def held(self) -> tuple[Array, Mapping[str, int], Mapping[str, Override]]:
        """What a saved state needs besides estimate, alarms and tallies: acting, masked, overrides."""
        masked = {self.machine.channels[k]: self.alarms.index(one) for k, one in self._masked.items()
                  if one in self.alarms}  # fmt: skip
        return self._acting.now, masked, self._overrides

    def hold(self, acting: Array, masked: Mapping[str, int], overrides: Mapping[str, Override]) -> None:
        """Set what `held` gave."""
        self._acting.now, self._overrides = acting, dict(overrides)
        self._masked = {self.machine.channels.index(name): self.alarms[k] for name, k in masked.items()}
        now = -math.inf if self.follower is None else self.follower.t
        self._agreed = dict.fromkeys(self._masked, now)
        self._quiet = now + min(15.0, self.machine.unit)

    def _begin(self, t: float, readings: Array) -> bool:
        """Begin at the first row that shows heading and, where it is read at all, position."""
        needed = [k for k, name in enumerate(self.machine.channels) if name in ("psi", "x", "y")]
        if not np.isfinite(readings[needed]).all():
            self.counts.waiting += 1
            return False
        self.follower = begun(self.machine, t, readings)
        self._quiet = t + self.machine.settings.settle
        self._settling = Roughness(self.machine), [Kept(t, self._acting.now.copy(), readings)]
        return True

    def _earlier(self, t: float, readings: Array, old: Follower) -> bool:
        """A row that is not later than the last one: late, or the clock was set back."""
        if old.t - t < self.machine.unit:
            self.counts.late += 1
            return False
        self.counts.restarts += 1
        self.alarms.append(Alarm(CLOCK, "", ("t",), t, t, over=t))
        return self._anew(t, readings, old)

    def _anew(self, t: float, readings: Array, old: Follower) -> bool:
        """Begin the motion anew; the further states are kept, and have walked meanwhile."""
        own = self.machine.traced.own
        if not np.isfinite(readings[[k for k, c in enumerate(self.machine.channels) if c in ("psi", "x", "y")]]).all():
            self.counts.waiting += 1
            return False
        walked = old.cov[own:, own:] + np.diag(self.machine.walked(t - old.t)[own:])
        self.follower, self.last = begun(self.machine, t, readings, (old.mean[own:], walked)), None
        self._history.clear()
        self._forget(t, 2.0 * self.machine.unit)
        return True

    def _forget(self, t: float, quiet: float) -> None:
        """Forget evidence, rows and forecasts on their way; no alarm for a while."""
        self.trust.clear()
        self._horizon = None
        self._bank.clear()
        self._judge.clear()
        self._rows.clear()
        self._snapshots.clear()
        self._bad.clear()
        self._quiet = max(self._quiet, t + quiet)

    def roughen(self, sea: Seaway) -> None:
        """Take waves as they are; the estimate, whose states may be others, has to be set again."""
        self.swell, self.machine = Swell(sea), made(self.machine.ship, afloat_in(self.machine.settings, sea))
        self._bank, self.tally.level, self._judge.wave = Bank(self.machine, suspects(self.machine)), 1.0, sea.period

    def _settle_in(self, sea: Seaway, rows: Sequence[Kept]) -> None:
        """Begin again from the first row in the sea that was found."""
        if not (sea.size or sea.noise):
            return
        self.roughen(sea)
        self.follower, self.tally = settled(self.machine, self.swell, rows, _GAP * self.machine.unit)
        self.machine = self.follower.machine
        self._history.clear()
        self._forget(self.follower.t, min(15.0, self.machine.unit))

    def _take(self, row: Kept, before: Follower) -> tuple[Follower, Step]:
        """Take in a row, and weigh its evidence."""
        acting = self._acted(row, row.t - before.t)
        before = growing(self.alarms[-_MANY:], before, row.t)
        self.follower, step = before.row(row.t, acting, row.readings, self._masked)
        if self.swell.sea.size:
            self.machine = self.swell.note(step, self._masked, self.machine)
            self.follower = replace(self.follower, machine=self.machine)
        self.last, after = step, self.follower
        settings = self.machine.settings
        if row.t - self._bank.latest >= settings.spacing or self._bank.surprised(step):
            self._bank.onset(before.t, acting, before.mean)
            self._snapshots.append(before)
        self._rows.append(row)
        self._history.note(row, before)
        while self._rows and self._rows[0].t < row.t - settings.window - 2.0 * settings.spacing:
            self._rows.popleft()
        while len(self._snapshots) > 1 and self._snapshots[1].t <= self._rows[0].t:
            self._snapshots.popleft()
        if settings.estimator == MHE:
            self._look_back(before, acting, row.readings, step)
        believed = without(step, self._masked)
        kept, nis = int(believed.taken.sum()), believed.nis
        if step.dt <= _BLIND * self.machine.unit:
            self._bank.weigh(believed, row.acting, self._overrides, self.tally.level)
        self.tally.note(row.t, nis, kept)
        self._bad.append((row.t, surprise(believed), believed.rows.size))
        while self._bad[0][0] < row.t - _MINUTE:
            self._bad.popleft()
        return self.follower or after, step

    def _look_back(self, before: Follower, acting: Array, readings: Array, step: Step) -> None:
        """Estimate the states of the last minute anew, once a second."""
        machine, settings = self.machine, self.machine.settings
        if self._horizon is None:
            self._horizon = Horizon.begun(machine.traced.model, machine.density, settings.step, settings.horizon,
                                          before.t, before.mean, before.cov)  # fmt: skip
            self._solved = before.t
        self._horizon.add(step.t, acting, readings, step.rows[step.taken])
        if step.t - self._solved >= _SOLVE - 1e-6 and self.follower is not None:
            self._solved = step.t
            mean, cov = self._horizon.solve()
            self.follower = replace(self.follower, mean=inside(mean, cov, machine.low, machine.high), cov=cov)

    def _acted(self, row: Kept, span: float) -> Array:
        """Controls as they are believed to act in the row, which lasts `span` seconds."""
        return acted(self._controls, row, self._overrides, span)

    def _watch(self, t: float) -> None:
        """Name faults, and see which are over."""
        self._released(t)
        if t < self._quiet:
            return
        for name in self.machine.channels:
            since = self._repeats.stuck(name)
            if since is not None and self.machine.channels.index(name) not in self._masked:
                self._raise(self._frozen(name, since, t))
                return
        self._judge_steering(t)
        if t < self._misfit + _HOUR:
            return
        window = Window(self._rows, self._snapshots, self._masked, self._overrides, self.tally.level, self._wider)
        if (best := self._judge.named(t, self._bank.evidence(), window.compared)) is not None:
            evidence, rivals = best
            if evidence.suspect.what[0] in self._overrides:
                self._healed(evidence, t)
                return
            frozen = all(self._repeats.repeated(name, evidence.onset + self.machine.settings.spacing)
                         for name in evidence.suspect.what)  # fmt: skip
            self._raise(alarm_of(evidence, t, rivals, frozen, pace(self.machine.ship, evidence.suspect)))
        elif math.isnan(self._judge.crossed):
            self.alarms += [one for one in strayed(self.follower) if not any(
                a.cause == one.cause and (one.how == LEVER or a.named > t - _HOUR) for a in self.alarms)]  # fmt: skip
            if self._unexplained():
                self._raise(Alarm(UNEXPLAINED, "", (MODEL,), self._bad[0][0], t))

    def _wider(self) -> Machine | None:
        if self._other is None or self._other[0] is not self.machine:
            self._other = self.machine, another(self.machine)
        return self._other[1]

    def _judge_steering(self, t: float) -> None:
        """Hold angles against their orders, where the log has both."""
        for one in self._steering:
            found = one.verdict()
            if found and found[0] == FOLLOWS:
                self._close(lambda a, of=one.control: a.what == (of,) and a.how == STEERING, t)
            elif found:
                self._steered(f"{one.control} {found[0]}", one.control, found, t)

    def _frozen(self, name: str, since: float, t: float) -> Alarm:
        sensor = next(label for label, one in self.machine.settings.sensors.items() if name in one.channels)
        return Alarm(f"{sensor} frozen", FROZEN, self.machine.settings.sensors[sensor].channels, since, t)

    def _steered(self, cause: str, control: str, found: tuple[str, float], t: float) -> None:
        """A rudder that does not follow: its true angle is in the log, so the filter is right as it is."""
        for k, one in enumerate(self.alarms):
            if one.what == (control,) and math.isinf(one.over):
                if one.how == STEERING and found[0] == JAMMED and t - one.named < _MINUTE:
                    self.alarms[k] = replace(one, cause=cause)
                return
        self.alarms.append(Alarm(cause, STEERING, (control,), found[1], t))

    def _unexplained(self) -> bool:
        count = sum(k for _, _, k in self._bad)
        full = bool(self._bad) and self._bad[-1][0] - self._bad[0][0] > 0.8 * _MINUTE
        return full and sum(q for _, q, _ in self._bad) > _UNEXPLAINED * self.tally.level * count

    def _raise(self, alarm: Alarm) -> None:
        """Name a fault, and take in the rows since its onset again as it explains them."""
        t = alarm.named
        lately = (k for k, one in enumerate(self.alarms) if one.over > t - _MINUTE and one.how != STEERING)
        again = next((k for k in lately if self.alarms[k].cause == alarm.cause), None)
        if again is not None:
            alarm = replace(alarm, since=self.alarms[again].since, named=self.alarms[again].named)
            self.alarms[again] = alarm
        else:
            self.alarms.append(alarm)
        recent = [one for one in self.alarms if one.named > t - _HOUR and one.how != STEERING and not one.of]
        recent = [alarm] if alarm.how == FORM else recent
        if alarm.how == FORM or len(recent) > _MANY or restless(recent, t):
            self._give_up(recent, t)
            return
        others = together(self.alarms, t, lambda one: one.cause == alarm.cause)
        found = judged(self._history, [*others, alarm]) if others else None
        if found is None or not found.consequences:
            self._explain(alarm, t)
        else:
            self._settle(alarm, found.causes, found.consequences, t)
            self.follower = found.follower
        self._forget(t, min(15.0, self.machine.unit))

    def _settle(self, alarm: Alarm, causes: Sequence[Alarm], consequences: Sequence[Alarm], t: float) -> None:
        """Tell consequences as such: what they did is undone."""
        lead = alarm if alarm in causes else causes[-1]
        for one in consequences:
            for k in [k for k, by in self._masked.items() if by.cause == one.cause]:
                del self._masked[k]
                self._agreed.pop(k, None)
            if one.how in OF_CONTROL:
                self._overrides.pop(one.what[0], None)
        told = [one.cause for one in consequences]
        for k, one in enumerate(self.alarms):
            if one in consequences:
                self.alarms[k] = replace(one, of=lead.cause, over=min(one.over, t))
            elif one is lead:
                self.alarms[k] = replace(one, explains=tuple(dict.fromkeys([*one.explains, *told])))
        if alarm in causes:
            self._believe(next(one for one in self.alarms if one.cause == alarm.cause and not one.of), t)

    def _give_up(self, recent: Sequence[Alarm], t: float) -> None:
        """So many faults are no sensor's: believe all again, begin the motion anew, and name nothing for an hour."""
        self._misfit = t
        self._close(lambda _: True, t)
        told = tuple(dict.fromkeys(one.cause for one in recent[:-1]))
        since = [one.since for one in recent]
        self.alarms = [replace(one, of=WRONG) if one.cause in told and one.since in since else one
                       for one in self.alarms[:-1]]  # fmt: skip
        self.alarms.append(Alarm(WRONG, "", (MODEL,), recent[0].since, t, over=t, explains=told))
        self._masked.clear()
        self._agreed.clear()
        self._overrides.clear()
        if self.follower is not None and not self._anew(t, self._rows[-1].readings, self.follower):
            self.follower = None
        self._forget(t, self.machine.settings.settle)

    def _explain(self, alarm: Alarm, t: float) -> None:
        self._believe(alarm, t)
        self._again(alarm.since, opening(self.machine, alarm))

    def _believe(self, alarm: Alarm, t: float) -> None:
        """Do without what an alarm says is wrong."""
        for k in masks(self.machine, alarm):
            self._masked[k] = alarm
            self._agreed[k] = t
        if alarm.how in OF_CONTROL:
            self._overrides[alarm.what[0]] = override_of(alarm)
        if alarm.how == PACE:  # all else would follow from it
            self._misfit = t
        if alarm.how in (IMPULSE, LEVER, GROWS, CARRIED, ""):
            self.alarms = [replace(one, over=t) if one is alarm else one for one in self.alarms]

    def _healed(self, evidence: Evidence, t: float) -> None:
        """A control acts again as the log says."""
        control = evidence.suspect.what[0]
        del self._overrides[control]
        self._close(lambda a: a.what == (control,) and a.how in OF_CONTROL, t)
        self._again(evidence.onset, ((), np.zeros(0)))
        self._forget(t, min(15.0, self.machine.unit))

    def _again(self, since: float, opened: tuple[tuple[str, ...], Array]) -> None:
        """Go back to just before an onset and take in the rows since then again."""
        past = [one for one in self._snapshots if one.t <= since + 1e-9] or list(self._snapshots)[:1]
        if not past or self.follower is None:
            return
        follower = past[-1]
        if opened[0]:
            follower = follower.opened(*opened)
        for row in [row for row in self._rows if row.t > follower.t + 1e-9]:
            acting = self._acted(row, row.t - follower.t)
            follower = growing(self.alarms[-_MANY:], follower, row.t)
            follower, _ = follower.row(row.t, acting, row.readings, self._masked)
        self.follower = follower

    def _released(self, t: float) -> None:
        """Believe sensors again that agree, and test controls again."""
        step = self.last
        if step is None or self.follower is None:
            return
        for k in list(self._masked):
            alarm = self._masked[k]
            at = np.flatnonzero(step.rows == k)
            if not at.size:
                continue
            far = step.innovation[at[0]] ** 2 > 9.0 * step.spread[at[0], at[0]]
            if far or self._repeats.stuck(self.machine.channels[k]) is not None:
                self._agreed[k] = t
            elif not self._shows(alarm, step, int(at[0])):
                self._agreed[k] += step.dt
            if alarm.what[0] in ("x", "y") and alarm.how == JUMP and t - alarm.named > _RETEST and far:
                self._reopen(alarm, t)
                return
            if t - self._agreed[k] > _AGREES and all(t - self._agreed.get(j, t) > _AGREES
                                                      for j in self._of(alarm)):  # fmt: skip
                self._end(alarm, t)
                return

    def _shows(self, alarm: Alarm, step: Step, row: int) -> bool:
        """Whether a reading that is late or off by a share would show it now."""
        if alarm.how not in (LATE, SHARE) or self.follower is None:
            return True
        slope = step.slope[row] @ (self.follower.mean - step.before) / step.dt
        off = alarm.size[0] * (float(slope) if alarm.how == LATE else float(step.expected[row]))
        return off**2 > 4.0 * step.spread[row, row]

    def _of(self, alarm: Alarm) -> list[int]:
        return [k for k, one in self._masked.items() if one.cause == alarm.cause]

    def _reopen(self, alarm: Alarm, t: float) -> None:
        """A jump that lasts is taken as true from here on: the state moves to what is read."""
        for k in self._of(alarm):
            name = self.machine.channels[k]
            at = np.zeros(0, dtype=np.intp) if self.last is None else np.flatnonzero(self.last.rows == k)
            if self.follower is not None and self.last is not None and name in self.machine.names and at.size:
                self.follower = self.follower.opened((name,), np.abs(self.last.innovation[at]))
        self._end(alarm, t)

    def _end(self, alarm: Alarm, t: float) -> None:
        for k in self._of(alarm):
            del self._masked[k]
            self._agreed.pop(k, None)
        self._close(lambda a: a.cause == alarm.cause, t)
        self._forget(t, min(15.0, self.machine.unit))

    def _close(self, which: Callable[[Alarm], bool], t: float) -> None:
        self.alarms = [one.ended(t) if math.isinf(one.over) and which(one) else one for one in self.alarms]

    @property
    def active(self) -> tuple[Alarm, ...]:
        """Alarms that last."""
        return tuple(one for one in self.alarms if math.isinf(one.over))

    @property
    def masked(self) -> tuple[str, ...]:
        """Channels that are not believed at present."""
        return tuple(self.machine.channels[k] for k in sorted(self._masked))
