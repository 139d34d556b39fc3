"""Tables: printed, as HTML, and through the Arrow interface; trials and findings among them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import seatrial as st
from seatrial.face.tables import Table, Tabular, table_of


@dataclass(frozen=True, repr=False)
class Some(Tabular):
    rows: tuple[tuple[str | float | int | None, ...], ...]

    @property
    def table(self) -> Table:
        return table_of("<some>", ("name", "value"), self.rows, ("a & b",))


class Foreign:
    """What any other library knows of an object: the Arrow interface, and nothing else."""

    def __init__(self, held: object) -> None:
        self.held = held

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self.held.__arrow_c_stream__(requested_schema)  # type: ignore[attr-defined]


def trial() -> st.Trial:
    t = np.arange(50.0)
    return st.Trial("a", t, {"psi": 0.01 * t, "u": np.where(t > 40, np.nan, 1.0)}, meta={"ship": "<b>"})


def test_numbers_stand_to_the_right_and_gaps_are_empty() -> None:
    lines = str(Some((("a", 1.5), ("bb", None), ("c", -0.00012345)))).splitlines()
    assert lines == ["<some>", "name       value", "a          1.500", "bb", "c     -1.234e-04", "a & b"]
    assert str(Some(())) == "<some>\na & b"


def test_html_is_escaped() -> None:
    html = Some((("<script>", 1),))._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert "&lt;b&gt;" in trial()._repr_html_()


@pytest.mark.parametrize("held", [Some((("a", 1), ("b", 2.5))), trial(), st.load("zeefakkel").parameters])
def test_any_library_reads_the_arrow_interface(held: st.Trial | Some) -> None:
    assert pl.DataFrame(Foreign(held)).equals(held.to_frame())


def test_a_trial_as_a_frame_is_bit_for_bit_and_names_units_on_request() -> None:
    one = trial()
    frame = one.to_frame()
    assert frame.columns == ["t", "psi", "u"]
    assert np.array_equal(frame["u"].to_numpy(), one["u"], equal_nan=True)
    assert one.to_frame(units=True).columns == ["t [s]", "psi [rad]", "u [m/s]"]
    assert one.rows(slice(0, 50, 7)).to_frame().height == 8  # a view that is not contiguous


def test_the_page_of_a_trial_tells_its_gaps() -> None:
    assert trial()._ranges().rows == (("psi", "rad", 0.0, 0.49, 0), ("u", "m/s", 1.0, 1.0, 9))
    empty = trial().having(u=np.full(50, np.nan))._ranges().rows[1]
    assert empty == ("u", "m/s", None, None, 50)


def test_a_trial_is_saved_and_read_with_its_verbs(tmp_path: Path) -> None:
    trial().save(tmp_path / "a.csv")
    trial().save(tmp_path / "b.parquet")
    one, other = st.read_trials(tmp_path)
    assert isinstance(one, st.Trial)
    assert np.array_equal(one["psi"], other["psi"])
    assert repr(st.read_trial(tmp_path / "a.csv")) == "Trial('a', 50 rows, every 1 s: psi, u)"


@pytest.mark.slow
def test_findings_are_a_table_and_a_sequence() -> None:
    ship = st.load("kvlcc2_l7")
    run = ship.simulate(st.Zigzag(), dt=0.1)
    assert "0 errors" in str(st.check(run))
    wrong = run.having(delta=-run["delta"], delta_cmd=-run["delta_cmd"])
    found = st.check([wrong])
    assert len(found.errors) >= 1
    assert found[0].severity == "error"
    assert "rudder sign" in str(found)
    assert found.to_frame()["severity"][0] == "error"
    assert str(found).splitlines()[0].startswith("1 trials: 1 errors")
