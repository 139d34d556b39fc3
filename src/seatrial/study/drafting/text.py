"""The text of a first study: TOML with a comment on every choice."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

from ...data.kinds import Kind
from ...identify.components.actuation import Shown
from ...identify.trajectory.suspects import level_of

_WINDOW, _SECONDS = 10.0, 10.0
"""Length of a prediction between restarts, in times in which the ship covers its length, and its least [s]."""

_WHY = {"high": "water takes energy, and gives none",
        "low": "at least that of the water displaced, or of the ellipsoid in its box"}  # fmt: skip

OWN = 0.0
"""Stands for the priors that the ship file states."""

Freedom = Sequence[tuple[str, float, tuple[str, ...]]]
"""Patterns, the relative prior of each (NaN: none, `OWN`), and the parameters that each frees."""


def window_of(clock: float, duration: float) -> float:
    """Length of a prediction between restarts [s], of recordings of at least this duration."""
    return min(max(_WINDOW * clock, _SECONDS), 0.8 * duration)


def text_of(
    *, ship: str, family: str, actuators: Sequence[Shown], root: str, format: str, mapping: str,
    files: Mapping[str, str],
    kinds: Mapping[str, Kind], train: Mapping[str, Sequence[str]], test: Mapping[str, Sequence[str]],
    left_out: Mapping[str, str], free: Freedom, limits: Mapping[str, Mapping[str, float]], sampled: bool, timed: bool,
    clock: float, duration: float, windy: bool, sigma: Mapping[str, float], common: Mapping[str, float],
    assumed: Sequence[str], wind: Sequence[str] = (),
) -> str:  # fmt: skip
    """The study as a file.

    Args:
        ship: as the study names it; `family` is the class of its model.
        actuators: what the recordings show of them that the ship file has otherwise.
        root, format, mapping: of the recordings, the last two empty where there are none.
        files: place of each recording below the root.
        kinds: of the recordings.
        train, test: recordings by kind.
        left_out: recordings with the reason.
        free: what is free.
        limits: what physics leaves of some of that, as keys of [free] by path.
        sampled: whether the model is one in discrete time.
        timed: whether it is known when the recordings were made.
        clock: L/U [s].
        duration: of the shortest recording [s].
        windy: whether a force of wind is fed by a wind on record.
        sigma: scales of the errors, where they are not the noise of the sensors.
        common: standard deviations of a current [m/s] and of errors of instruments that all share, and of levels.
        assumed: controls that recordings lack.
        wind: the table of a force of wind that the ship file lacks.
    """
    order = "the latest" if timed else "from the middle of the names, as no times are known"
    lines = [
        f"# A first study of {ship} ({family}), written by `seatrial study new`; every line may be changed.",
        f"# Next: seatrial identify THIS -o RUN, then read RUN/report.html. L/U is {clock:.3g} s here.",
        'schema = "seatrial-study/1"', f"ship = {_quoted(ship)}", "", "[data]", f"root = {_quoted(root)}",
        *([f"format = {_quoted(format)}"] if format else []), *([f"mapping = {_quoted(mapping)}"] if mapping else []),
        *[f"assumed = {json.dumps(list(assumed))} # not on record: by order, else by the first speed"][:len(assumed)],
        *_list("train", "kinds are those of `seatrial trials`", train, kinds, files),
        *_list("test", f"whole recordings of each kind, {order}; the fit does not see them", test, kinds, files),
        *_left_out(left_out, files), "", *_actuators(actuators), *wind, *_freedom(free, limits, windy), "",
    ]  # fmt: skip
    if sampled:
        return "\n".join((*lines, "[estimator]", 'type = "arx_fit:ArxRegression"', ""))
    window = window_of(clock, duration)
    lines += [
        "[loss]", *_scales(sigma), "", *_nuisance(common),
        "[estimator]", 'type = "shooting:Trajectory" # least squares on whole predictions',
        f"window = {_round(window)} # s, {window / clock:.2g} L/U: then a prediction restarts", "", "[report]",
        f"restart = {_round(window)}", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _list(
    key: str, about: str, some: Mapping[str, Sequence[str]], kinds: Mapping[str, Kind], files: Mapping[str, str]
) -> list[str]:
    """A list of recordings, each with what it was recognised as."""
    out = [f"{key} = [ # {about}"]
    for names in some.values():
        for name in names:
            doubt = f"; doubt: {kinds[name].doubts[0]}" if kinds[name].doubts else ""
            out.append(f"  {_pattern(files[name])}, # {kinds[name].label}{doubt}")
    return [*out, "]"]


def _left_out(left_out: Mapping[str, str], files: Mapping[str, str]) -> list[str]:
    """Comments on what is in neither list."""
    return [f"# left out: {files[name]}: {why}" for name, why in left_out.items()]


def _actuators(some: Sequence[Shown]) -> list[str]:
    """Tables of actuators, laid over those of the ship file."""
    out: list[str] = []
    for name in dict.fromkeys(one.table for one in some):
        out.append(f"[{name}] # as these recordings show it, over what the ship file has")
        out += [f"{one.entry} # {one.words}" for one in some if one.table == name]
        out.append("")
    return out


def _freedom(free: Freedom, limits: Mapping[str, Mapping[str, float]], windy: bool) -> list[str]:
    """What is free, with the prior of each, and of those that physics limits their bound."""
    own = any(prior == OWN for _, prior, _ in free)
    about = "the sigma that the ship file states" if own else "relative"
    out = [f"[free] # a Gaussian prior about each value, {about}; what was measured with a rule stays fixed"]
    for pattern, prior, paths in free:
        told = ["sigma = 10.0"] if math.isnan(prior) else [f"prior = {prior:g}"] if prior != OWN else []
        rest = [path for path in paths if path not in limits]
        one = len(rest) == 1 == len(paths)
        if rest:
            count = "" if one else f" # {len(rest)} parameters"
            out.append(f"{_quoted(rest[0] if one else pattern)} = {_entry(told)}{count}")
        for path in paths:
            for key, value in limits.get(path, {}).items():
                bound = _entry([*told, f"{key} = {value:.6g}"])
                out.append(f"{_quoted(path)} = {bound} # {_WHY[key]}")
    return out if windy else [*out, "# no wind acts in these trials, or none is recorded: its coefficients stay fixed"]


def _entry(keys: Sequence[str]) -> str:
    """A table on one line."""
    return f"{{ {', '.join(keys)} }}" if keys else "{}"


def _scales(sigma: Mapping[str, float]) -> list[str]:
    """By what errors are divided."""
    if not sigma:
        return ['scale = "noise" # errors are divided by the noise of each sensor, as its log shows it']
    told = ", ".join(f"{name} = {value:.2g}" for name, value in sigma.items())
    return ["# a channel is smoother than any sensor reads: errors are divided by the noise of each and 0.5 % of its "
            "motion", f"sigma = {{ {told} }}"]  # fmt: skip


def _nuisance(common: Mapping[str, float]) -> list[str]:
    """What else is estimated."""
    if not common:
        return []
    told = ", ".join(f"{_quoted(name)} = {_round(sigma)}" for name, sigma in common.items())
    current, deviates = (any(name.startswith(kind) for name in common) for kind in ("current.", "deviation."))
    assumed = any(level_of(name)[0] for name in common)
    compass = ("deviation.", "bias.psi") if deviates else ()
    rest = [name for name in common if not name.startswith(("current.", *compass)) and not level_of(name)[0]]
    what = ["a current"] * current + ["the errors of the compass, which the sway under way shows"] * deviates
    what += ["what the logs show of their instruments"] * bool(rest)
    shared = [f"{' and '.join(what)}, alike in all trials"] * bool(what)
    return [f"[nuisance] # {', '.join([*shared, *['the level of what is assumed in each trial'] * assumed])}, "
            "and each initial state are estimated", f"common = {{ {told} }} # SI units and shares, about zero", "",
            ]  # fmt: skip


def _pattern(place: str) -> str:
    """A file by its name without suffix, which no other pattern takes for another; brackets stand for themselves."""
    return _quoted("".join(f"[{c}]" if c in "*?[" else c for c in place))


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _round(value: float) -> str:
    """Two figures, as a number with a point."""
    if value <= 0:
        return "0.0"
    digits = 1 - math.floor(math.log10(value))
    return f"{round(value, digits):.{max(digits, 1)}f}"
