"""Every force module of the library, in each of its published forms, keeps the contract of `seatrial.forces`."""

from __future__ import annotations

import pytest

from seatrial.testing import FORCE_CHECKS, force_modules, untried_forces

MODULES = force_modules()


def test_every_force_class_and_every_published_form_is_tried() -> None:
    untried = untried_forces()
    assert not untried, f"give an instance of each in the `EXAMPLES` of its module: {untried}"


@pytest.mark.slow
@pytest.mark.parametrize("check", list(FORCE_CHECKS))
@pytest.mark.parametrize("name", list(MODULES))
def test_force(name: str, check: str) -> None:
    FORCE_CHECKS[check](MODULES[name])
