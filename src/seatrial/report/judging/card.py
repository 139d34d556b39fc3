"""The card of a fitted model on one page to sign: where it holds, how well, for what use, and how to repeat it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...belief.bands.calibration import Errors, hardest
from ...belief.bands.held import GROUPS, Held
from ...core.values import asdict, dataclass, field
from ...identify import Fit
from ...models.rolling import GRAVITY
from ...study.grounds import Grounds, Ranges
from ...study.store import Summary
from ...validate.fitness import FIT, NOT_FIT, Fitness
from ..blocks import (
    Blanks,
    Body,
    Group,
    bullets,
    entries,
    fields,
    figure,
    gallery,
    heading,
    joined,
    lead,
    line,
    note,
    number,
    soft,
    table,
    tiles,
)
from ..page import Page, Section
from .fans import SHARE, held_table, narrow, share
from .fitness import REMARK, definitions, sized
from .fitness import numbers as fitness_numbers
from .tested import CAPTION, channel, picture, span

_DEGREES = math.degrees(1.0)
_CLAIMED = 0.95
_BANDS = (
    f"{SHARE} Bands of 95 % are drawn from the posterior of the parameters with the noise "
    "of the instruments at the start and at the reading. Errors of the form of the model, of weather and controls are "
    "in these bands only as far as trials left out of the fit in turn have widened it (seatrial calibrate): where "
    "they hold less often than 95 %, take the errors, not the bands."
)
_AROUND = ("U_T", "H_S", "depth")
# How recordings were dealt into parts, where it is not by what differs between them.
_BY = {"recording": "by turns"}
_NOT_CALIBRATED = (
    "No calibration is beside the model: seatrial calibrate MODEL makes one from fits that leave trials out in turn. "
    "Without it the bands above are those of the fit, widened by nothing that left-out trials would show."
)


@dataclass(frozen=True)
class Calibrated:
    """What is known of the bands of a model that has a calibration beside it.

    Attributes:
        recordings: that fits left out to calibrate it; `kinds` of theirs.
        reach: longest time from a start for which bands hold [s].
        unseen: coverage and widths on the unseen trials of the card.
        left_out: the same on the recordings of the calibration, each judged by the others; empty where too few.
        doubts: where the bands say less, a line each.
        errors: standardised ones of left-out trials, by the way of leaving them out.
    """

    recordings: int
    kinds: tuple[str, ...]
    reach: float
    unseen: tuple[Held, ...]
    left_out: tuple[Held, ...]
    doubts: tuple[str, ...]
    errors: Mapping[str, Errors] = field(default_factory=dict[str, Errors])


@dataclass(frozen=True)
class Card:
    """What is known of a fitted model.

    Attributes:
        fit, summary: the saved fit, and its fit.json.
        restart: length of the windows in which predictions are judged [s].
        rows: errors and coverage by kind and horizon; empty where no unseen trial is at hand.
        pooled: standardised error by label.
        uses: verdicts by purpose.
        unjudged: why other purposes have none, by their titles.
        missing: what could not be judged, one line each.
        unseen: name, kind and length [s] of the trials that judged it.
        banded: whether its fit has a covariance.
        widened: whether trials left out of the fit have widened its posterior.
        calibrated: its bands by left-out trials; None where no calibration is beside the model.
        repeat, versions: commands and digests; programs.
        changes: what the unseen trials were corrected by before they were predicted, a line each.
    """

    fit: Fit
    summary: Summary
    restart: float
    rows: tuple[Held, ...]
    pooled: Mapping[str, float]
    uses: tuple[Fitness, ...]
    unjudged: Mapping[str, str]
    missing: tuple[str, ...]
    unseen: tuple[tuple[str, str, float], ...]
    banded: bool
    widened: bool
    calibrated: Calibrated | None
    repeat: Mapping[str, str]
    versions: Mapping[str, str]
    changes: tuple[str, ...] = ()

    @property
    def grounds(self) -> Grounds:
        """Trials of the fit and what they cover; empty for a fit of before they were kept."""
        return self.summary.grounds


def page(card: Card) -> Page:
    """The whole page: what is signed first, then what it stands on."""
    about = {"schema": "seatrial-card/1", "ship": card.fit.ship.name, "study": card.summary.study,
             "digest": card.fit.digest, "missing": list(card.missing), "changes": list(card.changes),
             "explained": _explained(card)}  # fmt: skip
    sections = (
        Section("", fields(about, _head(card))),
        Section("Where it is valid", fields({
            "covered": dict(card.grounds.covered), "kinds": card.grounds.kinds}, _validity(card))),
        Section("Error and coverage on unseen trials", fields({
            "rows": list(map(_row_numbers, card.rows)), "standardised": dict(card.pooled), "restart": card.restart,
            "unseen": [one[0] for one in card.unseen]}, _errors(card))),
        Section("Bands that hold", fields({"bands": _bands_document(card)}, _calibrated(card))),
        Section("Fit for which purpose", fields({
            "fitness": {use.purpose: fitness_numbers(use) for use in card.uses},
            "not_judged": dict(card.unjudged)}, _purposes(card))),
        Section("It must not be used", fields({"must_not": list(forbidden(card))}, bullets(forbidden(card)))),
        Section("Signature", _signature(card)),
        Section("How to repeat it", fields({
            "repeat": dict(card.repeat), "versions": dict(card.versions)},
            entries({**card.repeat, **card.versions})), sheet=True),
        Section("Trials", fields({"trials": card.grounds.trials}, _trials(card))),
        Section("Parameters", fields({
            "parameters": card.summary.parameters, "verdicts": card.summary.verdicts}, _parameters(card))),
    )  # fmt: skip
    return Page(f"Model card: {card.fit.ship.name}", sections)


def _explained(card: Card) -> bool | None:
    return None if card.summary.diagnosis is None else card.summary.explained


def _head(card: Card) -> Body:
    ship, used = card.fit.ship, [one for one in card.grounds.trials if one.role == "fit"]
    names = card.summary.provenance.get("trained_on", ())
    kinds = Counter(one.kind for one in used)
    counted = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common()) or "kinds not recorded"
    words = (f"{ship.name}, {number(ship.L_pp)} m, study {card.summary.study}: {len(card.fit.free)} parameters "
             f"fitted to {len(names)} trials ({counted}); judged on {len(card.unseen)} unseen trials.")  # fmt: skip
    warned = [*card.missing]
    if _explained(card) is False:
        bands = "" if card.widened else ", and its bands what that tells of its form"
        warned.insert(0, "The model does not explain the trials of its fit: its sigmas count what these trials "
                      f"disagree by{bands}.")  # fmt: skip
    best = [row for row in card.rows if row.horizon == card.rows[-1].horizon][-1:]
    shown = [(f"{number(row.distance, 2)} m", f"position error (rms) {row.horizon:.4g} s after a start")
             for row in best]  # fmt: skip
    shown += [(f"{number(_DEGREES * row.error['psi'], 2)}°", "heading error (rms)") for row in best]
    inside = card.calibrated.unseen if card.calibrated else ()
    shown += [(share(inside[-1] if inside else row, "position"), "of positions within bands of 95 %") for row in best]
    if card.calibrated and card.calibrated.errors:
        way = hardest(card.calibrated.errors)
        quoted = card.calibrated.errors[way]
        shown.append((f"{number(quoted.mean, 2)} ± {number(quoted.spread, 2)}",
                      f"standardised error of trials left out {_BY.get(way, f'by {way}')}, ± over parts"))  # fmt: skip
    return lead(words) + note("", warned) + (tiles(shown) if shown else ())


def _validity(card: Card) -> Body:
    if not card.grounds.covered:
        return soft("This fit did not keep the ranges of its trials (an older version): fit it again.")
    rows = [*_shares(card), *(_range(name, ends) for name, ends in card.grounds.covered.items())]
    refused = "" if card.widened else ", and seatrial simulate --bands refuses it"
    words = ("Lowest and highest value in the trials of the fit, without a thousandth of outliers at either end. "
             "Beyond them, and for other kinds of manoeuvre, the model extrapolates: no error is known there"
             f"{refused}.")  # fmt: skip
    kinds = ", ".join(card.grounds.kinds)
    half = -(-len(rows) // 2)
    halves = joined(table(("", "from", "to", "unit"), some, words=(3,)) for some in (rows[:half], rows[half:]))
    drawn = picture(card.grounds)
    together = gallery(figure(drawn, CAPTION)) if drawn else ()
    return (Group(halves, None), *together, *soft(f"Kinds of manoeuvre: {kinds}. {words}"))


def _shares(card: Card) -> Iterator[list[str]]:
    """Froude number of the surge speed, and depth over draught where both are known."""
    covered, ship = card.grounds.covered, card.fit.ship
    if "u" in covered:
        ends = [number(end / math.sqrt(GRAVITY * ship.L_pp)) for end in covered["u"]]
        yield ["Froude number u/√(g L)", *ends, "-"]
    draught, depth = float(ship.model.draught), covered.get("depth", (math.inf, math.inf))
    if draught > 0.0 and not math.isinf(depth[0]):
        yield ["depth over draught", *("deep" if math.isinf(end) else number(end / draught) for end in depth), "-"]


def _range(name: str, ends: tuple[float, float]) -> list[str]:
    words, unit, factor = channel(name)
    if name in _AROUND and not any(map(_felt, ends)):  # a log without it is taken as of none
        return [words, "none", "on record", ""]
    low, high = ("deep" if math.isinf(end) else number(factor * end) for end in ends)
    return [words, low, high, unit]


def _felt(end: float) -> bool:
    return end != 0.0 and not math.isinf(end)


def _errors(card: Card) -> Body:
    tail = "" if card.banded else "The fit has no covariance, so there are no bands. "
    if not card.rows:
        return soft(f"{tail}No unseen trial has been judged: the error of this model is not known.")
    head = ("kind", "ahead [s]", "trials", "windows", "position [m]", "heading [°]", "u [m/s]", "v_m [m/s]", "r [°/s]",
            "held: position", "heading", "speeds")  # fmt: skip
    pooled = ", ".join(f"{label} {number(value)}" for label, value in card.pooled.items())
    words = (f"Root mean square errors at the end of windows that start in the measured state. {_BANDS} Standardised "
             f"error (Wakita 2022 Eq. 25), restarted every {card.restart:g} s: {pooled}.")  # fmt: skip
    rows = [_row(one) for one in card.rows]
    held = table((*head[:4], *head[9:]), [(*row[:4], *row[9:]) for row in rows])  # beside the errors it is cut off
    return table(head[:9], [row[:9] for row in rows]) + held + bullets(card.changes) + soft(words)


def _calibrated(card: Card) -> Body:
    found = card.calibrated
    if found is None:
        return soft(_NOT_CALIBRATED)
    words = (f"Bands of 95 %, calibrated on {found.recordings} recordings that fits left out in turn; kinds: "
             f"{', '.join(found.kinds)}. They hold up to {found.reach:.4g} s from a start.")  # fmt: skip
    return joined((
        soft(words), _by_way(found.errors), bullets(found.doubts),
        heading("On the unseen trials"), held_table(found.unseen) if found.unseen
        else soft("No unseen trial is at hand, or none that bands could be made for."),
        heading("On the recordings of the calibration, each judged by the others"), held_table(found.left_out)
        if found.left_out else soft("Too few recordings: without one of them the others cannot show 95 %."),
        soft(f"{SHARE} ±: mean half width."),
    ))  # fmt: skip


def _by_way(errors: Mapping[str, Errors]) -> Body:
    """Errors of left-out trials by each way of leaving them out, the hardest first: that one is to be quoted."""
    if not errors:
        return ()
    ordered = sorted(errors.items(), key=lambda one: one[1].mean, reverse=True)
    rows = [[_BY.get(way, f"by {way}"), str(len(one.parts)), number(one.mean, 3), number(one.spread, 2),
             number(max(one.parts), 3)] for way, one in ordered]  # fmt: skip
    return table(("left out", "parts", "standardised error", "± over parts", "worst part"), rows)


def _bands_document(card: Card) -> dict[str, Any] | None:
    found = card.calibrated
    if found is None:
        return None
    errors = {way: one.numbers() for way, one in found.errors.items()}
    return {"level": _CLAIMED, "recordings": found.recordings, "kinds": list(found.kinds), "reach": found.reach,
            "unseen": [asdict(row) for row in found.unseen], "left_out": [asdict(row) for row in found.left_out],
            "errors": errors, "doubts": list(found.doubts)}  # fmt: skip


def _sizes(row: Held) -> dict[str, float]:
    """Root mean square errors, SI units and radians."""
    speeds = {name: row.error[name] for name in GROUPS["speeds"]}
    return {"position": row.distance, "heading": row.error["psi"], **speeds}


def _row_numbers(row: Held) -> dict[str, object]:
    return {"kind": row.kind, "horizon": row.horizon, "windows": row.windows, "trials": row.trials,
            "error": _sizes(row), "held": row.inside, "held_between": row.between}  # fmt: skip


def _row(row: Held) -> list[str]:
    turned = {name: _DEGREES if name in ("heading", "r") else 1.0 for name in _sizes(row)}
    return [row.kind, f"{row.horizon:.4g}", str(row.trials), str(row.windows),
            *(number(turned[name] * size, 2) for name, size in _sizes(row).items()),
            *(share(row, name) for name in row.inside)]  # fmt: skip


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if math.isfinite(share) else "–"


def _purposes(card: Card) -> Body:
    rows = [(use.title, use.verdict, "; ".join(_limits(use))) for use in card.uses]
    rows += [(title, "not judged", why) for title, why in card.unjudged.items()]
    defined = joined(heading(f"Figures of {use.title}") + bullets(definitions(use)) for use in card.uses)
    return table(("purpose", "verdict", "why"), rows, words=(1, 2), wide=True) + (
        soft(REMARK) + defined if card.uses else ())


def _limits(use: Fitness) -> Iterator[str]:
    for one in use.found:
        yield f"{one.limit.key}: {one.verdict} ({'; '.join(filter(None, (sized(one), one.reason)))})"


def forbidden(card: Card) -> tuple[str, ...]:
    """What the model must not be used for, a line each."""
    apart = ("with speeds, rates of turn and controls that were not tested together (drawn above)",)
    return *_by_purpose(card), *_by_range(card.grounds.covered), *apart[: len(card.grounds.tested)], *_by_evidence(card)


def _by_purpose(card: Card) -> Iterator[str]:
    for use in card.uses:
        if use.verdict == NOT_FIT:
            yield f"for {use.title}: errors are greater than that use accepts"
        elif use.verdict != FIT:
            yield f"for {use.title} without more trials: they cannot tell"
    for title in card.unjudged:
        yield f"for {title}: it has not been judged for that"


def _by_range(covered: Ranges) -> Iterator[str]:
    if not covered:
        yield "where its trials did not go: the ranges were not kept"
        return
    u, wind, waves, depth = (covered.get(name, (math.nan, math.nan)) for name in ("u", "U_T", "H_S", "depth"))
    yield "astern or stopped" if u[0] > 0.05 * u[1] else f"outside of {span('u', u)}"
    for name, (low, high) in covered.items():
        if name.startswith("n_P") and low > 0.0:
            yield "with the propeller stopped or reversed"
        if name == "r" and low * high > 0.0:
            yield f"for turns to {'port' if low > 0.0 else 'starboard'}"
        if name.startswith("delta"):
            yield f"with rudder angles beyond {number(_DEGREES * low)} to {number(_DEGREES * high)}°"
    none = "no trial of the fit had any on record"
    yield f"in wind: {none}" if wind[1] == 0.0 else f"in wind above {number(wind[1])} m/s"
    yield f"in waves: {none}" if waves[1] == 0.0 else f"in waves above {number(waves[1])} m"
    yield "in shallow water" if math.isinf(depth[0]) else f"in water of other depth than {span('depth', depth)}"


def _by_evidence(card: Card) -> Iterator[str]:
    if not card.rows:
        yield "where an error must be known: no unseen trial has been judged"
    rows = pooled(card.rows) if card.calibrated is None else pooled(card.calibrated.unseen)
    failed = [(row, name) for row in rows if (name := narrow(row, _CLAIMED))]
    if failed:
        row, name = min(failed, key=lambda one: one[0].inside[one[1]])
        yield (f"with its bands as a margin: where 95 % are claimed, {share(row, name)} of {row.windows} windows held "
               f"({name}, {row.horizon:.4g} s ahead)")  # fmt: skip
    own = [v for v in card.fit.verdicts if v.subject in card.fit.vector.paths]
    weak = [v for v in own if v.status not in ("identified", "graded")]
    if weak:
        yield (f"to read its numbers as physics: {len(weak)} of {len(own)} parameters are not, or weakly, identified")
    elif _explained(card) is False:
        yield "to read its numbers as physics: the residuals contradict the model"


def pooled(rows: Sequence[Held]) -> tuple[Held, ...]:
    """The lines of all kinds together."""
    return tuple(row for row in rows if row.kind == rows[-1].kind)


def _signature(card: Card) -> Body:
    words = (f"I have seen the ranges, errors and limits above, and accept this model (fit {card.fit.digest}, model "
             f"{card.repeat['digest of the model']}) for the use below, within those ranges.")  # fmt: skip
    return (*line(words), Blanks(("use",)), Blanks(("name", "organisation", "place and date", "signature")))


def _trials(card: Card) -> Body:
    held = card.grounds.trials
    rows = [(one.name, one.kind, one.role, f"{one.duration:.0f}", str(one.rows), one.digest) for one in held]
    known = {one.name for one in held}
    rows += [(name, kind, "given to the card", f"{length:.0f}", "–", "–")
             for name, kind, length in card.unseen if name not in known]  # fmt: skip
    if not rows:
        names: Sequence[str] = card.summary.provenance.get("trained_on", ())
        return bullets(names) + soft("Their digests were not kept (an older version).")
    head = ("trial", "kind", "role", "length [s]", "samples", "digest")
    return table(head, rows, words=(1, 2, 5)) + soft("Digest: of times and channels as the fit took them.")


def _parameters(card: Card) -> Body:
    status = {v.subject: v.status for v in card.fit.verdicts}
    fit = card.fit
    rows = [(one.path, number(one.start, 4), number(float(fit.values[k]), 4), number(float(fit.sigma[k]), 2),
             _percent(float(fit.shrinkage[k])), status.get(one.path, "–"))
            for k, one in enumerate(fit.free)]  # fmt: skip
    paths = {one.path for one in fit.free}
    more = bullets(f"{v.subject}: {v.text}" for v in fit.verdicts if v.subject not in paths)
    head = ("parameter", "start", "fitted", "sigma", "from the data", "verdict")
    return (table(head, rows, words=(5,)) if rows else soft("A network: it has weights, no parameters.")) + more
