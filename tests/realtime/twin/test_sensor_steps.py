"""A sensor that steps is named as itself, on logs of the independent simulator; without a step nothing is named."""

from __future__ import annotations

import math

import pytest

from sea_logs import NOISE, Bridge, Row, sailed
from seatrial.realtime.twin.likely import Factors, likeliest
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import usual
from seatrial.ships.files import load

SHIP = load("kvlcc2")
CHANNELS = ("x", "y", "psi", "r", "u_w", "v_north", "v_east", "n_P", "delta")
ALL = NOISE | {"y": NOISE["x"], "v_east": NOISE["v_north"]}
AT = 600.0
STEPS = {
    "delta sensor jumped": ("delta", math.radians(3.0)), "compass jumped": ("psi", math.radians(3.0)),
    "log jumped": ("u_w", 0.4), "rate gyro jumped": ("r", math.radians(0.05)), "n_P sensor jumped": ("n_P", -0.15),
}  # fmt: skip


def stepped(name: str, by: float) -> list[Row]:
    """A log in a current across, whose sensor steps at `AT`."""

    def spoil(t: float, row: dict[str, float]) -> dict[str, float]:
        return row | {name: row[name] + by} if t >= AT and name in row else row

    return Bridge(sailed(current=(0.0, 0.3)), rates=(("x", 1.0), ("v_north", 1.0)), spoil=spoil).rows(AT + 150.0)


@pytest.mark.slow
@pytest.mark.parametrize(("cause", "sign"), [*((cause, 1.0) for cause in STEPS), ("delta sensor jumped", -1.0)])
def test_a_step_of_a_sensor_is_named_within_a_minute_and_a_half_and_nothing_else_is(cause: str, sign: float) -> None:
    """With its size; then the readings are as likely as ever, so that nothing follows."""
    name, by = STEPS[cause]
    live = Live(SHIP, usual(SHIP, CHANNELS, noise=ALL), CHANNELS)
    for t, row in stepped(name, sign * by):
        live.feed(t, row)
    assert [one.cause for one in live.alarms] == [cause]
    (alarm,) = live.alarms
    assert AT < alarm.named < AT + 90.0
    assert abs(alarm.since - AT) <= 15.0
    wanted = sign * by if name != "n_P" else by / (by + live.acting[0])
    assert alarm.size[0] == pytest.approx(wanted, rel=0.35)


@pytest.mark.slow
def test_revolutions_that_are_shown_too_high_may_be_a_lost_blade_too() -> None:
    live = Live(SHIP, usual(SHIP, CHANNELS, noise=ALL), CHANNELS)
    for t, row in stepped("n_P", 0.15):
        live.feed(t, row)
    (alarm,) = live.alarms
    names = {alarm.cause, *alarm.rivals}
    assert names == {"n_P sensor jumped", "n_P without its thrust", "a ship deeper than its file"}


@pytest.mark.long
def test_the_noise_that_is_found_on_a_log_does_not_hide_its_fault() -> None:
    """The noise is that of the rows before the fault, so that it is named as soon as by a twin with the usual noise."""
    rows = stepped("delta", -math.radians(3.0))
    settings, factors = likeliest(SHIP, usual(SHIP, CHANNELS, noise=ALL), rows)
    assert factors == Factors()
    live = Live(SHIP, settings, CHANNELS)
    for t, row in rows:
        live.feed(t, row)
    assert [one.cause for one in live.alarms] == ["delta sensor jumped"]
    assert live.alarms[0].named < AT + 90.0


@pytest.mark.long
@pytest.mark.parametrize("current", [(0.0, 0.0), (0.5, -0.3)])
def test_hours_of_sound_logs_name_nothing(current: tuple[float, float]) -> None:
    """Three hours of new courses, with another noise in each; 0.2 alarms a day are accepted."""
    alarms: list[str] = []
    for seed in range(3):
        courses = tuple(0.5 * math.sin(2.0 * k + seed) for k in range(12))
        motion = sailed(courses=courses, current=current, duration=3600.0)
        live = Live(SHIP, usual(SHIP, CHANNELS, noise=ALL), CHANNELS)
        for t, row in Bridge(motion, rates=(("x", 1.0), ("v_north", 1.0)), seed=seed).rows(3600.0):
            live.feed(t, row)
        alarms += [one.text for one in live.alarms]
    assert alarms == []
