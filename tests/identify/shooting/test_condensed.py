"""Normal equations of several trials, condensed, against those of all unknowns solved whole."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.identify.shooting.condensed import Condensed


def linear(seed: int, trials: int, shared: int, own: int) -> Any:
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((trials, 3 * (shared + own), shared + own))
    e = rng.standard_normal((trials, J.shape[1]))
    H = np.diag(rng.uniform(0.5, 2.0, shared))
    return SimpleNamespace(N=J.transpose(0, 2, 1) @ J, g=np.einsum("tij,ti->tj", J, e), H_p=H,
                           g_p=rng.standard_normal(shared))  # fmt: skip


@pytest.mark.parametrize("damping", [0.0, 0.3, 5.0])
@pytest.mark.parametrize("own", [4, 0])
def test_the_damped_quadratic_of_all_unknowns_has_its_minimum_there(damping: float, own: int) -> None:
    """Unknowns of each trial stand in blocks; each diagonal is damped by its own size (Marquardt 1963)."""
    trials, n = 3, 2
    one = linear(1, trials, n, own)
    m = n + trials * own
    whole, g = np.zeros((m, m)), np.zeros(m)
    whole[:n, :n], g[:n] = one.H_p, one.g_p
    for k in range(trials):
        at = np.r_[:n, n + k * own : n + (k + 1) * own]
        whole[np.ix_(at, at)] += one.N[k]
        g[at] += one.g[k]
    whole += damping * np.diag(np.diag(whole))
    right = -np.linalg.solve(whole, g)
    H, slope, back = Condensed.reduced(None, one, damping)  # type: ignore[arg-type]
    step = -np.linalg.solve(H, slope)
    assert step == pytest.approx(right[:n], rel=1e-9)
    assert back.shape == (trials, own, n + 1)
    others = -(back[:, :, :n] @ step) - back[:, :, n]
    assert others.ravel() == pytest.approx(right[n:], rel=1e-9)
