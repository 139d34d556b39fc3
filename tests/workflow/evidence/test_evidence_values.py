"""What bands are asked for and what they say of themselves: levels, draws, reasons, widths by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calibrated_run import RECORDINGS, WINDOWS, H, calibrated
from fitted_run import PATHS, covariance, saved, trial, truth
from seatrial.belief.bands.calibration import beside, load
from seatrial.belief.bands.held import SHARES
from seatrial.belief.bands.manoeuvring import Bands
from seatrial.belief.posterior import Posterior
from seatrial.belief.reading import posterior
from seatrial.core.errors import RequestError
from seatrial.core.parameters import Free, read
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.report.blocks import Line, Table
from seatrial.simulate.run import approach
from seatrial.study.grounds import Beyond, Grounds, covered
from seatrial.workflow.asked import Bands as Asked
from seatrial.workflow.asked import Draws, Predicting
from seatrial.workflow.evidence import ahead as paths_ahead
from seatrial.workflow.evidence import calibrate as calibrating
from seatrial.workflow.evidence import carded, designed, judged
from seatrial.workflow.evidence.bands import _arrays
from seatrial.workflow.evidence.calibrate import calibrate, of_one_day
from seatrial.workflow.evidence.drawn import Drawing, _unsure
from seatrial.workflow.evidence.fans import Banding
from seatrial.workflow.validate import _banding

DEG = math.pi / 180.0


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    return trial(35), trial(20, 20)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory, trials: tuple[Trial, ...]) -> Path:
    return saved(tmp_path_factory.mktemp("plain") / "run", trials)


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory, trials: tuple[Trial, ...]) -> Path:
    """With a calibration."""
    model = saved(tmp_path_factory.mktemp("held") / "run", trials)
    calibrated(model)
    return model


def banding(model: Path, level: float | None = 95.0, **more: Any) -> Banding | None:
    how = {name: more.pop(name) for name in ("smooth_start", "history", "fit_first") if name in more}
    return _banding(str(model), Asked(level, **more), Predicting(**how))


@pytest.mark.slow
def test_bands_of_predictions_are_asked_for_in_percent(held: Path) -> None:
    assert banding(held, None) is None
    usual = banding(held)
    assert usual is not None
    assert (usual.level, usual.draws, usual.extrapolate) == (pytest.approx(0.95), 1000, False)
    assert usual.plain is None
    assert usual.filters is None
    for few in (50, 20_000):
        made = banding(held, 80.0, count=few, extrapolate=True)
        assert made is not None
        assert (made.level, made.draws, made.extrapolate) == (pytest.approx(0.8), few, True)


@pytest.mark.parametrize(("level", "more", "told"), [
    (None, {"count": 100}, "--draws needs --bands: add --bands 95"),
    (None, {"extrapolate": True}, "--extrapolate needs --bands: add --bands 95"),
    (0.0, {}, "--bands is 0 percent"), (100.0, {}, "--bands is 100 percent"), (-5.0, {}, "--bands is -5 percent"),
    (95.0, {"count": 49}, "--draws is 49; bands take 50 to 20000"),
    (95.0, {"count": 20_001}, "--draws is 20001; bands take 50 to 20000"),
    (95.0, {"smooth_start": 2.0}, "leave --smooth-start out"),
    (95.0, {"history": 5.0, "fit_first": 5.0}, "--fit-first already estimates how a trial begins"),
])  # fmt: skip
def test_bands_of_predictions_that_cannot_be_are_refused(
    held: Path, level: float | None, more: dict[str, Any], told: str
) -> None:
    with pytest.raises(RequestError, match=told):
        banding(held, level, **more)


@pytest.mark.slow
def test_a_prediction_beyond_the_trials_of_the_fit_is_refused(held: Path, trials: tuple[Trial, ...]) -> None:
    """Rows of the prediction are those of the trial at the same times; the controls are the trial's."""
    asked, accepted = banding(held), banding(held, extrapolate=True)
    assert asked is not None
    assert accepted is not None
    one = trials[0]
    asked.refuse(one, one)
    asked.refuse(one, one.rows(slice(10, 60)))
    fast = one.having(u=3.0 * one["u"])
    with pytest.raises(RequestError, match=f"--bands: {one.name.replace('+', '.')} leaves the trials of the fit"):
        asked.refuse(one, fast.rows(slice(10, 60)))
    accepted.refuse(one, fast)
    hard = one.having(delta=np.where(one.t > 40.0, 2.0, one["delta"]))  # the rudder of the trial, in its later rows
    asked.refuse(hard, one.rows(slice(0, int(one.t.searchsorted(40.0)))))
    with pytest.raises(RequestError, match="leaves the trials"):
        asked.refuse(hard, one)


def drawing(**more: Any) -> Drawing:
    ship, spans = truth(), {"u": (0.0, 1.2), "delta": (-0.6, 0.6), "U_T": (0.0, 0.0)}
    free = tuple(Free(path, 1.0, prior=1.0, sigma=0.3) for path in PATHS)
    own = Posterior(ship, free, np.ones(3), covariance(0.01), "digest", Grounds((), ("turning",), spans))
    return replace(Drawing(own, None, 0.95, 200, False, True), **more)


def run(**channels: float) -> Trial:
    t = np.linspace(0.0, 10.0, 5)
    usual = {"x": 0.0, "y": 0.0, "psi": 0.0, "u": 1.0, "v_m": 0.0, "r": 0.0, "n_P": 10.0, "delta": 0.1}
    return Trial("run", t, {name: np.full(5, value) for name, value in (usual | channels).items()})


class Widened:
    """What left-out trials say: of three parameters two keep more than half of the variance of their priors."""

    words = ("widened by 3",)

    def shares(self, free: object, covariance: object) -> np.ndarray:
        return np.array([0.6, 0.5, 0.9])


def test_a_run_beyond_the_trials_has_no_bands_unless_accepted_or_told_by_left_out_trials() -> None:
    within, fast, windy = run(), run(u=2.0), run(U_T=9.0, gamma_T=0.0)
    asked = drawing()
    assert asked.refusal(within) == ""
    assert asked.beyond(within) == ()
    assert asked.refused(fast)[0].channel == "u"
    assert "accept it with --extrapolate; or let trials left out in turn widen them" in asked.refusal(fast)
    with pytest.raises(RequestError, match="--bands: the run leaves the trials of the fit"):
        asked.beyond(fast)
    accepted = drawing(extrapolate=True)
    assert accepted.refusal(fast) == ""
    assert accepted.beyond(fast)[0].channel == "u"
    wide = drawing(held=replace(asked.held, power=Widened()))
    assert wide.refused(fast) == ()
    assert [one.channel for one in wide.refused(windy)] == ["U_T"]
    assert wide.refusal(windy).endswith("accept it with --extrapolate")


def test_a_fit_that_kept_no_ranges_has_bands_only_where_accepted() -> None:
    old = replace(drawing().held, grounds=Grounds())
    assert drawing(held=old).ungrounded.startswith("the fit of kvlcc2_l7 did not keep the ranges of its trials")
    assert drawing(held=old).refusal(run()) == drawing(held=old).ungrounded
    assert drawing(held=old, extrapolate=True).ungrounded == ""
    assert drawing().ungrounded == ""


def bands(failed: tuple[float, ...] = (math.nan, math.nan), **indices: tuple[float, ...]) -> Bands:
    n = len(failed)
    return Bands(np.zeros(1), np.zeros((n, 1, 6)), {k: np.array(v) for k, v in indices.items()}, np.array(failed))


def test_what_bands_do_not_say_is_told_line_by_line() -> None:
    from seatrial.report.judging.bands import CALIBRATED, LEFT_OUT, PARAMETERS_ONLY

    asked, none = drawing(), ()
    told = asked._caveats(run(), none, PARAMETERS_ONLY, bands())
    assert len(told) == 1
    assert told[0].startswith("no trial of the fit is of this kind (")
    assert told[0].endswith("they are turning")
    lost = asked._caveats(run(), none, PARAMETERS_ONLY, bands((3.0, math.nan, 5.0)))
    assert lost[-1].startswith("2 of 3 draws have no revolutions that hold the speed, left the validity")
    doubt = drawing(explained=False)
    assert "as wide as these scatter about it" in doubt._caveats(run(), none, PARAMETERS_ONLY, bands())[0]
    assert not any("these scatter" in line for line in doubt._caveats(run(), none, LEFT_OUT, bands()))
    out = (Beyond("u", (0.0, 1.0), (0.0, 2.0)),)
    assert "the bands are not widened for it" in asked._caveats(run(), out, PARAMETERS_ONLY, bands())[0]
    assert "no left-out trial has tested the bands there" in asked._caveats(run(), out, CALIBRATED.on(24), bands())[0]
    wide = drawing(held=replace(asked.held, power=Widened()))
    assert "(2 of 3 free parameters)" in wide._caveats(run(), out, LEFT_OUT, bands())[0]


def test_bands_beyond_the_trials_grow_by_the_square_of_the_reach_as_far_as_the_form_fails() -> None:
    """Half of the variance is of the form: at 1.5 times the rudder it is 1.5^4 times as large."""
    from seatrial.report.judging.bands import PARAMETERS_ONLY

    held = replace(drawing().held, form=0.5)
    asked = drawing(held=held)
    far, other = Beyond("delta", (-0.2, 0.4), (-0.6, 0.0)), Beyond("U_T", (3.0, 4.0), (0.0, 9.0))
    assert asked._wider(()) == 1.0
    assert asked._wider((other,)) == 1.0, "a wind is no reach of the ship's form"
    assert asked._wider((other, far)) == pytest.approx(math.sqrt(0.5 + 0.5 * 1.5**4))
    spun = Beyond("r", (-0.01, 0.01), (0.0, 0.03))
    assert asked._wider((far, spun)) == asked._wider((far,)), "a motion that runs away is the model's own"
    assert asked._wider((spun,)) == pytest.approx(math.sqrt(0.5 + 0.5 * 2.0**4)), "but under tested orders it is all"
    assert drawing()._wider((far,)) == 1.0, "the trials do not contradict the form"
    still = Beyond("delta", (0.0, 0.0), (0.0, 0.6))
    assert asked._wider((still,)) == pytest.approx(math.sqrt(0.5 + 0.5 * 2.0**4)), "growth is told as far as twice"
    [told] = [line for line in asked._caveats(run(), (far,), PARAMETERS_ONLY, bands()) if "extrapolated" in line]
    assert told.endswith("the bands are 1.7 times as wide for it")
    sampled = drawing(held=replace(held, samples=np.ones((40, 3))))
    assert "not widened for it" in sampled._caveats(run(), (far,), PARAMETERS_ONLY, bands())[0]


@pytest.mark.slow
def test_a_turn_beyond_zigzags_has_bands_as_many_times_as_wide_as_is_told(
    tmp_path: Path, trials: tuple[Trial, ...]
) -> None:
    turn = trials[0].rows(slice(0, 150))  # of 35 deg, by trials of 20
    wide: list[np.ndarray] = []
    for form in (0.0, 0.6):
        model = saved(tmp_path / f"{form}", trials[1:], form=form)
        asked = Drawing.of(str(model), Asked(95.0, 200, extrapolate=True))
        ship = asked.held.ship
        policy, speed = Turning(approach(ship)[1], 35 * DEG), approach(ship)[0]
        found = asked.sail(ship, policy, turn, speed=speed, dt=0.1, weather=Uniform())
        told = asked._wider(found.beyond)
        low, high = found.bands.band("y", 0.95)
        wide.append((high - low)[-1] / told)
        assert told == pytest.approx(math.sqrt(1.0 + form * (1.75**4 - 1.0)), rel=0.01)
    assert wide[1] == pytest.approx(wide[0], rel=1e-6)


def test_draws_come_from_the_covariance_or_the_samples_and_say_so() -> None:
    assert drawing()._law == "drawn from the covariance of the fit, within its bounds, and followed by slopes"
    sampled = replace(drawing().held, samples=np.ones((40, 3)))
    assert drawing(held=sampled)._law == "drawn from the 40 samples of the posterior beside the model"


def test_draws_of_a_covariance_are_pairs_about_the_fit_within_the_bounds() -> None:
    held = drawing().held
    least = (held.mean - 1e-3 * np.abs(held.mean)).tolist()
    free = tuple(replace(one, low=low) for one, low in zip(held.free, least, strict=True))
    asked = drawing(held=replace(held, free=free))
    assert asked._by_slopes
    assert not drawing(held=replace(held, power=Widened()))._by_slopes
    assert not drawing(held=replace(held, samples=np.ones((40, 3))))._by_slopes
    assert not drawing(held=replace(held, fitted=False))._by_slopes
    drawn, (low, high) = asked._paired, asked.held.bounds
    half = -(-asked.count // 2)
    assert np.array_equal(drawn[0], held.mean)
    assert len(drawn) == 2 * half + 1
    assert np.array_equal(drawn[1 : half + 1], asked.held.draws(half, 1))
    mirrored = np.clip(2.0 * held.mean - drawn[1 : half + 1], low, high)
    np.testing.assert_allclose(drawn[half + 1 :], mirrored, rtol=1e-12)
    assert np.all((drawn >= low) & (drawn <= high))
    assert np.any(drawn[half + 1 :] == low), "a bound a thousandth away cuts the mirror image off"


def test_where_left_out_trials_say_less_is_told(held: Path) -> None:
    found = load(held, posterior(str(held)))
    far = found.reach(0.9)

    def told(kind: str = "turning", longest: float = far, scale: float | None = None, **more: Any) -> str:
        made = more.pop("made", bands(advance=(1.0, 2.0)))
        return " | ".join(_unsure(found, 0.9, kind, longest, scale, more.pop("sure", ()), made))

    assert "all indices: held against no left-out manoeuvre" in told()
    assert "calibrated up to" not in told()
    assert f"calibrated up to {far:.4g} s from the start" in told(longest=1.001 * far)
    assert "no left-out trial is of this kind (spiral)" in told("spiral")
    assert "no left-out trial is of this kind" not in told()
    assert "2.5 times as far apart" in told(scale=2.5)
    assert told(made=bands(advance=(math.nan, math.nan))) == ""


@pytest.mark.parametrize(("level", "least"), [(95.0, 200), (90.0, 100), (80.0, 50)])
def test_a_quantile_has_five_draws_beyond_it(plain: Path, level: float, least: int) -> None:
    with pytest.raises(RequestError, match=f"--draws is {least - 1}; bands of {level:g} percent take {least} to"):
        Drawing.of(str(plain), Asked(level, least - 1))
    made = Drawing.of(str(plain), Asked(level, least))
    assert (made.level, made.count, made.found, made.explained) == (pytest.approx(0.01 * level), least, None, True)


@pytest.mark.slow
def test_draws_are_a_thousand_unless_told_and_20000_at_most(plain: Path, held: Path) -> None:
    assert Drawing.of(str(plain), Asked(95.0, None, extrapolate=True)).count == 1000
    assert Drawing.of(str(plain), Asked(95.0, 20_000, extrapolate=True)).extrapolate
    assert Drawing.of(str(held), Asked(90.0, None)).found is not None
    for level, draws, told in ((95.0, 20_001, "--draws is 20001"), (0.0, None, "--bands is 0 percent"),
                               (100.0, None, "--bands is 100 percent"), (-1.0, None, "--bands is -1")):  # fmt: skip
        with pytest.raises(RequestError, match=told):
            Drawing.of(str(plain), Asked(level, draws))


def test_a_path_ahead_is_drawn_by_two_hundred_draws(plain: Path) -> None:
    made: Any = paths_ahead.path_ahead(plain, Asked(95.0))
    assert (made.draws, made.level, made.found) == (200, pytest.approx(0.95), None)
    assert made.refusal(run(u=9.0)).startswith("beyond the trials of the fit in ")
    assert made.refusal(trial(35)) == ""
    assert paths_ahead.path_ahead(plain, Asked()) is None
    for more in (Asked(count=300), Asked(extrapolate=True)):
        with pytest.raises(RequestError, match="add --bands 95"):
            paths_ahead.path_ahead(plain, more)
    with pytest.raises(RequestError, match="--bands: are those of a fitted ship"):
        paths_ahead.path_ahead(None, Asked(95.0))


def test_two_parts_are_the_fewest_that_leave_trials_out(plain: Path, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="--parts is 1; two or more leave trials out"):
        calibrate(str(plain), parts=1)
    with pytest.raises(RequestError, match=r"the study of its fit .* is not at hand"):
        calibrate(str(plain), parts=2)
    with pytest.raises(RequestError, match="--horizon is 0"):
        calibrate(str(plain), horizon=0.0)


def test_a_calibration_is_of_the_study_and_the_trials_of_the_fit(
    tmp_path: Path, trials: tuple[Trial, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    from seatrial.study.store import read_summary

    (tmp_path / "s.toml").write_text("text")
    model = saved(tmp_path / "run", trials, file=str(tmp_path / "s.toml"), text="text")
    summary = read_summary(model.parent)
    read_again = SimpleNamespace(problem=SimpleNamespace(trials=trials))
    monkeypatch.setattr(calibrating, "read_study", lambda _: read_again)
    assert calibrating._study(summary, str(model)) is read_again
    other = trials[0].having(u=2.0 * trials[0]["u"])
    for now, name in (((other, trials[1]), trials[0].name), (trials[:1], trials[1].name),
                      ((*trials, replace(trials[0], name="new")), "new")):  # fmt: skip
        read_again.problem.trials = now
        with pytest.raises(RequestError, match="trials are not as they were") as told:
            calibrating._study(summary, str(model))
        assert name in str(told.value)
    (tmp_path / "s.toml").write_text("changed")
    with pytest.raises(RequestError, match="has changed since the fit"):
        calibrating._study(summary, str(model))


@pytest.mark.slow
def test_a_calibration_tells_its_half_widths_in_si_and_shows_them_in_degrees(held: Path) -> None:
    """Errors that are some usual ones at random: a band of 95 % is about twice these, whatever the draws say."""
    found = load(held, posterior(str(held)))
    told = calibrating._document(found, beside(held))
    assert (told["recordings"], told["windows"]) == (RECORDINGS, RECORDINGS * WINDOWS)
    assert told["kinds"] == ["turning", "zigzag"]
    assert told["level"] == 0.95
    assert told["horizons"] == H.tolist()
    assert told["written"] == str(beside(held))
    assert [one["on"] for one in told["disturbance"]["accelerations"]] == ["u", "r"]
    assert told["disturbance"]["current"] == 0.005
    made = found.factors(0.95)
    assert set(told["half_width"]) == {"turning", "zigzag", "any other"}
    for k, kind in enumerate(made.kinds):
        for c, name in enumerate(STATES):
            spread = np.nanmedian(found.left.spread, axis=0)[:, c]
            usual = spread**found.share * found.left.usual[:, c] ** (1.0 - found.share)
            assert told["half_width"][kind or "any other"][name] == pytest.approx(made.factor[k, :, c] * usual)
    table, *lines = calibrating._shown(found)
    assert isinstance(table, Table)
    assert [row[1] for row in table.rows[:3]] == ["10", "60", "150"]
    assert len(table.rows) == 3 * len(made.kinds)
    width = told["half_width"][made.kinds[0] or "any other"]
    assert float(table.rows[0][3]) == pytest.approx(width["x"][0], rel=0.06)
    assert float(table.rows[0][5]) == pytest.approx(width["psi"][0] / DEG, rel=0.06)
    assert float(table.rows[0][8]) == pytest.approx(width["r"][0] / DEG, rel=0.06)
    assert float(table.rows[0][6]) == pytest.approx(width["u"][0], rel=0.06)
    assert table.words == ()
    assert lines[0] == Line("half widths of usual bands of 95 %, by kind of manoeuvre")
    assert lines[1].text.startswith(f"bands hold up to {found.reach(0.95):.4g} s")
    later: Any = replace(found, begin="history")
    assert calibrating._begun(later) == "; predictions by --history"


def test_recordings_of_two_days_are_not_of_one() -> None:
    def named(*groups: str) -> Any:
        return SimpleNamespace(left=SimpleNamespace(kinds=["turning"] * len(groups), groups=list(groups)))

    assert of_one_day(named("a_2020-08-06", "b_2020-08-07")) == ()
    assert of_one_day(named("a_2020-08-06", "b")) == ()
    assert len(of_one_day(named("a_2020-08-06", "b_2020-08-06"))) == 1


@pytest.mark.slow
def test_coverage_on_unseen_trials_is_at_shares_of_the_window(
    plain: Path, held: Path, trials: tuple[Trial, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the reach of the calibration where the windows are longer; a trial of other speeds is told."""
    own, lines = posterior(str(held)), list[str]()
    sink: Any = SimpleNamespace(note=lines.append)
    monkeypatch.setattr(carded, "crossed", lambda found, level: (found, level))
    assert carded.calibrated_of(str(plain), posterior(str(plain)), (), 40.0, sink) is None
    assert carded.calibrated_of(str(held), None, (), 40.0, sink) is None
    found = carded.calibrated_of(str(held), own, trials[:1], 20.0, sink)
    assert found is not None
    assert (found.recordings, found.kinds) == (RECORDINGS, ("turning", "zigzag"))
    assert found.reach == load(held, own).reach(0.95) == 150.0
    assert sorted({row.horizon for row in found.unseen}) == pytest.approx([share * 20.0 for share in SHARES])
    assert not any("leaves the trials of the fit" in line for line in found.doubts)
    assert found.left_out[1] == 0.95  # type: ignore[comparison-overlap]
    far = carded._unseen(load(held, own), own, (), 1e4, 150.0, lines)
    assert far == ()
    fast = trials[0].having(u=3.0 * trials[0]["u"])
    assert next(iter(carded._beyond(own, fast))).startswith(f"{fast.name} leaves the trials of the fit: ")
    assert list(carded._beyond(own, trials[0])) == []


def test_requirements_take_draws_of_the_fit_and_say_how_far_they_are(plain: Path) -> None:
    own, notes = posterior(str(plain)), list[str]()
    ships = list(judged._ships(own, 41, notes.append))
    assert notes == ["draw 20 of 41", "draw 40 of 41"]
    drawn = own.draws(41, judged.SEED)
    for row, ship in zip(drawn, ships, strict=True):
        assert [float(read(ship.model, path)) for path in PATHS] == pytest.approx(row.tolist())


class Designed:
    """What a plan says of two parameters: their priors, and the information of its trials."""

    free = tuple(Free(path, 1.0, prior=1.0, sigma=size) for path, size in (("hull.N_r", 0.5), ("hull.R_0", 0.2)))


def test_before_its_trials_a_design_knows_the_fit_or_the_priors(plain: Path) -> None:
    plan: Any = Designed()
    notes: list[str] = []
    alone = designed._known(plan, None, notes.append)
    assert "as open as their priors" in notes[0]
    assert np.count_nonzero(alone - np.diag(np.diag(alone))) == 0
    fitted = designed._known(plan, plain, notes.append)
    own = posterior(str(plain))
    k = own.names.index("hull.N_r")
    assert fitted[0, 0] == pytest.approx(own.covariance[k, k])
    assert fitted[1, 1] == alone[1, 1]
    assert "1 of 2 parameters are as open as the fit leaves them" in notes[1]
    assert designed._known(plan, "kvlcc2_l7", notes.append).tolist() == alone.tolist()


@pytest.mark.parametrize(("level", "draws", "told"), [
    (0.0, None, "--bands is 0"), (100.0, None, "--bands is 100"), (95.0, 99, "--draws is 99; bands of a design take "
     "100 to 20000"), (95.0, 20_001, "--draws is 20001"),
])  # fmt: skip
def test_bands_of_a_design_that_cannot_be_are_refused(level: float, draws: int | None, told: str) -> None:
    with pytest.raises(RequestError, match=told):
        designed.foreseen(truth(), Designed(), Draws(level, draws))  # type: ignore[arg-type]


def test_a_foreseen_index_is_in_the_unit_of_its_row() -> None:
    values = np.linspace(0.0, 1.0, 101)
    side = Bands(np.zeros(1), np.zeros((101, 1, 6)), {"a": values}, np.full(101, np.nan))
    half = Bands(np.zeros(1), np.zeros((101, 1, 6)), {"a": 0.5 * values}, np.full(101, np.nan))
    for unit, factor in (("L", 1.0 / 50.0), ("deg", 1.0 / DEG)):
        row: Any = SimpleNamespace(title="A", unit=unit, value=0.4, source=SimpleNamespace(index="a"))
        found = designed._row(row, 80.0, 50.0, side, half)
        assert found.before == pytest.approx((0.1 * factor, 0.9 * factor))
        assert found.after == pytest.approx((0.05 * factor, 0.45 * factor))
        assert found.share == pytest.approx(0.5)
        assert (found.name, found.unit, found.value) == ("A", unit, 0.4)
    none = replace(found, before=(1.0, 1.0))
    assert math.isnan(none.share)
    told: Mapping[str, Any] = designed.document([found, replace(found, after=(math.nan, 2.0))], 80.0)
    assert told["level"] == 80.0
    assert told["indices"][1]["after"] == [None, 2.0]
    assert told["indices"][0]["before"] == pytest.approx(list(found.before))


@pytest.mark.slow
def test_what_is_exported_of_draws_is_thinned_to_two_hundred_rows() -> None:
    rows = 1001
    made = Bands(np.arange(float(rows)), np.zeros((3, rows, 6)), {"a": np.ones(3)}, np.full(3, np.nan))
    sailed = SimpleNamespace(bands=made, basis=SimpleNamespace(kind="k"), draws=np.ones((3, 2)))
    banded: Any = SimpleNamespace(sailed=sailed, level=0.9, posterior=SimpleNamespace(digest="d", free=()))
    found = _arrays(banded)
    assert found["t"].tolist() == np.arange(0.0, rows, 5.0).tolist()  # the first and the last among them
    assert found["tracks"].shape == (3, 201, 6)
    assert len(found["x_low"]) == 201
    short = Bands(np.arange(5.0), np.zeros((3, 5, 6)), {}, np.full(3, np.nan))
    banded.sailed.bands = short
    assert _arrays(banded)["t"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert covered((), ()) == {}
