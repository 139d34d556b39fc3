"""Colours of the pages: every text on every background it may stand on has the contrast of WCAG 2.1 AA."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import pytest

import seatrial.realtime

CSS = next(Path(seatrial.realtime.__file__).parent.rglob("base.css")).read_text(encoding="utf-8")
TEXTS = ("ink", "muted", "actual", "ordered", "ghost", "other", "port", "starboard")
GROUNDS = ("page", "card", "press", "warn")
CHARTED = ("water", "shoal", "land")
NAMES = ("bright", "day", "dusk", "night")
AA, GRAPHIC = 4.5, 3.0


def palette(name: str) -> dict[str, str]:
    """Colours by name of one palette, of the block that its theme selects."""
    block = next(body for selector, body in re.findall(r"(:root[^{]*)\{([^}]*)\}", CSS) if f'"{name}"' in selector)
    return dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6});", block))


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.1)."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_the_contrast_of_known_pairs() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)  # the known grey that just fails


@pytest.mark.parametrize("name", NAMES)
def test_every_text_can_be_read_on_every_background(name: str) -> None:
    colours = palette(name)
    poor = {(text, ground): round(found, 2) for text, ground in product(TEXTS, GROUNDS)
            if (found := contrast(colours[text], colours[ground])) < AA}  # fmt: skip
    assert not poor


@pytest.mark.parametrize("name", NAMES)
def test_text_on_a_filled_button_and_names_on_the_chart_can_be_read(name: str) -> None:
    colours = palette(name)
    assert contrast(colours["on"], colours["actual"]) >= AA
    poor = {(text, ground): round(found, 2) for text, ground in product(("ink", "muted", "ordered", "other"), CHARTED)
            if (found := contrast(colours[text], colours[ground])) < AA}  # fmt: skip
    assert not poor
    assert all(contrast(colours["actual"], colours[ground]) >= GRAPHIC for ground in CHARTED)


def test_palettes_grow_darker_from_bright_to_night() -> None:
    lights = [luminance(palette(name)["page"]) for name in NAMES]
    assert lights == sorted(lights, reverse=True)
    # no ground of the night page gives more light than a hundredth of white
    assert max(luminance(palette("night")[ground]) for ground in (*GROUNDS, *CHARTED)) < 0.011
