"""Remedies of `check`, done as printed: the fault is gone, and the numbers are those that were planted."""

from __future__ import annotations

import numpy as np
import pytest

from garden import plants
from garden.faults import BY_NAME, FAULTS
from garden.logs import DEG, Folder, clean
from garden.remedies import cure, line, share
from garden.run import keys, trials
from seatrial.data import Trial
from seatrial.data.check import Finding, check_folder
from seatrial.data.prepare import mended


def found(folder: Folder) -> list[Finding]:
    return [f for f in check_folder(trials(folder)) if f.severity != "info"]


def done(folder: Folder, findings: list[Finding]) -> list[Trial]:
    steps = [step for one in findings for step in one.steps]
    return [part for trial in trials(folder) for part in mended(trial, steps)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heading_spike", pytest.param("rudder_stuck", marks=pytest.mark.long)])
def test_what_the_commands_write_mends_the_log(name: str) -> None:
    """check --remedy, mend --by, and check: nothing is found."""
    one = cure(BY_NAME[name], 1)
    assert one.found
    assert one.cured, line(one)


@pytest.mark.slow
def test_a_compass_and_speeds_made_with_it_are_turned_together() -> None:
    """Speeds of a receiver were resolved by a wrong heading: the track agrees, and straight legs drift to one side."""

    def askew(folder: Folder) -> Folder:
        off = 3.0 * DEG

        def turned(log):
            u, v = log.table["u"], log.table["v_m"]
            return log.having(psi=log.table["psi"] + off, u=u * np.cos(off) + v * np.sin(off),
                              v_m=v * np.cos(off) - u * np.sin(off))  # fmt: skip

        return folder.each(turned)

    folder = askew(clean())
    [told] = found(folder)
    assert told.key == "heading_bias"
    assert [step.amount[0] for step in told.steps] == pytest.approx([-3.0, -3.0], abs=0.1)
    assert keys(check_folder(done(folder, [told]))) == ()


AMOUNTS = {
    "heading_bias": (-3.0,), "heading_bias_1": (1.0,), "heading_magnetic": (8.0,), "heading_late": (-2.0,),
    "gyro_bias": (-2.0,), "gyro_scale": (1.0 / 1.06,), "rate_late": (-3.0,), "gnss_late": (-3.0,),
    "gnss_late_1": (-1.0,), "antenna_aft": (-100.0, 0.0), "antenna_fore": (60.0, 15.0), "log_scale": (1.0 / 1.05,),
    "log_bias": (-0.3,), "speed_water": (0.5, 70.0), "sway_at_bow": (130.0, 0.0), "speed_late": (-5.0,),
    "rudder_offset": (-1.5,), "rudder_offset_small": (0.7,), "rudder_scale": (1.0 / 1.1,),
    "rudder_sides": (1.0 / 1.12,), "rudder_late": (-4.0,), "clock_fast": (1.0 / 1.01,), "clock_rate": (1.0 / 0.9,),
    "heading_degrees": (DEG,), "rate_per_minute": (60.0,), "position_feet": (0.3048,), "speed_knots": (0.514444,),
    "revolutions_rpm": (1.0 / 60.0,), "rudder_small": (1.0 / DEG,), "clock_ms": (1e-3,),
}  # fmt: skip
"""What undoes a fault, in the units of its step."""


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", sorted(AMOUNTS))
def test_the_numbers_are_those_that_were_planted(name: str, seed: int) -> None:
    """Within a tenth of the error: of a factor, of its distance from one."""
    fault, wanted = BY_NAME[name], np.array(AMOUNTS[name])
    [told] = found(fault.plant(clean(weather=fault.weather, seed=seed)))
    [step] = told.steps
    factor = step.do.startswith(("multiply", "clock"))
    size = np.abs(wanted - 1.0) if factor else np.full(wanted.shape, np.abs(wanted).max())
    assert (np.abs(np.array(step.amount) - wanted) <= 0.1 * size).all(), (step.words, wanted)


@pytest.mark.long
def test_nine_in_ten_of_the_detected_faults_are_gone() -> None:
    """All faults, each on one of two seeds: no warning is left, and none is new."""
    cures = [cure(fault, 1 + k % 2) for k, fault in enumerate(FAULTS)]
    detected = [one for one in cures if one.detected]
    failed = "\n".join(line(one) for one in detected if not one.cured)
    assert sum(one.cured for one in detected) >= 0.9 * len(detected), f"{share(cures)}\n{failed}"


@pytest.mark.long
@pytest.mark.parametrize("name", [
    "current", "wind_to", "heading_stuck", "rudder_stuck", "rudder_sides", "revolutions_scale", "speed_water",
    "clock_rate", "rows_missing",
])  # fmt: skip
def test_a_fit_to_a_mended_log_is_right(name: str) -> None:
    """No parameter is called identified beyond four sigma, and nothing is suspected; of faults of a fit as well."""
    one = cure(BY_NAME[name], 1, fit=True)
    assert one.detected
    assert one.cured, line(one)
    assert one.suspected == ()


@pytest.mark.slow
def test_a_current_and_a_log_are_different_remedies() -> None:
    """A current is estimated with the fit; a log that shows speeds through the water is mended."""
    [current] = found(plants.drift(0.5, 70 * DEG)(clean()))
    assert current.steps == ()
    assert dict(current.nuisance)["current"] == pytest.approx(0.5, rel=0.1)
    assert "[nuisance] current = 0.5" in current.remedy
