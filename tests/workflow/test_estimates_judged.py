"""An untuned estimate is judged by draws of its sigmas: probabilities of the criteria, and bands of its manoeuvres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.report.judging.imo import numbers
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load, save
from seatrial.validate.imo import ImoTable
from seatrial.workflow.asked import Approach, Bands, Span
from seatrial.workflow.evidence.bands import simulate_with_bands
from seatrial.workflow.judging import imo
from seatrial.workflow.simulation import simulate

KCS = Path(__file__).parents[2] / "examples" / "particulars" / "kcs.toml"


def written(folder: Path, share: float) -> Path:
    """The estimated KCS with this share of its sigmas."""
    ship = estimate(KCS).ship
    entries = {path: replace(entry, sigma=None if entry.sigma is None else share * entry.sigma)
               for path, entry in ship.entries.items()}  # fmt: skip
    return save(replace(ship, entries=entries), folder / "ship.toml")


@pytest.mark.slow
def test_bands_shrink_in_proportion_to_small_sigmas(tmp_path: Path) -> None:
    """To first order a band is as wide as the sigmas are; of a millionth of them it is the run itself."""
    wide, small, none = (
        simulate_with_bands(str(written(tmp_path, share)), "turning", Bands(90.0, 200)) for share in (0.1, 0.05, 1e-6)
    )
    assert wide.sailed.basis.kind == "stated"
    for name in ("advance", "tactical_diameter", "time_90"):
        widths = []
        for one in (wide, small, none):
            value, low, high = (index.value for index in one.indices[name])
            assert low <= value * (1 + 1e-4)  # draws are sailed by longer steps
            assert high >= value * (1 - 1e-4)
            widths.append((high - low) / value)
        assert widths[0] / widths[1] == pytest.approx(2.0, rel=0.1)
        assert widths[2] < 1e-4


@pytest.mark.slow
def test_draws_of_an_estimate_do_not_end_at_the_validity_of_its_file(tmp_path: Path) -> None:
    """Half of the draws turn faster than the run by the numbers themselves, which the file calls the limit."""
    ship = estimate(KCS).ship
    run = simulate_with_bands(str(written(tmp_path, 0.3)), "turning", Bands(90.0, 100))
    fastest = 1.01 * float(np.abs(run.run.trial["r"]).max())
    path = save(replace(ship, validity={**ship.validity, "r": (-fastest, fastest)}), tmp_path / "narrow.toml")
    narrow = simulate_with_bands(str(path), "turning", Bands(90.0, 100)).sailed.bands
    assert float(np.nanmax(np.abs(narrow.tracks[:, :, 5]))) > 1.2 * fastest
    assert np.isnan(narrow.failed).mean() > 0.95


def shares(table: ImoTable) -> dict[str, float]:
    return {row.title: row.band.met for row in table.rows if row.band is not None}


@pytest.mark.slow
def test_an_untuned_estimate_meets_criteria_with_a_probability(tmp_path: Path) -> None:
    path, made = written(tmp_path, 1.0), tmp_path / "imo.html"
    table = imo(path, made)
    met, whole = shares(table), table.together
    assert whole is not None
    assert len(met) == 12
    assert 0.0 < whole < min(met.values()) < 1.0
    assert table.verdict.startswith("An estimate, untuned: by its sigmas it meets all 12 criteria")
    assert f"least sure: {min(met, key=lambda title: met[title])}" in table.verdict
    assert numbers(table)["probability"] == whole
    # A hull whose two sides have the same numbers is as probable to either side.
    for title in met:
        other = title.replace("starboard", "port")
        assert met[title] == pytest.approx(met[other], abs=0.15)
    # Counted again from the runs of draws that the table carries.
    every = []
    for row in table.rows:
        if row.band is not None and row.source is not None and row.source.draws is not None:
            unit = 1.0 / table.L_pp if row.unit == "L" else np.degrees(1.0)
            values = unit * row.source.draws.indices[row.source.index]
            every.append((values <= row.limit) & (values >= 0.0 if row.unit == "L" else True))
            assert row.band.met == pytest.approx(float(np.mean(every[-1])))
    assert whole == pytest.approx(float(np.mean(np.all(every, axis=0))))
    assert "Circle and zigzag" in made.read_text(encoding="utf-8")


@pytest.mark.slow
def test_without_open_numbers_the_probability_is_the_verdict(tmp_path: Path) -> None:
    path = written(tmp_path, 1e-6)
    table, plain = imo(path), imo(estimate(KCS).ship)
    assert plain.together is None
    assert plain.verdict.startswith("Meets every criterion")
    assert shares(table) == dict.fromkeys(shares(table), 1.0)
    assert table.together == 1.0


@pytest.mark.long
@pytest.mark.parametrize(("name", "published"), [
    ("mariner", "mariner"), ("s175", "container_son_nomoto"), ("gms_110", "gms_110"), ("seiun_maru", "seiun_maru"),
])  # fmt: skip
def test_bands_hold_the_published_ship_that_had_no_part_in_the_sigmas(
    name: str, published: str, tmp_path: Path
) -> None:
    """Turn and zigzag to starboard: of five figures at 95 % two outside have a chance of .02."""
    path = save(estimate(KCS.with_name(f"{name}.toml")).ship, tmp_path / "ship.toml")
    ship, inside = load(published), []
    for manoeuvre, figures in (("turning", ("advance", "tactical_diameter", "transfer")),
                               ("zigzag", ("first_overshoot", "second_overshoot"))):  # fmt: skip
        run = simulate(ship, manoeuvre)
        span, truth = Span(duration=2.0 * run.trial.duration), run.indices  # slow draws come to the end too
        made = simulate_with_bands(str(path), manoeuvre, Bands(95.0, 300), begin=Approach(speed=ship.speed), span=span)
        for figure in figures:
            _, low, high = (one.value for one in made.indices[figure])
            inside.append(low <= truth[figure].value <= high)
    assert sum(inside) >= 4
