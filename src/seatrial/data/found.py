"""What a recording holds of what a fit wants: from where, how often, for how much of the time; and what it does not.

An import that reads half a log says so here and in the sidecar: a heading that no sentence told is missing, whatever
else came in.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from . import Trial
from .prepare import derived

QUANTITIES: Mapping[str, re.Pattern[str]] = MappingProxyType({
    name: re.compile(pattern) for name, pattern in (
        ("position", "[xy]"), ("heading", "psi"), ("rate of turn", "r"), ("speed over ground", "u|v_m|U_G|gamma_G"),
        ("speed through water", "u_w|v_w"), ("rudder or azimuth", r"(delta|alpha)(_\w+)?"),
        ("revolutions or thrust", r"(n|n_P|f|T|throttle|pitch)(_\w+)?"), ("wind", "U_[AT]|gamma_[AT]"),
        ("depth", "depth"),
    )
})  # fmt: skip
"""Quantities with the channels that hold them."""

_GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "position": ("track", "position"), "speed over ground": ("log over ground", "velocity over ground"),
    "speed through water": ("log through the water",),
    "rudder or azimuth": ("rudder", "rudder order"), "wind": ("apparent wind", "true wind", "wind over ground"),
})  # fmt: skip
"""Names under which a reader has the source of a quantity, where they are others."""


def told(trial: Trial) -> Trial:
    """The trial with what it holds in its description: `sources` by quantity, and `missing`."""
    readers: Mapping[str, str] = trial.meta.get("sources") or {}
    made = derived(trial)
    sources: dict[str, str] = {}
    for quantity, pattern in QUANTITIES.items():
        names = [name for name, values in trial.channels.items()
                 if pattern.fullmatch(name) and np.isfinite(values).any()]  # fmt: skip
        if not names:
            continue
        groups = _GROUPS.get(quantity, (quantity,))
        by = next((readers[one] for one in groups if one in readers), "")
        if not by and quantity == "revolutions or thrust":
            by = next((said for one, said in readers.items() if one.startswith("rpm_")), "")
        by = by or _often(trial, names)
        own = [name for name in names if name in made]
        by += f"; {', '.join(own)} made from {made[own[0]]}, no measurement" if own and "no measure" not in by else ""
        sources[quantity] = f"{', '.join(names)}: {by}"
    missing = [quantity for quantity in QUANTITIES if quantity not in sources]
    return replace(trial, meta={**trial.meta, "sources": sources, "missing": missing})


def _often(trial: Trial, names: list[str]) -> str:
    """Rate and share of the rows that hold the rarest of some channels."""
    share = min(float(np.isfinite(trial[name]).mean()) for name in names)
    rate = share / trial.dt if trial.dt > 0.0 else 0.0
    return f"{rate:.3g} Hz, {100.0 * share:.0f} % of the rows"
