"""The garden: the simulator against the package, five faults in the unit tier, all of them in the long tier."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from garden import plants, ships
from garden.faults import BY_NAME, FAULTS
from garden.fleet import FLEET
from garden.logs import clean
from garden.motion import Weather
from garden.run import Outcome, keys, one, ship_file, table, trials
from seatrial import load
from seatrial.data.check import check_folder
from seatrial.environment import Environment

SEEDS = (1, 2, 3)


def told(name: str, seed: int = 1) -> tuple[str, ...]:
    fault = BY_NAME[name]
    return keys(check_folder(trials(fault.plant(clean(weather=fault.weather, seed=seed)))))


@pytest.mark.parametrize("ship", [vessel.ship for vessel in FLEET.values()], ids=lambda ship: ship.name)
def test_the_simulator_has_the_equations_of_the_paper_as_the_package_has(ship: ships.Ship, tmp_path: Path) -> None:
    """Two independent codes of one paper; the garden uses nothing of the package."""
    model, random = load(ship_file(ship, tmp_path)).model, np.random.default_rng(0)
    wind = (6.0, -4.0) if ship.areas else (0.0, 0.0)
    n = ships.revolutions(ship, ship.speed)
    assert model.controls == ship.controls
    for _ in range(50):
        u, v, r = ship.speed * random.uniform((0.3, -0.4, -0.8), (1.0, 0.4, 0.8)) / (1.0, 1.0, ship.length)
        controls = tuple(n * random.uniform(0.7, 1.2) if name.startswith("n") else random.uniform(-0.6, 0.6)
                         for name in ship.controls)  # fmt: skip
        ours = ship.rates(u, v, r, controls, (u + wind[0], v + wind[1]))
        theirs = model.derivative((0.0, 0.0, 0.0, u, v, r), controls, Environment(*wind))[3:6]
        np.testing.assert_allclose(ours, np.array(theirs, dtype=float), rtol=1e-8, atol=1e-12)


@pytest.mark.slow
def test_a_clean_folder_gets_no_warning() -> None:
    for weather in FLEET["full"].weathers:
        found = keys(check_folder(trials(clean(weather=weather))))
        assert set(found) <= ({"current", "current:x", "current:y"} if weather == "current" else set())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heading_bias", "gnss_late", "antenna_aft", "rate_sign", "rudder_offset"])
def test_the_right_culprit_is_named(name: str) -> None:
    assert set(told(name)) & set(BY_NAME[name].culprits)


def test_the_list_is_long_and_says_why_what_cannot_be_seen() -> None:
    assert len(FAULTS) >= 60
    assert len(BY_NAME) == len(FAULTS)
    assert all(fault.why for fault in FAULTS if not fault.visible)


def _sizes(name: str) -> list[float]:
    """Numbers in the words of the first warning or error."""
    fault = BY_NAME[name]
    found = [f for f in check_folder(trials(fault.plant(clean(weather=fault.weather)))) if f.severity != "info"]
    words = found[0].what.replace(",", " ").split()
    return [float(word) for word in words if word.lstrip("+-").replace(".", "", 1).isdigit()]


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "size", "off"),
    [("heading_bias", 3.0, 0.05), ("heading_bias_1", -1.0, 0.05), ("gyro_bias", 2.0, 0.1), ("gnss_late", 3.0, 0.2),
     ("gnss_late_1", 1.0, 0.2), ("heading_late", 2.0, 0.2), ("rate_late", 3.0, 0.2), ("antenna_aft", 100.0, 2.0),
     ("log_scale", 5.0, 0.1), ("rudder_offset", 1.5, 0.1), ("log_bias", 0.3, 0.01), ("speed_late", 5.0, 0.3)],
)  # fmt: skip
def test_the_size_is_right(name: str, size: float, off: float) -> None:
    assert min(abs(found - size) for found in _sizes(name)) < off


@pytest.mark.long
def test_clean_logs_get_no_warning() -> None:
    """Calm, wind and current, full scale and model, 1 to 10 Hz: no warning but of the current."""
    for seed in range(1, 9):
        for ship, weather, rate in (("full", "calm", 1.0), ("full", "wind", 1.0 + seed % 5), ("model", "calm", 5.0),
                                    ("full", "current", 1.0), ("model", "current", 10.0)):  # fmt: skip
            found = set(keys(check_folder(trials(clean(ship, weather, seed, rate)))))
            allowed = {"current", "current:x", "current:y"} if weather == "current" else set()
            assert found <= allowed, (ship, weather, seed, found)


def by_check(outcome: Outcome) -> Outcome:
    """What was said before the fit: some faults only a fit can see (scales of revolutions and wind)."""
    told = tuple(key for key in outcome.findings if key != "no_wind")  # a warning of the study
    return replace(outcome, suspects=(), findings=told, refused=outcome.refused.startswith("import") * outcome.refused)


@pytest.mark.long
def test_nothing_is_silently_wrong_and_check_names_what_it_can_see() -> None:
    """The bars of the whole: import, check and fit together, each fault on one of three seeds."""
    outcomes = [one(fault, SEEDS[k % len(SEEDS)]) for k, fault in enumerate(FAULTS)]
    shown = table(outcomes, BY_NAME)
    wrong, visible = [o for o in outcomes if o.wrong], [o for o in outcomes if BY_NAME[o.fault].visible]
    assert not [o for o in wrong if not o.said], shown
    assert len(wrong) <= 0.02 * len(outcomes), shown
    assert sum(by_check(o).named(BY_NAME[o.fault].culprits) for o in visible) >= 0.85 * len(visible), shown


@pytest.mark.slow
def test_a_current_is_motion_in_still_water_and_a_drift() -> None:
    still, moved = clean(seed=1), plants.drift(0.5, 1.0)(clean(seed=1))
    [a, b] = (folder.logs[0] for folder in (still, moved))
    east = b.table["y"] - a.table["y"]
    np.testing.assert_allclose(east, 0.5 * np.sin(1.0) * a.t, atol=1e-9)
    assert replace(Weather(), current=0.5).current == 0.5
