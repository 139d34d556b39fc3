"""`seatrial ships --check`: a ship that is fit for the library passes, and each way of not being so is found."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.ships.files import load
from seatrial.workflow import RequestError
from seatrial.workflow.contributing.published import Published, Reproduced, published, reproduce
from seatrial.workflow.contributing.ship_check import check_ship_file

# Advance and first overshoot of the independent reference tracks, see tests/golden/kvlcc2.toml.
HEAD = '''schema = "seatrial-ship/1"
like = "kvlcc2_l7"
'''
OVERSHOOT = '''
[[notes.published]]
by = "code"
manoeuvre = "zigzag"
rudder = 10.0
heading = 10.0
index = "first_overshoot"
value = {value}
unit = "deg"
within = 0.05
source = "reference simulation"
'''

LOPSIDED = '''
from dataclasses import dataclass
from seatrial.forces import Force
from seatrial.forces.hull import Polynomial

@dataclass(frozen=True, kw_only=True)
class Hull(Polynomial):
    """A hull with a constant side force."""

    def force(self, flow):
        return super().force(flow) + Force(0.0, 5.0, 0.0)
'''


def ship(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


def errors(path: Path) -> dict[str, str]:
    return {one.what: one.detail for one in check_ship_file(path).findings if one.state == "error"}


@pytest.mark.slow
def test_a_ship_that_gives_its_published_index_passes_and_has_a_page(tmp_path: Path, capsys) -> None:
    path, out = ship(tmp_path, OVERSHOOT.format(value=4.977)), tmp_path / "evidence.html"
    assert main(["ships", "--check", str(path), "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fit"] is True
    numbers = json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))
    (row,) = numbers["published"]
    assert row["kept"]
    assert row["ratio"] == pytest.approx(1.0, abs=0.02)
    assert "1 of 1 published indices reproduced" in out.read_text(encoding="utf-8")


@pytest.mark.slow
def test_an_index_that_the_model_does_not_give_is_an_error(tmp_path: Path, capsys) -> None:
    path = ship(tmp_path, OVERSHOOT.format(value=6.0))
    assert "6 deg" in errors(path)["code, first overshoot"]
    assert main(["ships", "--check", str(path)]) == 1
    capsys.readouterr()


@pytest.mark.slow
def test_a_ship_without_a_published_index_says_why(tmp_path: Path) -> None:
    assert list(errors(ship(tmp_path, ""))) == ["published indices"]
    assert not errors(ship(tmp_path, '[notes]\nunverified = "the paper prints no index"\n'))


@pytest.mark.slow
def test_numbers_without_a_source_or_a_reason_are_named(tmp_path: Path) -> None:
    text = '[hull]\nY_v = { prime = -0.315, source = "assumed" }\n[notes]\nunverified = "x"\n'
    assert "hull.Y_v" in errors(ship(tmp_path, text))["reasons"]


@pytest.mark.slow
def test_a_key_that_no_reference_explains_is_named(tmp_path: Path) -> None:
    text = '[hull]\nY_v = {{ prime = -0.315, source = "clarke1983 Tab. 1" }}\n[notes]\nunverified = "x"\n{}\n'
    assert "clarke1983" in errors(ship(tmp_path, text.format("")))["keys"]
    for reference in ("clarke1983: RINA Transactions 125", "Clarke, D. et al. (1983). RINA Transactions 125"):
        assert not errors(ship(tmp_path, text.format(f'references = ["Yasukawa 2015", "{reference}"]')))


@pytest.mark.slow
def test_what_is_assumed_in_part_is_counted_as_assumed(tmp_path: Path) -> None:
    text = '[hull]\nY_v = {{ prime = -0.315, source = "{}" }}\n[notes]\nunverified = "x"\n'

    def count(source: str) -> str:
        found = check_ship_file(ship(tmp_path, text.format(source))).findings
        return next(one.detail for one in found if one.what == "sources")

    assert count("half of yasukawa2015; assumed: a fuller stern") == count("assumed: a fuller stern than theirs")
    assert count("half of yasukawa2015") != count("assumed: a fuller stern than theirs")


@pytest.mark.slow
def test_a_ship_that_breaks_the_contract_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    """A hull that pushes at rest and to one side only."""
    (tmp_path / "lopsided.py").write_text(LOPSIDED, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    text = '[hull]\ntype = "lopsided:Hull"\n[notes]\nunverified = "x"\n'
    assert main(["ships", "--check", str(ship(tmp_path, text)), "--json", "--trust", "lopsided"]) == 1
    found = json.loads(capsys.readouterr().out)["findings"]
    wrong = {one["check"] for one in found if one["state"] == "error"}
    assert {"conformance, silent at rest", "conformance, mirrored"} <= wrong


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('index = "first_overshoot"', 'index = "frist_overshoot"'), ('unit = "deg"', 'unit = "grad"'),
        ("within = 0.05", "within = 5.0"), ("rudder = 10.0", "ruder = 10.0"), ('source = "reference simulation"', ""),
        ('manoeuvre = "zigzag"', 'manoeuvre = "zigzack"'), ("within = 0.05", "within = 0.05\nover_L = 1.0"),
    ],
)  # fmt: skip
def test_an_entry_that_cannot_be_used_is_one_line(tmp_path: Path, wrong: str, said: str) -> None:
    path = ship(tmp_path, OVERSHOOT.format(value=5.0).replace(wrong, said))
    found = load(path)
    with pytest.raises(RequestError) as error:
        reproduce(found, published(found))
    assert "\n" not in str(error.value)
    assert "first_overshoot" in str(error.value) or "published" in str(error.value) or "zigzag" in str(error.value)


def test_entries_of_one_run_share_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import seatrial.workflow.simulation as module

    counted: list[str] = []
    real = module.simulate

    def counting(*args, **options):
        counted.append(args[1])
        return real(*args, **options)

    monkeypatch.setattr(module, "simulate", counting)
    two = OVERSHOOT.format(value=5.0) + OVERSHOOT.format(value=13.6).replace("first_", "second_")
    found = load(ship(tmp_path, two))
    assert all(one.kept for one in reproduce(found, published(found)))
    assert counted == ["zigzag"]


def test_a_value_at_its_tolerance_is_kept_and_one_beyond_is_not() -> None:
    told = Published("trial", "turning", {}, "advance", -4.0, True, "m", 0.25, "a source")
    kept = [Reproduced(told, value).kept for value in (-3.0, -5.0, -2.99, -5.01, 4.0, math.nan)]
    assert kept == [True, True, False, False, False, False]
    assert Reproduced(told, -3.0).ratio == 0.75
