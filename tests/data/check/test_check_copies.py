"""The same recording twice in a folder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check import check_folder


def copies(*trials: Trial) -> list[tuple[str, ...]]:
    return [one.trials for one in check_folder(trials) if one.key == "overlap"]


def wandering(name: str, seed: int) -> Trial:
    t = np.arange(0.0, 200.0)
    random = np.random.default_rng(seed)
    psi = 0.3 * np.sin(t / 15.0) + 0.002 * random.standard_normal(t.size)
    return Trial(name, t, {"psi": psi, "u": 3.0 + 0.02 * random.standard_normal(t.size)}, meta={"L_pp": 60.0})


@pytest.mark.slow
def test_a_copy_is_told_whatever_its_clock_and_name_and_parts_below_half_are_not() -> None:
    one, other = wandering("one", 1), wandering("other", 2)
    assert copies(one, other) == []
    late = replace(one, name="copy", t=one.t + 3600.0)
    assert copies(one, other, late) == [("copy",)]
    assert copies(one, replace(late.rows(slice(120, None)), name="part")) == [("part",)]
    mixed = {n: np.concatenate([v[:101], other[n][101:]]) for n, v in one.channels.items()}
    assert copies(one, Trial("most", one.t, mixed, meta=one.meta)) == [("most",)]
    mixed = {n: np.concatenate([v[:99], other[n][99:]]) for n, v in one.channels.items()}
    assert copies(one, Trial("less", one.t, mixed, meta=one.meta)) == []
