"""Figures of a page: what anybody may have called a ship or a trial is drawn as it is written."""

from __future__ import annotations

import pytest

from seatrial.report.figures import canvas, svg


@pytest.mark.parametrize("name", [r"$\frac{1}{$", "$a_b$", "100 $", r"\$ and $x$"])
@pytest.mark.slow
def test_a_title_is_no_formula(name: str) -> None:
    figure, (ax,) = canvas(1)
    ax.plot([0.0, 1.0], [1.0, 100.0], label=name)
    ax.set_yscale("log")
    ax.set(title=name, xlabel=name)
    ax.set_xticks([0.0, 1.0], [name, "b"])
    ax.legend()
    page = svg(figure, "salt")
    assert page.count(f">{name}<") >= 4
