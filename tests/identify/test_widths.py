"""Priors whose width left-out trials choose: free where trials speak for it, none where they do not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Fit, Loss, Problem, StudyError
from seatrial.identify.networks.widths import Widths
from seatrial.identify.resume import ResumeError, forget
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

BARE = load("esso_osaka_3m_hybrid")
Y_v = BARE.model.hull.Y_v
FREE = (Free("hull.Y_v", Y_v, prior=Y_v, sigma=0.3 * abs(Y_v)),
        *(Free(f"residual_{path}", 0.0, prior=0.0, sigma=1.0) for path in ("Y.d_n_N", "N.d_n_N")))  # fmt: skip


def trials(ship: Ship, noise: float, seconds: float = 60.0) -> tuple[Trial, ...]:
    rng, made = np.random.default_rng(0), []
    for k, delta in enumerate((0.1, -0.3, 0.2, -0.2)):
        trial = simulate(ship, Turning(delta=delta, n_P=9.0), speed=0.3, duration=seconds, dt=0.1, method="euler")
        noisy = {n: trial[n] + noise * s * rng.standard_normal(len(trial)) for n, s in zip(STATES, SIZE, strict=True)}
        made.append(replace(trial.having(**noisy), name=f"turn_{k}"))
    return tuple(made)


SIZE = (1.0, 1.0, 0.2, 0.1, 0.05, 0.02)


def problem(made: tuple[Trial, ...]) -> Problem:
    return Problem(BARE, made, FREE, Loss(dict(zip(STATES, SIZE, strict=True)), 1.0))


@pytest.mark.long
def test_left_out_trials_choose() -> None:
    estimator = Widths(window=20.0, widths=(0.0, 1.0), parts=2, threads=1)
    told = estimator.fit(problem(trials(BARE.having({"residual_Y.d_n_N": 0.3, "residual_N.d_n_N": -0.2}), 0.01)))
    assert "prior width 1 by left-out trials (0: " in told.status
    assert told.values[1:] == pytest.approx((0.3, -0.2), abs=0.05)
    alone = estimator.fit(problem(trials(BARE, 0.5, 25.0)))
    assert "prior width 0 by" in alone.status
    assert [f.path for f in alone.free] == ["hull.Y_v"]
    assert alone.ship.model.residual_Y.get("d_n_N") == 0.0


@pytest.mark.parametrize(("given", "told"), [
    ({"widths": (1.0, 1.0)}, "different factors"), ({"widths": (-1.0,)}, "none below zero"),
    ({"parts": 1}, "parts is 1"), ({"vary": "unit_*"}, "write a list"), ({"widths": ()}, "widths is"),
])  # fmt: skip
def test_settings_that_cannot_be(given: dict[str, object], told: str) -> None:
    with pytest.raises(StudyError, match=told):
        Widths(**given)  # type: ignore[arg-type]


@pytest.mark.slow
def test_problems_that_leave_nothing_to_choose() -> None:
    one = trials(BARE, 0.0, 25.0)
    with pytest.raises(StudyError, match="2 recordings to leave out"):
        Widths(window=20.0).fit(problem(one[:2]))
    with pytest.raises(StudyError, match="vary fits no free parameter"):
        Widths(window=20.0, vary=("rudder.*",)).fit(problem(one))


@pytest.mark.slow
def test_a_varied_parameter_needs_a_prior() -> None:
    flat = Free("residual_N.d_n_N", 0.0, low=-1.0, high=1.0)
    made = replace(problem(trials(BARE, 0.0, 25.0)), free=(*FREE[:2], flat))
    with pytest.raises(StudyError, match=r"residual_N\.d_n_N has no prior whose width"):
        Widths(window=20.0).fit(made)


@pytest.fixture
def fitted(monkeypatch) -> list[Problem]:
    """What was fitted, with the fits left out."""
    found: list[Problem] = []

    def fit(self: Trajectory, given: Problem, **_: object) -> Fit:
        found.append(given)
        p, none = np.array([f.start for f in given.free]), np.zeros(0)
        return Fit(given.ship, given.free, p, none, none, none, (), (), none, 0.0, 0.0, 1, "stopped", "")

    monkeypatch.setattr(Trajectory, "fit", fit)
    return found


@pytest.mark.long
def test_parts_of_one_recording_are_left_out_together(fitted: list[Problem]) -> None:
    names = ("turn_14-Sep-2020_15_58_08", "turn_cut_14-Sep-2020_15_58_08", "random_06-Aug-2020_16_24_25_4",
             "random_06-Aug-2020_16_24_25_6")  # fmt: skip
    made = tuple(replace(t, name=name) for t, name in zip(trials(BARE, 0.0, 25.0), names, strict=True))
    Widths(window=20.0, widths=(0.0, 1.0), parts=2)._scores(problem(made), None)
    left = [sorted(t.name for t in one.trials) for one in fitted]
    assert left == [sorted(names[:2]), sorted(names[2:])] * 2
    with pytest.raises(StudyError, match=r"estimator\.parts is 3.* 2 recordings.* 4 trials"):
        Widths(window=20.0).fit(problem(made))


@pytest.mark.slow
def test_the_choice_says_how_far_it_has_come(fitted: list[Problem]) -> None:
    """Also through a page, which passes rows on and is shown the ship that the search begins with."""
    said: list[str] = []

    class Words:
        def __call__(self, *_: float) -> None: ...

        def stage(self, text: str) -> None:
            said.append(text)

    class Page:
        beside, ships = Words(), list[Ship]()

        def __call__(self, *_: float) -> None: ...

        def at(self, ship: Callable[[], Ship]) -> None:
            self.ships.append(ship())

    page = Page()
    Widths(window=20.0, widths=(0.0, 1.0), parts=2, threads=1).fit(problem(trials(BARE, 0.0, 25.0)), progress=page)
    assert said == [f"choosing widths: fit {k} of 4" for k in (1, 2, 3, 4)]
    assert page.ships == [BARE]
    assert len(fitted) == 5


@pytest.mark.long
def test_left_out_trials_weigh_what_they_weigh_in_the_fit(fitted: list[Problem]) -> None:
    made = trials(BARE, 0.3, 25.0)
    plain, estimator = problem(made), Widths(window=20.0, parts=2)
    errors = {t.name: estimator._judge(plain, [t], dict(plain.loss.sigma)).standardised(np.array([Y_v, 0.0, 0.0]))
              for t in made}  # fmt: skip
    assert estimator._left_out(plain, 1.0) == pytest.approx(np.mean(list(errors.values())))
    weighty = replace(plain, loss=replace(plain.loss, weights={"turn_1": 3.0}))
    expected = sum(error * (3.0 if name == "turn_1" else 1.0) for name, error in errors.items()) / 6.0
    assert estimator._left_out(weighty, 1.0) == pytest.approx(expected)
    assert expected != pytest.approx(np.mean(list(errors.values())), rel=1e-3)


@pytest.mark.slow
def test_without_width_the_parameters_stand_at_the_mean_of_their_prior(fitted: list[Problem]) -> None:
    shifted = (FREE[0], replace(FREE[1], prior=0.2), FREE[2])
    ship = BARE.having({"residual_Y.d_n_N": 0.7, "residual_N.d_n_N": -0.4})
    fit = Widths(widths=(0.0,), parts=2).fit(replace(problem(trials(BARE, 0.0, 25.0)), ship=ship, free=shifted))
    assert fit.status == "stopped; prior width 0, the only one given"
    assert [f.path for f in fit.free] == ["hull.Y_v"]
    assert fit.ship.model.residual_Y.get("d_n_N") == 0.2
    assert fit.ship.model.residual_N.get("d_n_N") == 0.0
    (given,) = fitted
    assert given.ship.model.residual_Y.get("d_n_N") == 0.2


def test_a_finished_fit_tells_its_width() -> None:
    estimator, given = Widths(), problem(())
    assert estimator.chosen(given, {"hull.Y_v": 1.0}) == 0.0
    assert estimator.chosen(given, {"hull.Y_v": 1.0, FREE[1].path: 0.3, FREE[2].path: 0.3}) == pytest.approx(0.3)


@pytest.fixture
def asked(monkeypatch) -> list[float]:
    """The widths that were asked for, each scoring itself; the third time the process is killed."""
    found: list[float] = []

    def left_out(_: Widths, __: Problem, width: float, *___: object) -> float:
        if len(found) == 2:
            found.append(-1.0)
            raise KeyboardInterrupt
        found.append(width)
        return float("inf") if width == 0.0 else width

    monkeypatch.setattr(Widths, "_left_out", left_out)
    return found


def test_a_killed_choice_goes_on_with_the_widths_it_had_not_tried(tmp_path, asked) -> None:
    estimator, checkpoint = Widths(window=20.0, widths=(0.0, 2.0, 1.0), parts=2), tmp_path / "checkpoint.npz"
    made = problem(trials(BARE, 0.0, 25.0))
    with pytest.raises(KeyboardInterrupt):
        estimator._scores(made, checkpoint)
    assert asked == [0.0, 2.0, -1.0]
    assert estimator._scores(made, checkpoint) == {0.0: float("inf"), 2.0: 2.0, 1.0: 1.0}
    assert asked == [0.0, 2.0, -1.0, 1.0]
    with pytest.raises(ResumeError, match=r"checkpoint\.widths\.json belongs to another problem"):
        replace(estimator, window=10.0)._scores(made, checkpoint)
    (tmp_path / "checkpoint.widths.json").write_text('{"digest": "x", "scores": [1')
    with pytest.warns(UserWarning, match=r"checkpoint\.widths\.json: is damaged; set aside"):
        estimator._scores(made, checkpoint)
    forget(checkpoint)
    assert not list(tmp_path.iterdir())
