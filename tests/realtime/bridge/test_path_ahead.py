"""The path ahead of a fitted ship: as the ship turns, as wide as it says, and refused elsewhere."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calibrated_run import calibrated
from fitted_run import saved, trial
from seatrial.belief.bands.sailing import Uncertain, sailed
from seatrial.belief.coverage import Reference
from seatrial.cli.app import main
from seatrial.core.errors import ShipError
from seatrial.environment import Uniform
from seatrial.models import Sampled
from seatrial.realtime.bridge.deck import Deck, Outfit
from seatrial.realtime.bridge.path import PERIOD, Ahead
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Plant, plant_of
from seatrial.ships.files import load
from seatrial.workflow.asked import Bands
from seatrial.workflow.evidence.ahead import path_ahead

CHI = math.sqrt(-2.0 * math.log(0.05))
"""Radius of the circle that holds 95 % of a normal position, in standard deviations of a component."""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fit to turns both ways whose numbers are open by 5 %."""
    return saved(tmp_path_factory.mktemp("fit") / "run", [trial(35.0), trial(35.0, side=-1)], share=0.05)


@pytest.fixture(scope="module")
def sure(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with a calibration."""
    made = saved(tmp_path_factory.mktemp("sure") / "run", [trial(35.0), trial(35.0, side=-1)])
    calibrated(made)
    return made


def own(path: Path, speed: float = 1.0) -> Plant:
    ship = load(path)
    return plant_of(ship, 20.0, Uniform(), (0.0, 0.0, 0.0, speed * ship.speed, 0.0, 0.0), 1)


def looked(path: Path, rudder: float = 0.0, speed: float = 1.0, seconds: float = 10.0) -> dict[str, Any]:
    plant = own(path, speed)
    made = ahead(path, plant)
    plant.order("delta", rudder)
    for _ in range(round(seconds / plant.dt)):
        plant.step()
    return made.look(plant.snapshot())


def ahead(path: Path, plant: Plant, draws: int | None = None, *, extrapolate: bool = False) -> Ahead:
    known = path_ahead(path, Bands(95.0, draws, extrapolate))
    assert known is not None
    return Ahead(plant, known)


@pytest.mark.slow
def test_the_path_is_what_the_ship_does_and_the_fan_widens(model: Path) -> None:
    plant = own(model)
    made = ahead(model, plant)
    plant.order("delta", 0.4)
    for _ in range(200):
        plant.step()
    rows = np.array(made.look(plant.snapshot())["rows"])
    assert rows[0, :4] == pytest.approx([0.0, plant["x"], plant["y"], plant["psi"]], rel=1e-6)
    area = rows[:, 4] * rows[:, 6] - rows[:, 5] ** 2
    assert (np.diff(np.trace(np.array([[rows[:, 4], rows[:, 5]], [rows[:, 5], rows[:, 6]]]))) > 0.0).all()
    assert (area > -1e-9).all()
    for _ in range(round(rows[-1, 0] / plant.dt)):
        plant.step()
    assert rows[-1, 1:4] == pytest.approx([plant["x"], plant["y"], plant["psi"]], rel=1e-5)


@pytest.mark.slow
def test_port_is_the_mirror_of_starboard(model: Path) -> None:
    port, starboard = (np.array(looked(model, side * 0.4)["rows"]) for side in (-1.0, 1.0))
    assert starboard[-1, 2] > 1.0
    # this ship turns a little better to port: its flow straightening differs by side
    assert port[-1, 1] == pytest.approx(starboard[-1, 1], rel=0.1)
    assert port[-1, 2:4] == pytest.approx(-starboard[-1, 2:4], rel=0.1)
    assert np.sign(port[-1, 5]) == -np.sign(starboard[-1, 5]) != 0.0


@pytest.mark.slow
def test_it_holds_as_many_ships_as_it_says(model: Path) -> None:
    """Other draws of the same posterior, by another integrator."""
    plant = own(model)
    made = ahead(model, plant)
    plant.order("delta", 0.4)
    for _ in range(200):
        plant.step()
    saved_state = plant.snapshot()
    rows = np.array(made.look(saved_state)["rows"])
    copy = plant.another()
    copy.restore(saved_state)
    _, lanes = made.sail(copy)
    held = made.known.held
    others = Uncertain(held.names, held.draws(1000, 99), np.zeros(6), made.draws.disturbance)
    ends = sailed(plant.ship, lanes, others, 5, "rk4")[:, 0, -1, :2] - rows[-1, 1:3]
    xx, xy, yy = rows[-1, 4:]
    inside = np.einsum("ni,ij,nj->n", ends, np.linalg.inv([[xx, xy], [xy, yy]]), ends) <= 1.0
    assert 0.92 <= inside.mean() <= 0.98


@pytest.mark.slow
def test_calibrated_bands_are_those_of_the_calibration(sure: Path) -> None:
    made = ahead(sure, own(sure))
    plant = own(sure)
    rows = np.array(made.look(plant.snapshot())["rows"])
    found = made.known.found
    assert found is not None
    half = found.half(rows[:, 0], np.ones((len(rows), 6)), "", 0.95)[:, :2]  # the draws have no say in it here
    assert np.sqrt(rows[1:, [4, 6]]) == pytest.approx(half[1:] * CHI / 1.95996, rel=0.01)


@pytest.mark.slow
def test_a_path_unlike_the_trials_has_wider_bands(sure: Path) -> None:
    """Novelty is the speed ahead over .01 m/s, as the reference has rested; the left-out windows knew .01 m/s."""
    rested = Reference(("u",), np.ones(1), np.zeros((5, 1)), 0.01, np.zeros(1), np.zeros(1), {})
    plant, made = own(sure), ahead(sure, own(sure))
    plain = np.array(made.look(plant.snapshot())["rows"])
    found = made.known.found
    assert found is not None
    left = replace(found.left, novelty=np.ones(found.left.error.shape[:2]))
    knowing = replace(found, novel=0.5, left=left, reference=rested)
    object.__setattr__(made, "known", replace(made.known, found=knowing))
    wide = np.array(made.look(plant.snapshot())["rows"])
    assert np.sqrt(wide[1:, 4] / plain[1:, 4]) == pytest.approx(np.sqrt(plant["u"] / 0.01), rel=0.05)


@pytest.mark.slow
def test_a_path_beyond_the_trials_has_no_bands(model: Path) -> None:
    slow = looked(model, speed=0.3, seconds=0.0)
    assert "beyond the trials of the fit in propeller" in slow["why"]
    assert {len(row) for row in slow["rows"]} == {4}
    plant = own(model, 0.3)
    assert ahead(model, plant, extrapolate=True).look(plant.snapshot())["why"] == ""


@pytest.mark.slow
def test_it_reaches_no_farther_than_its_bands_hold(sure: Path) -> None:
    plant = own(sure)
    known = ahead(sure, plant).known
    assert known.found is not None
    assert Ahead(plant, known, 1e4).span <= known.found.reach(0.95)
    assert Ahead(plant, known, 20.0).span == pytest.approx(20.0, rel=0.05)


@pytest.mark.slow
def test_the_bridge_shows_it_and_sails_the_same(model: Path, tmp_path: Path) -> None:
    states: list[list[float]] = []
    for with_path in (False, True):
        plant = own(model)
        loop = Loop({OWN: plant}, 20.0, math.inf)
        made = ahead(model, plant) if with_path else None
        deck = Deck(loop, Outfit(folder=tmp_path, ahead=made))
        deck.ask("one", {"do": "order", "name": "delta", "value": 0.3})
        for _ in range(100):
            loop.step()
        states.append([plant[name] for name in ("x", "y", "psi", "u", "v_m", "r")])
        assert (deck.hello("one")["bands"] is None) != with_path
        if made is None:
            assert deck.frame()["ahead"] is None
            continue
        until(partial(shown, deck))
        assert deck.frame()["ahead"]["rows"]
        deck.reset()
        assert deck.frame()["ahead"] is None
        deck.close()
    assert states[0] == states[1]


@pytest.mark.slow
def test_a_path_that_fails_is_not_the_last_one(model: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plant = own(model)
    made = ahead(model, plant)
    made.see(plant, 0.0)
    until(lambda: made.told is not None and len(made.told["rows"]) > 0)
    monkeypatch.setattr(made, "look", failing)
    until(lambda: (made.see(plant, 1e6 + time.monotonic()), made.told)[1] == {"t": 0.0, "rows": [], "why": "no luck"})
    monkeypatch.undo()
    until(lambda: (made.see(plant, 2e6 + time.monotonic()), len((made.told or {"rows": []})["rows"]) > 0)[1])
    made.close()


def failing(saved: bytes) -> dict[str, Any]:
    raise ValueError("no luck")


def test_where_draws_blow_up_there_are_no_bands(model: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The farthest would be missing, and the rest look sure."""
    plant = own(model)
    made = ahead(model, plant)

    def some_lost(*given: Any) -> Any:
        runs = sailed(*given)
        runs[:20] = np.nan
        return runs

    monkeypatch.setattr("seatrial.realtime.bridge.path.sailed", some_lost)
    told = made.look(plant.snapshot())
    assert told["why"] == "20 of 200 draws blow up on the way"
    assert {len(row) for row in told["rows"]} == {4}


def shown(deck: Deck) -> bool:
    return deck.frame()["ahead"] is not None


def until(met: Callable[[], bool], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not met():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.parametrize(("arguments", "told"), [
    (("kvlcc2_l7", "--bands", "95"), "has no posterior"),
    (("kvlcc2_l7", "--draws", "300"), "add --bands 95"),
    (("MODEL", "--bands", "100"), "--bands is 100 percent"),
    (("MODEL", "--bands", "95", "--draws", "20"), "--draws is 20; bands of 95 percent take 200"),
])  # fmt: skip
def test_what_has_no_fan_is_refused_in_one_line(
    arguments: tuple[str, ...], told: str, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [str(model) if one == "MODEL" else one for one in arguments]
    assert main(["bridge", *given, "--port", "0"]) == 2
    said = capsys.readouterr().err.strip()
    assert told in said
    assert "\n" not in said


def test_a_model_in_discrete_time_has_none(model: Path) -> None:
    known = ahead(model, own(model)).known
    ship = load("kvlcc2_l7_arx")
    assert isinstance(ship.model, Sampled)
    plant = plant_of(ship, 1.0 / float(ship.model.dt), Uniform(), (0.0, 0.0, 0.0, ship.speed, 0.0, 0.0), 1)
    with pytest.raises(ShipError, match="discrete time"):
        Ahead(plant, known)


def test_a_path_is_due_after_its_period_and_at_once_where_the_ship_was_set_elsewhere() -> None:
    one = object.__new__(Ahead)
    vars(one).update(told={"t": 1.0}, _saved=None, _due=-math.inf, _over=False, _leaps=0, _wake=threading.Condition(),
                     _worker=object())  # fmt: skip
    taken: Any = SimpleNamespace(snapshot=lambda: b"a state")

    def seen(now: float) -> bool:
        one._saved = None  # the thread has looked
        one.see(taken, now)
        return one._saved is not None

    assert [seen(now) for now in (10.0, 10.0 + 0.9 * PERIOD, 10.0 + 1.1 * PERIOD)] == [True, False, True]
    assert not seen(10.0 + 1.2 * PERIOD)
    one.forget()
    assert one.told is None
    assert seen(10.0 + 1.2 * PERIOD)
