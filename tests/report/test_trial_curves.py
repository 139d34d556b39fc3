"""Curves of the page of trials: whatever steers and drives a craft is drawn, measured before ordered."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.report.trials import Entry, _curves

T = np.arange(0.0, 5.0, 0.5)


def curves(**channels: float) -> dict[str, dict[str, float]]:
    trial = Trial("a", T, {name: np.full(T.size, value) for name, value in channels.items()})
    entry = Entry.__new__(Entry)
    object.__setattr__(entry, "trial", trial)
    return {label: {name: float(own[0]) for name, own in lines.items()} for label, lines in _curves(entry)}


@pytest.mark.parametrize(("channels", "label", "right"), [
    ({"throttle_port": 0.8, "throttle_starboard": -0.25}, "throttle [%]",
     {"throttle_port": 80.0, "throttle_starboard": -25.0}),
    ({"f_port": 12.0, "f_starboard": 3.0}, "f [N]", {"f_port": 12.0, "f_starboard": 3.0}),
    ({"throttle_cmd": 0.5}, "throttle [%]", {"throttle_cmd": 50.0}),
    ({"steering": -1.0}, "steering [%]", {"steering": -100.0}),
    ({"delta": math.radians(20.0), "delta_cmd": 0.0}, "δ [°]", {"delta": 20.0}),
    ({"n_P_1": 2.0, "n_P_2": 3.0}, "n [1/s]", {"n_P_1": 2.0, "n_P_2": 3.0}),
])  # fmt: skip
def test_a_control_is_drawn_in_its_unit(channels: dict[str, float], label: str, right: dict[str, float]) -> None:
    found = curves(u=1.0, psi=0.0, **channels)
    assert found[label] == pytest.approx(right)
    assert set(found) == {"u [m/s]", "ψ [°]", label}
