"""Pages of a study with a rival, from fits made by hand: the general one, and that of You 2023."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "studies" / "reports"))
import you2023

from seatrial.core.parameters import near, values
from seatrial.identify import Fit, Problem, Verdict
from seatrial.identify.components.servo import fit_servo
from seatrial.identify.components.thrust_map import fit_thrust
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.report.rivals import numbers, page
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.validate.rivals import AS_SAILED, FULL, RIVAL, TRUTH, VELOCITIES, Case, Drive, Rivals, score

pytestmark = pytest.mark.slow

TUG = load("qiuxin5")


def fitted(factor, *paths):
    """A fit by hand: the true values times a factor."""
    free = near(TUG.model, *paths, ratio=0.5)
    best = np.array([factor * f.start for f in free])
    return Fit(
        ship=TUG.having(dict(zip(paths, best.tolist(), strict=True))), free=free, values=best, sigma=0.1 * np.abs(best),
        covariance=np.eye(len(free)), shrinkage=np.ones(len(free)), at_bound=(),
        verdicts=tuple(Verdict(path, "identified", "well") for path in paths), history=np.zeros((0, 4)), objective=1.0,
        seconds=1.0, evaluations=9, status="converged", digest="0",
    )  # fmt: skip


@pytest.fixture(scope="module")
def found():
    run = simulate(TUG, Zigzag(n_P=7.0, delta=0.35, psi=0.35), duration=24.0, dt=0.2, speed=0.5, name="zigzag <7>")
    bare = replace(run, channels={n: run[n] for n in run.channels if not n.endswith("_cmd")})
    fits = {FULL: fitted(1.01, "inertia.m_11", "damping.X_u", "damping.N_r"), RIVAL: fitted(1.3, "damping.X_u")}
    scores = {TRUTH: score(TUG, [bare]), **{who: score(fit.ship, [bare]) for who, fit in fits.items()}}
    known = values(TUG.model)
    case = Case(AS_SAILED, "as it was", fits, np.array([known[f.path] for f in fits[FULL].free]), scores)
    n = np.repeat(np.arange(1.0, 11.0), 3)
    pull = np.array([float(TUG.model.thrusters.components[0].thrust(float(k))) for k in n])
    published = {"source": "a paper", FULL: {"u": 2.33}, "R2": {"alpha_1": 0.9992}}
    problem = Problem(TUG, (run,), fits[FULL].free)
    study = SimpleNamespace(name="demo", title="A <study>", virtual=None, problem=problem, test=(bare,),
                            published=published)  # fmt: skip
    drive = Drive({"1": (fit_thrust(n, pull, name="1"), n, pull)}, {"alpha_1": fit_servo([run], "alpha_1")}, TUG)
    return Rivals(study, (case,), drive)


def test_the_general_page_holds_errors_estimates_and_servos(found):
    html = page(found, provenance={"study": "a & b"}).html
    assert html.count("<svg") == 2
    for words in ("A &lt;study&gt;", "3 parameters", "1 parameter", "published, 3 parameters", "2.33 %", "0.9992",
                  "X_u", "thruster 1", "alpha_1", "a &amp; b"):  # fmt: skip
        assert words in html, words


@pytest.mark.long
def test_the_page_of_the_paper_adds_its_figures(found):
    html = you2023.page(found, {}).html
    assert html.count("<svg") == 2 + 2 + 1 + 1
    assert "zigzag &lt;7&gt;" in html
    for words in ("Tab. 3", "Tab. 5", "Figs. 14 and 15", "Fig. 21", "Fig. 22"):
        assert words in html, words


def test_numbers_are_those_of_the_scores(found):
    one = numbers(found)["cases"][AS_SAILED]
    assert one["sigmas_off"]["damping.X_u"] == pytest.approx(found.cases[0].away[1])
    assert one["rival_over_model"] == {v: found.cases[0].smaller(v) for v in VELOCITIES}
    assert numbers(found)["thrust"]["1"]["R2"] > 0.99
