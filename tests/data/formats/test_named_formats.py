"""A format is found by its name; only its own module is loaded for that."""

from __future__ import annotations

import sys

import pytest

from seatrial.data import DataError, formats


def test_every_format_is_found_by_its_name_as_among_all() -> None:
    every = formats.formats()
    assert len(every) > 10
    for name, one in every.items():
        assert formats._format(name) == one


def test_the_others_are_not_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    real = formats._of_module
    monkeypatch.setattr(formats, "_of_module", lambda name: asked.append(name) or real(name))
    assert formats.reader("frt-esso") is not None
    assert asked == ["seatrial.data.formats.frt_esso"]
    assert "seatrial.data.formats.frt_esso" in sys.modules


@pytest.mark.parametrize("name", ["frt_esso", "nmae", "__init__", ""])
def test_a_name_that_is_none_is_refused_with_those_near(name: str) -> None:
    with pytest.raises(DataError, match="format"):
        formats.reader(name)
