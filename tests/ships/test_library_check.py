"""Every ship of the library is as the check for contributed ships wants it, its published indices included."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.ships.files import library, load, save, variants
from seatrial.ships.scaling import scale
from seatrial.workflow.contributing.published import published
from seatrial.workflow.contributing.ship_check import check_ship_file

ALL = library()
KINDS = ("published", "unverified")


@pytest.mark.parametrize("name", ALL)
def test_a_ship_names_published_indices_or_says_why_not(name: str) -> None:
    ship = load(name)
    read, why = published(ship), str(ship.notes.get("unverified", ""))
    assert read or why
    assert not why or not read or all(one.by != "code" for one in read)  # what figures of trials do not reach
    assert all(len(one.source) > 20 for one in read)
    assert ship.notes["references"]
    assert "u" in ship.validity


@pytest.mark.long
@pytest.mark.parametrize("name", ALL)
def test_a_ship_passes_the_whole_check(name: str) -> None:
    checked = check_ship_file(name)
    assert [f"{one.what}: {one.detail}" for one in checked.findings if one.state == "error"] == []
    assert all(one.kept for one in checked.reproduced)


@pytest.mark.parametrize("name", variants())
def test_a_ship_that_is_like_another_does_not_claim_its_indices(name: str) -> None:
    assert not set(KINDS) & set(load(name).notes)


@pytest.mark.parametrize("note", KINDS)
def test_neither_a_copy_nor_another_scale_claims_the_indices_of_the_ship(note: str, tmp_path: Path) -> None:
    ship = load("kvlcc2_l7")
    marked = replace(ship, notes={**ship.notes, note: ship.notes["published"]})
    assert note not in load(save(marked, tmp_path / "mine.toml")).notes
    assert note not in scale(marked, 14.0).ship.notes
    text = f'schema = "seatrial-ship/1"\nlike = "mine.toml"\n[notes]\n{note} = []\n'
    (tmp_path / "like.toml").write_text(text, encoding="utf-8")
    assert load(tmp_path / "like.toml").notes[note] == []  # its own note is its own
