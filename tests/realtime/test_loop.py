"""The loop: a schedule without drift, orders from outside, everything that went wrong on record."""

from __future__ import annotations

import math
import threading
import time

import pytest

from seatrial.environment import Uniform
from seatrial.realtime.loop import CommandError, Loop, LoopError, Schedule
from seatrial.realtime.plant import Compiled
from seatrial.sensors import SensorError
from seatrial.sensors.instruments import Feedback, Gnss, Gyro
from seatrial.sensors.stream import Errors
from seatrial.sensors.suite import Suite
from seatrial.ships import ShipError
from seatrial.ships.files import load

DT = 0.1
SUITE = Suite((Gnss(rate=1.0, latency=0.2, position=Errors(noise=1.0, walk=0.1)), Gyro(rate=5.0)))


class FakeClock:
    """Time that goes on by sleeping, too long by a little, and by work."""

    def __init__(self, oversleep: float = 2e-4) -> None:
        self.time, self.oversleep = 100.0, oversleep

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds + self.oversleep


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(load("kvlcc2_l7"), DT)


def looped(compiled: Compiled, ships: int = 1, rate: float = 10.0, **given) -> tuple[Loop, FakeClock]:
    clock = FakeClock()
    return Loop([compiled.plant() for _ in range(ships)], rate, clock=clock, **given), clock


@pytest.mark.parametrize("factor", [0.1, 1.0, 20.0, 100.0])
def test_the_schedule_does_not_drift_though_each_sleep_is_too_long(compiled, factor):
    loop, clock = looped(compiled, factor=factor)
    start = clock.time
    report = loop.run(30.0)
    assert report.ticks == 300
    assert report.t == 30.0
    # the last tick is due one period before the end
    assert clock.time - start == pytest.approx(29.9 / factor, abs=1.5 * clock.oversleep)
    assert report.overruns == 0
    assert report.late < 1.0 / (10.0 * factor)


def test_as_fast_as_possible_waits_for_nothing(compiled):
    loop, clock = looped(compiled, factor=math.inf)
    clock.oversleep = 0.0
    assert loop.run(60.0).ticks == 600
    assert clock.time == 100.0


def test_work_that_takes_too_long_is_counted_and_caught_up_with(compiled):
    loop, clock = looped(compiled)

    def works(loop: Loop) -> None:
        if loop.k in (50, 51):
            clock.time += 0.35

    loop.after(works)
    start = clock.time
    report = loop.run(20.0)
    assert report.ticks == 200
    assert 5 <= report.overruns <= 8
    assert report.worst_late == pytest.approx(0.5, abs=0.11)
    assert report.slipped == 0.0
    assert report.late < 0.1
    assert clock.time - start == pytest.approx(19.9, abs=0.01)


def test_a_machine_that_stood_still_is_not_chased_after_but_told(compiled):
    loop, clock = looped(compiled)
    loop.after(lambda loop: setattr(clock, "time", clock.time + 3600.0 * (loop.k == 20)))
    report = loop.run(10.0)
    assert report.ticks == 100
    assert report.slipped == pytest.approx(3599.9, abs=0.2)
    assert report.events["slipped"] == 1
    assert report.overruns == 1


def test_pause_step_resume_and_another_pace(compiled):
    loop, clock = looped(compiled)
    loop.run(1.0)
    loop.pause()
    loop.step()
    loop.step()
    assert loop.k == 12
    waiting = threading.Thread(target=loop.run, args=(1.0,))
    waiting.start()
    while clock.time < 150.0:
        pass
    assert loop.k == 12
    loop.resume()
    waiting.join(10.0)
    assert loop.k == 22
    assert loop.report.overruns == 0
    loop.pace(50.0)
    start = clock.time
    loop.run(100.0)
    assert clock.time - start == pytest.approx(2.0, abs=0.01)


def behind(compiled: Compiled) -> tuple[Loop, FakeClock]:
    """A loop whose first 50 ticks take 0.3 s each instead of a tenth: ten seconds late then."""
    loop, clock = looped(compiled)
    clock.oversleep = 0.0
    loop.after(lambda loop: setattr(clock, "time", clock.time + 0.3 * (loop.k <= 50)))
    return loop, clock


@pytest.mark.parametrize("what", [Loop.resume, lambda loop: (loop.pause(), loop.resume()), lambda loop: loop.pace(1.0)])
def test_nothing_said_to_the_schedule_forgives_what_is_late(compiled, what):
    loop, clock = behind(compiled)
    loop.after(lambda loop: what(loop) if loop.k in (30, 50) else None)
    start = clock.time
    report = loop.run(20.0)
    assert clock.time - start == pytest.approx(19.9, abs=0.06)  # all caught up with
    assert report.slipped == 0.0
    assert report.worst_late == pytest.approx(9.7, abs=0.31)


def test_a_backlog_that_is_given_up_by_a_reset_is_told(compiled):
    loop, _ = behind(compiled)
    loop.after(lambda loop: loop.reset() if loop.report.ticks == 40 else None)
    report = loop.run(5.0)
    assert report.slipped == pytest.approx(40 * 0.2, abs=0.3)
    assert report.events["slipped"] == 1


@pytest.mark.parametrize("what", [lambda s: s.pace(1.0), lambda s: (s.hold(), s.release()), lambda s: s.give_up()])
def test_nothing_said_to_the_schedule_adds_ticks(what):
    clock = FakeClock()
    schedule, ticks = Schedule(20.0, 1.0, clock), 0
    for k in range(1000):
        clock.time = 100.0 + 0.001 * k
        if k % 10 == 0:
            what(schedule)
        if schedule.left() <= 0.0:
            schedule.begin()
            ticks += 1
    assert ticks == 20


def test_another_pace_keeps_the_place_between_two_ticks_and_what_is_owed():
    clock = FakeClock()
    schedule = Schedule(10.0, 1.0, clock)
    schedule.begin()
    clock.time += 0.025
    schedule.pace(0.5)
    assert schedule.left() == pytest.approx(0.15)  # three quarters of a period that is twice as long
    clock.time += 2.15
    schedule.pace(10.0)
    assert schedule.left() == pytest.approx(-0.1)  # ten ticks, as before
    schedule.pace(math.inf)
    assert schedule.left() == 0.0


def test_runs_in_a_row_keep_the_pace(compiled):
    loop, clock = looped(compiled)
    start = clock.time
    for _ in range(20):
        loop.run(0.1)
    assert clock.time - start == pytest.approx(1.9, abs=0.01)


@pytest.mark.long
def test_the_clock_of_the_machine_and_a_stop_from_another_thread(compiled):
    loop = Loop([compiled.plant()], 10.0, 10.0)
    thread = threading.Thread(target=loop.run)
    start = time.perf_counter()
    thread.start()
    time.sleep(0.5)
    loop.order("kvlcc2_l7", "delta", 0.1)
    loop.stop()
    thread.join(5.0)
    assert not thread.is_alive()
    assert time.perf_counter() - start >= 0.5
    assert 10 <= loop.k <= 120


def test_orders_act_from_the_next_tick_and_the_last_one_counts(compiled):
    loop, _ = looped(compiled, ships=2)
    assert list(loop.vessels) == ["kvlcc2_l7", "kvlcc2_l7_2"]
    loop.order("kvlcc2_l7", "delta", 0.1)
    loop.order("kvlcc2_l7", "delta", 0.2)
    one, other = (vessel.plant for vessel in loop.vessels.values())
    assert one["delta_cmd"] == 0.0
    loop.step()
    assert one["delta_cmd"] == 0.2
    assert other["delta_cmd"] == 0.0
    loop.surround("kvlcc2_l7_2", Uniform(U_C=0.3).now())
    loop.step()
    assert other["current_x"] == pytest.approx(0.3)
    assert one["current_x"] == 0.0


def test_orders_beyond_the_limits_are_clipped_and_told_once(compiled):
    loop, _ = looped(compiled)
    for _ in range(5):
        loop.order("kvlcc2_l7", "delta", 1.0)
        loop.step()
    vessel = loop.vessels["kvlcc2_l7"]
    assert vessel.plant["delta_cmd"] == vessel.plant.ranges["delta"].high
    assert vessel.clipped == {"delta"}
    assert [event.kind for event in loop.events] == ["clipped"]
    assert "Rudder ordered 57.3 deg starboard, taken as 35 deg" in loop.events[0].text
    loop.order("kvlcc2_l7", "delta", 0.1)
    loop.step()
    assert not vessel.clipped


def test_who_was_commanded_and_hears_nothing_holds_and_is_told(compiled):
    loop, _ = looped(compiled, ships=2, patience=2.0)
    loop.run(5.0)
    assert not loop.events  # nobody has commanded yet
    loop.order("kvlcc2_l7", "delta", 0.1)
    loop.run(5.0)
    assert [(event.ship, event.kind) for event in loop.events] == [("kvlcc2_l7", "stale")]
    assert loop.events[0].t == pytest.approx(7.1, abs=0.11)
    assert loop.vessels["kvlcc2_l7"].stale
    assert loop.vessels["kvlcc2_l7"].plant["delta_cmd"] == 0.1
    loop.order("kvlcc2_l7", "delta", 0.1)
    loop.step()
    assert [event.kind for event in loop.events] == ["stale", "heard"]
    assert not loop.vessels["kvlcc2_l7"].stale


def test_reset_and_restore_bring_back_ships_instruments_and_time(compiled):
    loop, _ = looped(compiled, ships=2, sensors=SUITE)

    def on(duration):
        found = []
        for _ in range(round(duration * loop.rate)):
            loop.step()
            vessels = loop.vessels.values()
            found.append([(v.plant["x"], v.plant["psi"], [(r.t, r.values) for r in v.readings]) for v in vessels])
        return found

    loop.order("kvlcc2_l7", "delta", 0.3)
    first = on(5.0)
    saved = loop.snapshot()
    onward = on(5.0)
    loop.order("kvlcc2_l7", "delta", -0.3)
    loop.restore(saved)
    assert loop.t == 5.0
    assert on(5.0) == onward
    loop.reset()
    assert loop.k == 0
    loop.order("kvlcc2_l7", "delta", 0.3)
    assert on(5.0) == first


def test_orders_that_wait_and_what_is_known_of_a_ship_are_saved(compiled):
    loop, _ = looped(compiled, patience=2.0)
    loop.order("kvlcc2_l7", "delta", 1.0)
    loop.run(1.0)
    loop.order("kvlcc2_l7", "delta", 0.2)
    loop.surround("kvlcc2_l7", Uniform(U_C=0.3).now())
    other, _ = looped(compiled)
    other.restore(loop.snapshot())
    for one in (loop, other):
        vessel = one.vessels["kvlcc2_l7"]
        assert (vessel.heard, vessel.clipped) == (0.0, {"delta"})
        one.run(3.0)
        assert vessel.plant["delta_cmd"] == 0.2
        assert vessel.plant["current_x"] == 0.3
        assert vessel.stale
    assert other.vessels["kvlcc2_l7"].plant["x"] == loop.vessels["kvlcc2_l7"].plant["x"]


class Rolling:
    """Somebody who steers by a number of its own."""

    def __init__(self, loop: Loop) -> None:
        self.loop, self.number = loop, 0
        loop.after(self.tick)
        loop.keep("rolling", self)

    def tick(self, loop: Loop) -> None:
        self.number += 1
        loop.order("kvlcc2_l7", "delta", 0.3 * math.sin(0.5 * self.number))

    def snapshot(self):
        return self.number

    def restore(self, saved):
        self.number = int(saved)

    def reset(self):
        self.number = 0


def test_who_steers_from_beside_is_saved_restored_and_reset_with_the_ships(compiled):
    loop, _ = looped(compiled)
    steers, plant = Rolling(loop), loop.vessels["kvlcc2_l7"].plant

    def on(ticks):
        found = []
        for _ in range(ticks):
            loop.step()
            found.append((plant["psi"], plant["delta"], steers.number))
        return found

    first = on(50)
    saved = loop.snapshot()
    onward = on(50)
    loop.restore(saved)
    assert on(50) == onward
    loop.reset()
    assert on(50) == first
    before = loop.snapshot()
    with pytest.raises(ShipError, match="state of rolling"):
        loop.restore(before.replace(b'"rolling": 50', b'"rolling": []'))
    assert loop.snapshot() == before
    alone, _ = looped(compiled)
    with pytest.raises(ShipError, match="saved loop with rolling"):
        alone.restore(saved)
    loop.restore(alone.snapshot())  # who was not there begins anew
    assert steers.number == 0


def test_who_blew_up_stays_so_when_restored(compiled):
    wild = compiled.plant(start=(0.0, 0.0, 0.0, 1e200, 1e200, 1e200), n_P=1.0)
    loop = Loop({"wild": wild}, 10.0, clock=FakeClock())
    loop.run(1.0)
    failure = loop.vessels["wild"].failure
    saved = loop.snapshot()
    loop.reset()
    loop.restore(saved)
    assert failure is not None
    assert loop.vessels["wild"].failure == failure


def test_instruments_of_what_a_ship_does_not_have_are_refused():
    twin = load("twin_virtual")
    with pytest.raises(SensorError, match=r"feedback of twin_virtual.*delta"):
        Loop([Compiled.of(twin, DT).plant()], 10.0, sensors=Suite((Gyro(), Feedback())))
    fits = Suite((Feedback(controls=twin.model.controls),))
    loop = Loop([Compiled.of(twin, DT).plant()], 10.0, math.inf, sensors=fits)
    loop.run(2.0)
    assert set(loop.readings("twin_virtual")[0].values) == set(twin.model.controls)


@pytest.mark.parametrize("seeds", [(1, 2), (1, 1)])
def test_readings_of_two_ships_err_each_on_their_own(compiled, seeds):
    plants = [compiled.plant(seed=seed) for seed in seeds]
    loop = Loop(plants, 10.0, sensors=SUITE, clock=FakeClock())
    told = {name: [] for name in loop.vessels}
    loop.after(lambda loop: [told[name].extend(loop.readings(name)) for name in told])
    loop.run(10.0)
    one, other = ([r.values["x"] for r in rows if r.kind == "gnss"] for rows in told.values())
    assert len(one) == len(other) == 10
    assert one != other


def test_a_loop_is_not_restored_from_another(compiled):
    loop, _ = looped(compiled)
    two, _ = looped(compiled, ships=2)
    faster, _ = looped(compiled, rate=5.0)
    before = loop.snapshot()
    for wrong in (b"", b"[]", b"{}", two.snapshot(), faster.snapshot()):
        with pytest.raises(ShipError, match="saved loop"):
            loop.restore(wrong)
    assert loop.snapshot() == before


def test_who_blows_up_is_told_and_the_others_sail_on(compiled):
    wild = compiled.plant(start=(0.0, 0.0, 0.0, 1e200, 1e200, 1e200), n_P=1.0)
    loop = Loop({"wild": wild, "calm": compiled.plant()}, 10.0, clock=FakeClock())
    assert loop.run(5.0).ticks == 50
    assert loop.vessels["wild"].failure is not None
    assert loop.vessels["calm"].plant.k == 50
    assert [(e.ship, e.kind) for e in loop.events if e.kind == "failed"] == [("wild", "failed")]
    loop.reset()
    assert loop.vessels["wild"].failure is None


def test_a_listener_that_fails_is_dropped_and_told(compiled):
    loop, _ = looped(compiled)
    heard = []

    def fails(loop: Loop) -> None:
        raise OSError("connection lost")

    loop.after(fails)
    loop.after(lambda loop: heard.append(loop.k))
    loop.run(2.0)
    assert len(heard) == 20
    assert [(event.kind, event.text) for event in loop.events] == [("dropped", "a listener failed: connection lost")]


def test_events_are_bounded_and_counted(compiled):
    loop, _ = looped(compiled)
    for _ in range(3000):
        loop.tell("", "noise", "again")
    assert len(loop.events) == 1000
    assert loop.report.events["noise"] == 3000


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda p: Loop([], 10.0), "without ships"),
        (lambda p: Loop([p], 3.0), "whole number of its steps of 0.1 s"),
        (lambda p: Loop([p], 20.0), "whole number"),
        (lambda p: Loop([p], 0.0), "above zero"),
        (lambda p: Loop([p], 10.0, 0.01), "time factor 0.01; give 0.1 to 100"),
        (lambda p: Loop([p], 10.0, math.nan), "time factor"),
        (lambda p: Loop([p], 10.0, patience=0.0), "patience"),
        (lambda p: Loop([p], 10.0, sensors={"other": SUITE}), "no ship 'other'"),
    ],
)
def test_a_loop_that_cannot_be_is_refused(compiled, make, text):
    with pytest.raises(LoopError, match=text):
        make(compiled.plant())


@pytest.mark.parametrize(
    ("ship", "control", "value", "text"),
    [
        ("nobody", "delta", 0.1, "no ship 'nobody'"),
        ("kvlcc2_l7", "sail", 0.1, "no control 'sail'"),
        ("kvlcc2_l7", "delta", math.nan, "finite"),
    ],
)
def test_an_order_that_cannot_be_never_reaches_the_loop(compiled, ship, control, value, text):
    loop, _ = looped(compiled)
    with pytest.raises(CommandError, match=text):
        loop.order(ship, control, value)
    loop.step()
    assert not loop.events
