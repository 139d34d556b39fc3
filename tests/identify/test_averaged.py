"""The mean over prior widths: of the fits it says, within them, and as good as one of them on its own truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.identify import Loss, Problem, StudyError
from seatrial.identify.networks.averaged import Averaged
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

BARE = load("esso_osaka_3m_hybrid")
TRUE = BARE.having({"residual_Y.d_n_N": 0.3, "residual_N.d_n_N": -0.2})
Y_v = BARE.model.hull.Y_v
FREE = (Free("hull.Y_v", Y_v, prior=Y_v, sigma=0.3 * abs(Y_v)),
        *(Free(f"residual_{path}", 0.0, prior=0.0, sigma=1.0) for path in ("Y.d_n_N", "N.d_n_N")))  # fmt: skip
SIZE = dict(zip(STATES, (1.0, 1.0, 0.2, 0.1, 0.05, 0.02), strict=True))


def turns(ship: Ship) -> Problem:
    """Four turns of 25 s with a hundredth of the scales as noise."""
    rng, made = np.random.default_rng(0), []
    for k, delta in enumerate((0.1, -0.3, 0.2, -0.2)):
        trial = simulate(ship, Turning(delta=delta, n_P=9.0), speed=0.3, duration=25.0, dt=0.1, method="euler")
        noisy = {n: trial[n] + 0.01 * s * rng.standard_normal(len(trial)) for n, s in SIZE.items()}
        made.append(replace(trial.having(**noisy), name=f"turn_{k}"))
    return Problem(BARE, tuple(made), FREE, Loss(SIZE, 1.0))


@pytest.mark.slow
def test_the_mean_lies_between_its_widths() -> None:
    own = turns(TRUE)
    estimator = Averaged(window=12.5, widths=(1.0, 0.0), threads=1)
    told = estimator.fit(own)
    each = [values for values, _ in estimator.each(own)]
    assert told.values == pytest.approx(np.mean(each, axis=0), rel=1e-12)
    assert each[0][1:] == pytest.approx((0.0, 0.0))
    assert each[1][1] > 0.1  # drawn to none by its prior, but towards the truth
    assert each[1][2] < -0.1
    assert told.status.startswith("mean of prior widths 0 (converged), 1 (converged)")
    assert [f.path for f in told.free] == [f.path for f in FREE]
    assert told.ship.model.residual_Y.get("d_n_N") == pytest.approx(told.values[1])


@pytest.mark.slow
def test_what_finds_the_seconds_to_leave_out_is_physics_on_windows_apart_and_counts() -> None:
    own = turns(TRUE)
    estimator = Averaged(window=12.5, stride=6.0, widths=(1.0, 0.0), pushed=3.0, threads=1)
    assert estimator.rounds == (0.0, 0.0, 1.0)
    each = [values for values, _ in estimator.each(own)]
    physics = replace(own, free=FREE[:1])
    apart, over = (Trajectory(window=12.5, stride=stride, threads=1).fit(physics).values[0] for stride in (None, 6.0))
    assert abs(apart - over) > 1e-3 * abs(Y_v)
    assert [one[0] for one in each[:2]] == pytest.approx([apart, over], rel=1e-4)
    assert np.array(each[:2])[:, 1:] == pytest.approx(np.zeros((2, 2)))
    told = estimator.fit(own)
    assert told.values == pytest.approx(np.mean(each, axis=0), rel=1e-9)
    assert told.status.count("(converged)") == 3
    # nothing pushes these ships; without looking for it there are two
    assert Averaged(window=12.5, widths=(1.0, 0.0)).rounds == (0.0, 1.0)


@pytest.mark.slow
def test_one_width_is_the_fit_itself() -> None:
    own = turns(TRUE)
    plain = Trajectory(window=12.5, threads=1).fit(own)
    alone = Averaged(window=12.5, widths=(1.0,), threads=1).fit(own)
    assert alone.values == pytest.approx(plain.values, rel=1e-9)
    assert alone.objective == pytest.approx(plain.objective, rel=1e-3)  # starts are searched anew


@pytest.mark.parametrize(("given", "told"), [
    ({"widths": ()}, "widths is"), ({"later": ("residual_*",)}, "estimator.later"), ({"pushed": 0.0}, "pushed is 0"),
])  # fmt: skip
def test_settings_that_cannot_be(given: dict[str, object], told: str) -> None:
    with pytest.raises(StudyError, match=told):
        Averaged(**given)  # type: ignore[arg-type]


@pytest.mark.slow
def test_it_needs_something_to_vary() -> None:
    with pytest.raises(StudyError, match="vary fits no free parameter"):
        Averaged(window=12.5, vary=("rudder.*",)).fit(turns(BARE))
