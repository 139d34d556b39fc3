"""Section of a fit's page on its residuals: whether the model explains the data, why not, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from ..data import Array
from ..identify import Fit
from ..identify.diagnosis.channels import Channel, Residuals
from ..identify.diagnosis.findings import LACKING, Diagnosis
from ..models import unit
from . import figures
from .blocks import Body, Verdict, bullets, figure, heading, number, soft, table
from .canvas.frame import Frame, label, whole

_LAGS = 20
# Causes that the first lines of a page name beside the likeliest.
_NAMED = 2
# Points of one panel: more are a blot on the screen and bytes in the file.
_POINTS = 700
_LISTED = 8
_GROUPS = 12
# Width and height of the four panels of a channel, and of its title.
_WIDTHS, _HEIGHT, _TITLE = (390, 190, 190, 270), 118, 16
# White noise stays within; least half range of an axis.
_CALM, _LEAST = 2.0, 4.0
_DEGREES = math.degrees(1.0)


def verdict(fit: Fit) -> Body:
    """Whether the result can be trusted, why, and what to do next: the first lines of a page; empty if not tested."""
    found = fit.diagnosis
    if found is None:
        return ()
    if not found.lacking:
        return _sound(fit, found)
    wide = max(found.widened.values(), default=1.0)
    trust = "No parameter counts as identified"
    trust += f", and sigma is up to {number(wide, 2)} times what noise alone leaves open" if wide > 1.1 else ""
    first, others = found.cause, [one.line for one in found.others[:_NAMED]]
    why = [_grounds(found), f"The likeliest cause: {first.text}." if first else "", *map(_sentence, others)]
    return (Verdict(_sentence(LACKING), grounds=(
        ("Trust", f"{trust}. Its predictions are as good as the errors on trials that the fit has not seen, no "
                  "better."),
        ("Why", " ".join(filter(None, why)).replace("+-", "±")),
        ("Next", " ".join(map(_sentence, found.remedies))),
    )),)  # fmt: skip


def _sentence(line: str) -> str:
    return f"{line[0].upper()}{line[1:]}."


def _sound(fit: Fit, found: Diagnosis) -> Body:
    known = sum(v.status == "identified" for v in fit.verdicts if v.subject in fit.vector.paths)
    own = fit.vector.paths
    loose = [v.subject for v in fit.verdicts if v.status != "identified" and v.subject in own]
    pairs = [v.subject for v in fit.verdicts if v.subject not in own]
    ahead = "Validate it on trials that the fit has not seen."
    if pairs:
        ahead = f"Only a combination is determined of: {'; '.join(pairs[:3])}{'; ...' * (len(pairs) > 3)}. {ahead}"
    if loose:
        more = f" and {len(loose) - 3} more" if len(loose) > 3 else ""
        ahead = (f"Do not read as physics: {', '.join(loose[:3])}{more}; their verdicts name trials that would help. "
                 f"{ahead}")  # fmt: skip
    size = max((one.size for one in found.channels.values()), default=math.nan)
    return (Verdict("The model explains the data: what it leaves looks like sensor noise.", grounds=(
        ("Trust", f"{known} of {len(fit.free)} parameters are identified, with the sigma that is stated, within the "
                  "speeds and rudder angles of the trials."),
        ("Why", f"Residuals are at most {number(size, 2)} times the sensor noise and not correlated, and no error of "
                "an instrument that was tested would change the result."),
        ("Next", ahead),
    )),)  # fmt: skip


def _grounds(found: Diagnosis) -> str:
    """What contradicts the model, in one sentence."""
    largest = max(found.channels, key=lambda name: found.channels[name].size, default="")
    if not largest:
        return ""
    alike = max(found.channels, key=lambda name: found.channels[name].alike)
    words = f"Residuals are up to {number(found.channels[largest].size, 2)} times the sensor noise (of {largest})"
    if any("alike" in line for line in found.channels[alike].grounds(alike)):
        words += f" and correlated ({number(found.channels[alike].alike, 2)} from one to the next of {alike})"
    return f"{words}."


def section(fit: Fit) -> Body:
    """Residuals, suspects and outliers of a fit; empty where it was not tested."""
    found = fit.diagnosis
    if found is None:
        return ()
    drawn: Body = ()
    if found.residuals:
        caption = "Residuals over the noise of each sensor. Shaded: two sigma of white noise; points beyond an axis " \
                  "stand on its edge. Right: the line is the mean of a twelfth of the samples each."  # fmt: skip
        drawn = figure(drawing(found), caption, least=720)
    said = [f"{name}: outliers left out: {', '.join(f'{count} of {channel}' for channel, count in own.items())}"
            for name, own in found.rejected.items()]  # fmt: skip
    said += [f"estimated: {one.words} of {one.value}".replace("+-", "±") for one in found.errors]
    first = (bullets(said) if said else ()) + _channels(found) + _by_trial(found)
    return first + drawn + _suspects(found) + _fixed(found)


def _channels(found: Diagnosis) -> Body:
    # alike is an excess over what was estimated, which can lie below -1, where no correlation lies
    rows = [[name, _noise(name, c.noise), number(c.size, 3), number(max(c.alike, -1.0), 2), str(c.count),
             _against(name, c)] for name, c in found.channels.items()]  # fmt: skip
    head = ["channel", "sensor noise", "residual over noise", "correlation of neighbours", "samples", "contradicts"]
    return table(head, rows, words=(5,)) + soft(
        "White residuals of a right model have the size 1 and no correlation. What the noise of the inputs causes is "
        "taken off: below zero that could cause more than is seen.")


def _against(name: str, channel: Channel) -> str:
    grounds = channel.grounds(name)
    size, alike = any("times" in line for line in grounds), any("alike" in line for line in grounds)
    return ", ".join(word for word, yes in (("size", size), ("correlation", alike)) if yes)


def _noise(name: str, noise: float) -> str:
    angle = unit(name).startswith("rad")
    value = number(_DEGREES * noise if angle else noise, 2)
    return f"{value}{unit(name).replace('rad', '°')}" if angle else f"{value} {unit(name)}"


def _by_trial(found: Diagnosis) -> Body:
    """Root mean square residual of each trial; the worst only where there are many."""
    if len(found.residuals) < 2:
        return ()
    sizes = {name: [_rms(one.values[channel]) for channel in found.channels] for name, one in found.residuals.items()}
    worst = sorted(sizes, key=lambda name: -_rms(np.array(sizes[name])))[:_LISTED]
    rows = [[name, *(number(size, 2) for size in sizes[name])] for name in worst]
    head = "trial, residual over noise" if len(worst) == len(sizes) else f"the worst {_LISTED} of {len(sizes)} trials"
    return table([head, *found.channels], rows)


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else math.nan


def _suspects(found: Diagnosis) -> Body:
    possible = [one for one in found.suspicions if one.possible]
    if not possible:
        return ()
    rows: list[list[str]] = []
    for s in possible[:_LISTED]:
        most = max(s.moves, key=lambda path: abs(s.moves[path]), default="")
        rows.append([
            ("*" if s.matters and s.credible else "") + s.name, s.words, s.value.replace("+-", "±").replace("-", "−"),
            number(s.drop, 3), f"{number(100.0 * s.share, 2)} %",
            f"{most} {s.moves[most]:+.1f}".replace("-", "−") if most else "–",
        ])  # fmt: skip
    head = ["suspect", "error of an instrument", "estimate", "drop [sigma²]", "share", "moves by [sigma]"]
    remark = ("Score test of what the fit does not estimate: expected drop of the objective in squared sigma, its "
              "share of the objective, and in one Gauss-Newton step the size of the error and the parameter that would "
              "move most. Bold: significant, of consequence, and neither denied by the other instruments nor a small "
              "part of the misfit. Several often stand for one: estimate the first, then look again.")  # fmt: skip
    return heading("Suspects") + table(head, rows, words=(1, 5)) + soft(remark)


def _fixed(found: Diagnosis) -> Body:
    rows = [[path, f"{number(100.0 * found.shares.get(path, 0.1), 2)} %", free, f"{moved:+.1f}".replace("-", "−")]
            for path, free, moved in found.fixed if abs(moved) >= 0.1]  # fmt: skip
    if not rows:
        return ()
    head = ["fixed parameter", "larger by", "would move", "by [sigma]"]
    remark = "An error of one sigma where the ship file states it, else of 10 %."
    most = max(found.carried, key=lambda path: found.carried[path], default="")
    if most and found.carried[most] >= 0.1:
        remark += (f" All fixed parameters with a stated sigma together leave {most} uncertain by a further "
                   f"{number(found.carried[most], 2)} times its sigma: free them, with that prior.")  # fmt: skip
    return heading("What the fixed parameters decide") + table(head, rows, words=(2,)) + soft(remark)


def drawing(found: Diagnosis) -> str:
    """Residuals by channel: trial after trial, their distribution and correlation, and against a control."""
    parts: list[str] = []
    last = len(found.channels) - 1
    for k, (name, channel) in enumerate(found.channels.items()):
        runs = [one.values[name] for one in found.residuals.values()]
        together = np.concatenate(runs)
        known = np.abs(together[np.isfinite(together)])
        reach = _round(float(np.quantile(known, 0.995))) if known.size else _LEAST
        top = k * (_HEIGHT + _TITLE)
        control = np.concatenate([one.control for one in found.residuals.values()])
        panels = (
            _over_time(list(found.residuals.values()), together, reach, k == last),
            _distribution(together, reach, k == last), _correlation(runs, _step(found.residuals.values()), k == last),
            _against_control(control, together, reach, found.control, k == last),
        )  # fmt: skip
        title = f"{name} over its noise of {_noise(name, channel.noise)}"
        parts.append(f'<g transform="translate(0 {top})">{label(34, 12, title, figures.INK, weight=600)}</g>')
        for panel, left in zip(panels, np.cumsum((0, *_WIDTHS[:-1])).tolist(), strict=True):
            parts.append(f'<g transform="translate({left} {top + _TITLE})">{"".join(panel)}</g>')
    return whole(sum(_WIDTHS), (last + 1) * (_HEIGHT + _TITLE) + 16, parts)


def _round(reach: float) -> float:
    """The next round number, so that an axis to both sides of zero has ticks."""
    size = 10.0 ** math.floor(math.log10(max(reach, _LEAST)))
    return next(m * size for m in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0) if m * size >= max(reach, _LEAST))


def _frame(panel: int, x: tuple[float, float], y: tuple[float, float]) -> Frame:
    return Frame(_WIDTHS[panel], _HEIGHT, x, y, left=34, bottom=18)


def _thinned(count: int) -> slice:
    return slice(None, None, max(1, math.ceil(count / _POINTS)))


def _over_time(runs: list[Residuals], values: Array, reach: float, last: bool) -> list[str]:
    """The trials end to end, every other one shaded."""
    ends = np.cumsum([0.0, *(one.t[-1] + _step([one]) if one.t.size else 0.0 for one in runs)])
    t = np.concatenate([one.t + begin for one, begin in zip(runs, ends, strict=False)])
    frame = _frame(0, (0.0, max(float(ends[-1]), 1e-9)), (-reach, reach))
    shade = [frame.span((float(a), float(b)), frame.y, figures.GRID, 0.5)
             for a, b in list(pairwise(ends))[1::2]]  # fmt: skip
    some = _thinned(values.size)
    parts = [*shade, _calm(frame), frame.points(t[some], values[some], figures.BLUE, 1.0)]
    return frame.elements(parts, "time, trials end to end [s]" if last else "", "")


def _distribution(values: Array, reach: float, last: bool) -> list[str]:
    """Histogram and the density of white noise, each over its own peak."""
    frame = _frame(1, (-reach, reach), (0.0, 1.08))
    counts, edges = np.histogram(np.clip(values[np.isfinite(values)], -reach, reach), bins=41, range=(-reach, reach))
    heights = counts / max(int(counts.max()), 1)
    bars = [frame.span((float(a), float(b)), (0.0, float(h)), figures.BLUE, 0.45)
            for a, b, h in zip(edges[:-1], edges[1:], heights, strict=True) if h > 0.0]  # fmt: skip
    at = np.unique(np.concatenate([np.linspace(-min(4.0, reach), min(4.0, reach), 61), [-reach, reach]]))
    parts = [*bars, frame.line(at, np.exp(-0.5 * at**2), figures.INK, width=1.2)]
    return frame.elements(parts, "residual over noise; line: white" if last else "", "", scale=False)


def _step(runs: Iterable[Residuals]) -> float:
    return next((float(one.t[1] - one.t[0]) for one in runs if one.t.size > 1), 1.0)


def _correlation(parts: list[Array], step: float, last: bool) -> list[str]:
    known = [np.nan_to_num(part) for part in parts]
    total, count = sum(float(part @ part) for part in known), max(sum(part.size for part in known), 1)
    alike = [sum(float(part[k:] @ part[:-k]) for part in known if part.size > k) / max(total, 1e-300)
             for k in range(1, _LAGS + 1)]  # fmt: skip
    frame = _frame(2, (0.0, (_LAGS + 0.5) * step), (min(-0.25, *alike), 1.0))
    band = _CALM / math.sqrt(count)
    lines = [frame.line([k * step] * 2, [0.0, value], figures.INK, width=2.0) for k, value in enumerate(alike, start=1)]
    white = frame.span(frame.x, (-band, band), figures.SKY, 0.35)
    zero = frame.line(frame.x, [0.0, 0.0], figures.SOFT)
    return frame.elements([white, zero, *lines], "correlation over the lag [s]" if last else "", "")


def _against_control(
    control: Array, values: Array, reach: float, named: tuple[str, str], last: bool
) -> list[str]:
    """Residuals and their means over groups of the control."""
    name, what = named
    angle = what == "rad"
    x = _DEGREES * control if angle else control
    kept = np.isfinite(x) & np.isfinite(values)
    x, values = x[kept], values[kept]
    low, high = (float(x.min()), float(x.max())) if x.size else (0.0, 0.0)
    if high - low < 1e-9 * max(abs(high), 1.0):
        low, high = low - 1.0, high + 1.0
    margin = 0.04 * (high - low)
    frame = _frame(3, (low - margin, high + margin), (-reach, reach))
    some, order = _thinned(x.size), np.argsort(x, kind="stable")
    groups = [part for part in np.array_split(order, _GROUPS) if part.size]
    means = np.array([[float(x[part].mean()), float(values[part].mean())] for part in groups]).reshape(-1, 2)
    means[:, 1] = np.clip(means[:, 1], -reach, reach)
    parts = [_calm(frame), frame.points(x[some], values[some], figures.BLUE, 1.0),
             frame.line(means[:, 0], means[:, 1], figures.VERMILION, width=1.8)]  # fmt: skip
    sides = ": − port, + starboard" if angle and name.startswith("delta") else ""
    return frame.elements(parts, f"{name} [{'°' if angle else what}]{sides}" if last else "", "")


def _calm(frame: Frame) -> str:
    return frame.span(frame.x, (-_CALM, _CALM), figures.SKY, 0.35) + frame.line(frame.x, [0.0, 0.0], figures.SOFT)


