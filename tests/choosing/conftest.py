"""The survey of all families, made once."""

from __future__ import annotations

import pytest

from seatrial.choosing.survey import Assessment, survey


@pytest.fixture(scope="session")
def surveyed() -> tuple[Assessment, ...]:
    """Every family with what it represents, without the time that a step takes."""
    return survey(costs=False)
