"""Twin screws, a tug with azimuths and a 3 m model: sound logs, and faults of one of several controls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from garden.calibrate import calibrated, line
from garden.faults import OTHERS, faults
from garden.logs import Folder, clean
from garden.run import keys, one, table
from seatrial.data import Trial
from seatrial.data.check import check_folder
from seatrial.data.trialfile import read_trial
from seatrial.identify.diagnosis.channels import Channel
from seatrial.identify.noise import between_rows
from seatrial.workflow.data import import_logs

SEED = 4


def trials(folder: Folder) -> list[Trial]:
    return [Trial(log.name, log.t, dict(log.table), {}, dict(folder.meta)) for log in folder.logs]


@pytest.mark.slow
@pytest.mark.parametrize("ship", ["twin", "tug", pytest.param("esso", marks=pytest.mark.long)])
def test_sound_logs_of_any_ship_get_no_warning(ship: str) -> None:
    assert keys(check_folder(trials(clean(ship, rate=2.0)))) == ()


@pytest.mark.parametrize(("ship", "name"), [("twin", "rudder_sign_starboard"), ("twin", "rudder_zero_starboard"),
                                            ("tug", "azimuths_astern"), ("tug", "thruster_rpm")])  # fmt: skip
@pytest.mark.slow
def test_the_one_of_several_that_is_wrong_is_named(ship: str, name: str) -> None:
    [fault] = [one for one in faults(ship) if one.name == name]
    told = keys(check_folder(trials(fault.plant(clean(ship, rate=2.0)))))
    assert set(told) & set(fault.culprits), told


@pytest.mark.slow
def test_the_table_of_a_tug_is_imported_by_a_mapping(tmp_path: Path) -> None:
    """Thrusters with numbers are channels of their own: rpm and degrees come out in 1/s and rad."""
    folder = clean("tug", rate=2.0)
    mapping = folder.write_raw(tmp_path / "raw")
    trial = read_trial(import_logs("csv", tmp_path / "raw", tmp_path / "trials", mapping).written[0])
    [log] = [log for log in folder.logs if log.name == trial.name]
    for name in folder.ship.controls:
        np.testing.assert_allclose(trial[name], log.table[name], atol=1e-6)


def test_each_ship_has_faults_of_its_own() -> None:
    for planted in OTHERS.values():
        assert len({fault.name for fault in planted}) == len(planted) >= 12


def test_what_two_readings_leave_open_is_where_an_actuator_begins_and_ends_to_move() -> None:
    """A ramp from 20.3 to 24.3 s, and a step within one second; the mean of the latter is open by D over root 12."""
    t = np.arange(60.0)
    read = 5.0 * np.clip(t - 20.3, 0.0, 4.0) - np.where(t > 40.5, 20.0, 0.0)
    read += 0.05 * np.random.default_rng(0).standard_normal(t.size)
    means = np.append(0.5 * (read[1:] + read[:-1]), read[-1])
    left = between_rows(means[None, :, None], np.array([0.05]))[0, :, 0]
    assert set(np.flatnonzero(left > 0.4)) == {20, 24, 40}
    np.testing.assert_allclose(left[[20, 24]], 0.5 * 0.3 * 0.7 * 5.0, rtol=0.1)
    np.testing.assert_allclose(left[40], 20.0 / np.sqrt(12.0), rtol=0.02)
    assert np.median(left) == 0.0


def test_residuals_that_the_noise_of_inputs_explains_do_not_contradict_the_model() -> None:
    def told(by_inputs: float) -> tuple[str, ...]:
        return Channel(0.0026, 1.6, 0.05, 0.01, 1.0, 5000, by_inputs).grounds("psi")

    assert told(0.0)
    assert not told(1.2)


@pytest.mark.long
@pytest.mark.parametrize("ship", OTHERS)
def test_nothing_of_another_ship_is_silently_wrong(ship: str) -> None:
    """The bars of the whole, one seed: import, check and fit together."""
    planted = {fault.name: fault for fault in faults(ship)}
    outcomes = [one(fault, SEED, ship) for fault in planted.values()]
    shown = table(outcomes, planted)
    wrong, visible = [o for o in outcomes if o.wrong], [o for o in outcomes if planted[o.fault].visible]
    assert not [o for o in wrong if not o.said], shown
    assert len(wrong) <= 0.02 * len(outcomes), shown
    assert sum(o.named(planted[o.fault].culprits) for o in visible) >= 0.85 * len(visible), shown


@pytest.mark.long
@pytest.mark.parametrize("spec", ["esso:calm:1:6", "esso:current::4", "twin:wind::6", "tug:calm::6"])
def test_the_sigmas_of_any_ship_are_honest(spec: str) -> None:
    """Few seeds of each: no alarm, and errors over sigmas within what so few allow; `garden.calibrate` runs more."""
    found = calibrated(spec)
    assert not found.alarms, line(found)
    assert not found.lacking, line(found)
    assert 0.6 < found.rms_z < 1.5, line(found)
