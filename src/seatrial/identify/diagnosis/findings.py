"""What the residuals of a fit say about it: values that an estimator attaches to its fit (`diagnosis.diagnose`)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from ...core.values import dataclass, field, replace
from .blame.contradiction import Contradiction
from .blame.gain import CERTAIN, Gain
from .blame.witness import Witness
from .channels import Channel, Residuals, plain
from .priors import Pull

# A suspect is listed as a cause from this drop of the objective on, in squared sigma, and if it moves a parameter by
# this many sigma or removes this share of the objective.
SIGNIFICANT, MOVES, REMOVES = 25.0, 1.0, 0.05
# A suspect leads where it accounts for this share of what the residuals exceed the noise by; so many are listed.
_ACCOUNTS, _LISTED = 0.2, 5
# Of an error by trial, the extremes are named among those known this well, relative to the median sigma.
_KNOWN = 3.0
# The first line on a result names a fixed number that would move it by more than so many sigma.
_TAKEN = 3.0
# A reading that does not act, or acts the other way, shows as a share of the reading of 1 or 2, within this.
_WHOLE = 0.1
# A reversed wind (twice its reading too much) shows as at least this scale error in the first step towards it.
_TURNED = 0.5
# One control of several, and the share from which on an error of all explains what that of one does.
_OF_ALL, _SAME = re.compile(r"_\d+$"), 0.95
# How the names of suspects begin that are no errors of instruments.
_SURROUNDINGS = ("current.", "wind.")
# Noise of measured states pulls a parameter where predictions move it by more than this, in sigma.
_PULLED = 2.0


LACKING = "the model does not explain the data"
"""The finding on a fit whose residuals contradict the model."""
_MISSING = (
    "look for a term of the model, or an input, that is missing: the residuals show in which trials and at which "
    "angles they arise"
)
_FREE = 'free it: "{}" = {{ prior = 0.3 }} in [free] of the study'


@dataclass(frozen=True)
class Cause:
    """What would explain the data.

    Attributes:
        label: "suspect" of an instrument or a prior, "or the ship" of a number that is held; empty of trials that
            contradict.
        text: the finding in one line.
        share: of the objective that it would remove.
        remedy: what to do about it.
        alone: the one trial that contradicts all others.
        sure: whether it is more than a share: logs have it too.
    """

    label: str
    text: str
    share: float
    remedy: str
    alone: bool = False
    sure: bool = False

    @property
    def line(self) -> str:
        """Label and finding."""
        return f"{self.label}: {self.text}" if self.label else self.text


@dataclass(frozen=True)
class Suspicion:
    """Score test (Lagrange multiplier) of one error of the instruments that the problem does not estimate.

    Attributes:
        name, words, unit, per: as in `suspects.Suspect`.
        drop: expected decrease of the objective in squared sigma (chi square, one degree of freedom).
        share: of the objective that it would remove.
        size, sigma: estimate in one Gauss-Newton step, SI units.
        moves: change of each free parameter, in its sigma, if it were estimated.
        of_reading: as in `suspects.Suspect`.
        whole: whether it is there or not, without a size, and cannot be estimated (`alternatives`).
        most: as in `suspects.Suspect`.
        log: what the logs say of it without a model; None where nothing but the model shows it.
        gain: what it explains beyond noise.
    """

    name: str
    words: str
    unit: str
    per: float
    drop: float
    share: float
    size: float
    sigma: float
    moves: Mapping[str, float]
    of_reading: bool = False
    whole: bool = False
    most: float = math.inf
    log: Witness | None = None
    gain: Gain = CERTAIN

    @property
    def of_truth(self) -> tuple[float, float]:
        """Size and sigma, as shares of the true value where it is a scale; SI units."""
        if self.of_reading and self.size < 0.9:
            return self.size / (1.0 - self.size), self.sigma / (1.0 - self.size) ** 2
        return self.size, self.sigma

    @property
    def value(self) -> str:
        """Error of the instrument with its sigma and unit, as a share of the true value where it is a scale."""
        size, sigma = self.of_truth
        return "whole" if self.whole else f"{size / self.per:.3g} +- {plain(sigma / self.per, 1)} {self.unit}"

    @property
    def instead(self) -> str:
        """What a control is whose readings do not act, or act the other way: no error that has a size."""
        of = self.name.partition(".")[2]
        if not self.of_reading or not self.name.startswith("scale.") or self.turned:
            return ""
        if abs(self.size - 1.0) < _WHOLE:
            return f"{of} that does not act as logged (stuck, or the column of another)"
        return f"{of} that acts the other way (its sign)" if abs(self.size - 2.0) < _WHOLE else ""

    @property
    def possible(self) -> bool:
        """Whether instruments have errors as large, or it is one without a size."""
        size, sigma = self.of_truth
        return self.whole or self.turned or bool(self.instead) or abs(size) - 2.0 * sigma <= self.most

    @property
    def sized(self) -> str:
        """What it is, with its size where it has one."""
        return self.instead or (self.words if self.whole else f"{self.words} of {self.value}")

    @property
    def turned(self) -> bool:
        """Whether a wind acts so little as logged that it may act the other way: its direction may be reversed."""
        return self.name == "scale.wind" and self.size > _TURNED

    @property
    def remedy(self) -> str:
        """Lines of a study that let the fit estimate it; both components of a vector."""
        if self.whole or self.instead:
            return "change it in the mapping file of the log, and import again"
        kind, _, way = self.name.partition(".")
        names = (f"{kind}.north", f"{kind}.east") if way in ("north", "east") else (self.name,)
        freed = ", ".join(f'"{name}" = inf' for name in names)
        return f"correct the log, or estimate the error: common = {{ {freed} }} in [nuisance] of the study"

    @property
    def matters(self) -> bool:
        """Whether it is significant and has an effect on the result."""
        most = max((abs(v) for v in self.moves.values()), default=0.0)
        return self.drop > SIGNIFICANT and (most > MOVES or self.share > REMOVES)

    @property
    def denied(self) -> bool:
        """Whether other instruments contradict it."""
        return self.log is not None and self.log.denies(self.size)

    @property
    def credible(self) -> bool:
        """Whether the instrument is at fault, and not the model: the logs show it, or it explains most of the misfit.

        A wind or a current is no instrument, and what is there as a whole or not at all explains most anyway.
        """
        if self.whole or self.turned or self.name.startswith(_SURROUNDINGS):
            return True
        return not self.denied and (self.gain.credible or self.witnessed)

    @property
    def witnessed(self) -> bool:
        """Whether the logs show it, or have it as the model has."""
        return self.log is not None and (self.log.shown or self.log.confirms(self.size))

    @property
    def excused(self) -> str:
        """Why the instrument is not blamed for what it would explain."""
        if self.log is not None and self.denied:
            allowed = f"{self.log.size / self.per:.2g} +- {plain(self.log.sigma / self.per, 1)} {self.unit}"
            return f"{self.sized} is not it: the other instruments allow {allowed}"
        return f"{self.sized} is hardly it: in other trials than those it is estimated in it explains " + (
            f"{max(self.gain.share, 0.0):.0%} of what exceeds the noise")

    @property
    def text(self) -> str:
        """The finding in one line."""
        most = max(self.moves, key=lambda path: abs(self.moves[path]), default="")
        moved = f"; {most} would move by {self.moves[most]:+.1f} sigma" if most else ""
        other = "; or its direction is where it blows to: add 180 deg to gamma_T" if self.turned else ""
        return (f"{self.sized} would remove {self.share:.0%} of the objective"
                f"{moved}{other}")  # fmt: skip


@dataclass(frozen=True)
class Differing:
    """An error of an instrument that one trial has alone, or that differs from trial to trial (`by_trial`).

    Attributes:
        words: what it is.
        each: estimate by trial: of the one that has it, or of all.
        drop: expected decrease of the objective in squared sigma (chi square, `numbers` degrees of freedom).
        share, moves: as in `Suspicion`.
    """

    words: str
    each: Mapping[str, Suspicion]
    drop: float
    share: float
    moves: Mapping[str, float]

    @property
    def numbers(self) -> int:
        """How many numbers it takes."""
        return len(self.each)

    @property
    def remedy(self) -> str:
        """What to do about it."""
        trial = next(iter(self.each))
        return f"correct the log of {trial}, or {_without(trial)}" if self.numbers == 1 else (
            "correct the logs trial by trial")

    @property
    def name(self) -> str:
        """Of the suspect."""
        return next(iter(self.each.values())).name

    @property
    def text(self) -> str:
        """The finding in one line."""
        spread = sorted(one.sigma for one in self.each.values())
        known = [trial for trial, one in self.each.items() if one.sigma <= _KNOWN * spread[len(spread) // 2]]
        by_size = sorted(known, key=lambda trial: self.each[trial].size)
        low, high = by_size[0], by_size[-1]
        most = max(self.moves, key=lambda path: abs(self.moves[path]), default="")
        moved = f"; {most} would move by {self.moves[most]:+.1f} sigma" if most else ""
        what = f"of {self.each[low].value} in trial {low} alone" if self.numbers == 1 else (
            f"that differs from trial to trial, {self.each[low].value} in {low} to {self.each[high].value} in {high},"
        )  # fmt: skip
        return f"{self.words} {what} would remove {self.share:.0%} of the objective{moved}"


@dataclass(frozen=True)
class Diagnosis:
    """Whether the model explains the data, and what else would.

    Attributes:
        channels: residuals by compared channel.
        suspicions: tests of the errors of instruments, the most likely first.
        rejected: readings left out as outliers, by trial and channel.
        errors: errors of instruments that were estimated, as suspicions whose drop is that of leaving each out.
        residuals: by trial, for drawings.
        control: name and unit of the control that stands beside them: the first angle, else the first control.
        widened: factor of each sigma over that of white noise, or over what `Loss.correlation` states, by path.
        fixed: for fixed parameters of the model, the change of the free parameter that it moves most if it were
            larger by its error, in sigma: (path, free path, change); the strongest first.
        shares: error of each fixed parameter relative to its value: its sigma where the ship file states one, else .1.
        carried: for each free parameter the root sum of squares of what the fixed ones with a stated sigma move it by,
            in its sigma; empty where none is stated.
        by_trial: standard deviations of the currents and biases of `Fit.nuisances`, by trial and name, as far as the
            residuals are white.
        contradictions: trials against the others, the one that stands out most first.
        differing: errors of instruments that are not the same in all trials, the most likely first.
        terms: tests of the parameters that are held, as relative errors, the most likely first.
        pulls: tests of the priors, the one that the data contradict most first.
        pulled: how far long predictions would move each parameter of a fit that takes measured states as exact, in the
            sigma of that fit; empty for others.
        form: share of the variance between trials that neither noise nor so few trials explain: what the form lacks.
    """

    channels: Mapping[str, Channel] = field(default_factory=dict[str, Channel])
    suspicions: tuple[Suspicion, ...] = ()
    rejected: Mapping[str, Mapping[str, int]] = field(default_factory=dict[str, Mapping[str, int]])
    errors: tuple[Suspicion, ...] = ()
    residuals: Mapping[str, Residuals] = field(default_factory=dict[str, Residuals], repr=False)
    control: tuple[str, str] = ("", "")
    widened: Mapping[str, float] = field(default_factory=dict[str, float])
    fixed: tuple[tuple[str, str, float], ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict[str, float])
    carried: Mapping[str, float] = field(default_factory=dict[str, float])
    by_trial: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    contradictions: tuple[Contradiction, ...] = ()
    differing: tuple[Differing, ...] = ()
    terms: tuple[Suspicion, ...] = ()
    pulls: tuple[Pull, ...] = ()
    pulled: Mapping[str, float] = field(default_factory=dict[str, float])
    form: float = 0.0

    @property
    def causes(self) -> tuple[Suspicion, ...]:
        """Suspects that matter, that instruments can have and that are credible, the most likely first.

        Where only the sum of several rudders or shafts acts, twice the error of one of two explains what both have
        alike: that of all is the cause.
        """
        found = [one for one in self.suspicions if one.matters and one.possible and one.credible]
        share = {one.name: one.share for one in found}
        return tuple(one for one in found if not share.get(_OF_ALL.sub("", one.name), 0.0) > _SAME * one.share
                     or not _OF_ALL.search(one.name))  # fmt: skip

    @property
    def doubted(self) -> tuple[Suspicion, ...]:
        """Errors that would explain a part, while the model or the logs say that the instruments are right."""
        return tuple(one for one in self.suspicions if one.matters and one.possible and not one.credible)

    @property
    def lacking(self) -> bool:
        """Whether the model does not explain the data."""
        told = any(one.matters for one in (*self.suspicions, *self.terms))
        told = told or bool(self.differing or self.apart or self._biased)
        return told or any(one.grounds(name) for name, one in self.channels.items())

    @property
    def _biased(self) -> str:
        """The parameter that the noise of measured states has pulled most; empty where that is within sigma."""
        most = max(self.pulled, key=lambda path: abs(self.pulled[path]), default="")
        return most if most and abs(self.pulled[most]) > _PULLED else ""

    @property
    def apart(self) -> tuple[Contradiction, ...]:
        """Trials that contradict the others, if the result depends on it; the one where the others agree without it."""
        if not any(one.matters for one in self.contradictions):
            return ()
        found = self.contradictions[:1] if self.contradictions[0].alone else ()
        return found or tuple(one for one in self.contradictions if one.odd) or self.contradictions

    def numbers(self) -> dict[str, object]:
        """The same for fit.json, SI units."""
        return {
            "explained": not self.lacking, "lines": self.lines,
            "cause": self._leading, "remedies": self.remedies,
            "channels": {name: {"noise": c.noise, "size": c.size, "correlation": c.alike, "samples": c.count}
                         for name, c in self.channels.items()},
            "suspects": [{"name": s.name, "size": s.size, "sigma": s.sigma, "drop": s.drop, "share": s.share,
                          "matters": s.matters, "moves": dict(s.moves)} for s in self.suspicions],
            "priors": [{"name": p.path, "wanted": p.wanted, "prior": p.prior, "sigma": p.sigma, "deviates": p.deviates,
                        "share": p.share, "matters": p.matters} for p in self.pulls],
            "contradictions": [{"trial": c.trial, "chi_square": c.chi, "freedom": c.freedom, "removes": c.removes,
                                "matters": c.matters, "moves": dict(c.moves)} for c in self.contradictions],
            "estimated": {s.name: {"size": s.size, "sigma": s.sigma} for s in self.errors},
            "outliers": {trial: dict(found) for trial, found in self.rejected.items()},
            "widened": dict(self.widened), "form": self.form,
            "fixed": [{"parameter": path, "error": self.shares.get(path, 0.1), "moves": free, "sigmas": moved}
                      for path, free, moved in self.fixed],
            "carried": dict(self.carried), "pulled": dict(self.pulled),
            "sigma_by_trial": {trial: dict(found) for trial, found in self.by_trial.items()},
        }  # fmt: skip

    @property
    def cause(self) -> Cause | None:
        """What explains a good part of what the noise does not; every report of the fit names this one first."""
        return next(iter(self._named[0]), None)

    @property
    def others(self) -> tuple[Cause, ...]:
        """What else would explain some of it, the most likely first."""
        good, weak = self._named
        return (*good[1:], *weak)

    @property
    def grounds(self) -> tuple[str, ...]:
        """What contradicts the model, one line each."""
        found = [line for name, one in self.channels.items() for line in one.grounds(name)]
        found += [f"what acts like {one.words} is larger than any of an instrument: a unit, a column or the model is "
                  "wrong" for one in self.suspicions if one.matters and not one.possible][:1]  # fmt: skip
        found += [one.excused for one in self.doubted[:1] if not self.causes]
        if biased := self._biased:
            found.insert(0, f"noise of the measured states pulls this fit: long predictions would move {biased} by "
                            f"{self.pulled[biased]:+.1f} sigma; fit with shooting:Trajectory")  # fmt: skip
        return tuple(found)

    @property
    def _leading(self) -> str | None:
        """The cause; what contradicts the model where nothing explains a good part of it."""
        first = (self.cause,) if self.cause else ()
        named = (*(one.text for one in first), *self.grounds, *(one.text for one in self.others))
        return next(iter(named), None) if self.lacking else None

    @property
    def remedies(self) -> tuple[str, ...]:
        """What to do next, the first thing first; empty where the model explains the data."""
        if not self.lacking:
            return ()
        told = [one.remedy for one in self._named[0] if one.remedy][:1]
        return (*told,) or (_MISSING,)

    @property
    def lines(self) -> tuple[str, ...]:
        """The finding and its grounds, one line each."""
        out = [f"{name}: outliers left out: {', '.join(f'{count} of {channel}' for channel, count in n.items())}"
               for name, n in self.rejected.items()]  # fmt: skip
        out += [f"estimated: {one.words} of {one.value}" for one in self.errors]
        if not self.lacking:
            pulled = (one.text for one in self.pulls[:1] if one.matters)
            return ("the residuals look like sensor noise", *self._taken(), *pulled, *out)
        good, weak = self._named
        early = [one for one in good if one.alone or one.label]
        return (
            f"{LACKING}: sigma and verdicts hold only if the model were right",
            *(one.line for one in early), *(f"remedy of the first: {one.remedy}" for one in early[:1]),
            *(one.line for one in good if one not in early), *self.grounds, *(one.line for one in weak),
            *(() if early else (f"remedy: {one}" for one in self.remedies[:1])), *out,
        )  # fmt: skip

    def _taken(self) -> tuple[str, ...]:
        """The number held fixed on which the result depends most; lengths and masses of the body are known."""
        doubted = [row for row in self.fixed if not row[0].startswith("body.") and abs(row[2]) > _TAKEN]
        if not doubted:
            return ()
        path, free, moved = doubted[0]
        return (f"sigma takes the fixed numbers as right: {path} larger by {self.shares.get(path, 0.1):.0%} would move "
                f"{free} by {moved:+.1f} sigma",)  # fmt: skip

    @property
    def _named(self) -> tuple[list[Cause], list[Cause]]:
        """What explains a good part of what the noise does not, and what explains less; the likeliest first."""
        own = {one.name: one for one in self.differing
               if all(each.possible and each.credible for each in one.each.values())}  # fmt: skip
        listed = [(one.share / (2.0 if one.numbers > 1 else 1.0), _suspect(one)) for one in own.values()]
        listed += [(one.share, _suspect(one)) for one in self.causes if one.name not in own]
        # A model has more numbers than its instruments have errors; so one of them has to explain more.
        held = [(one.share / 1.5, replace(_suspect(one), label="or the ship", remedy=_FREE.format(one.name)))
                for one in [one for one in self.terms if one.matters and one.possible][:2]]  # fmt: skip
        pulled = [(one.share, _suspect(one)) for one in self.pulls[:2] if one.matters]
        likely = [*sorted(listed, key=_likely, reverse=True)[:_LISTED], *held]
        # An estimate that is off by a few of its sigma is likelier than any instrument.
        before = any(one.first for one in self.pulls[:2])
        listed = sorted(likely if before else [*likely, *pulled], key=_likely, reverse=True)
        listed = [*sorted(pulled, key=_likely, reverse=True), *listed] if before else listed
        square = sum(c.count * c.size**2 for c in self.channels.values())
        excess = 1.0 - sum(c.count for c in self.channels.values()) / max(square, 1e-300)
        good = [one for share, one in listed if one.sure or share > max(_ACCOUNTS * excess, 0.0)]
        weak, odd = [one for _, one in listed if one not in good], self.apart
        if odd and odd[0].alone:
            return [Cause("", odd[0].text, 1.0, _without(odd[0].trial), alone=True), *good], weak
        said = odd[0].text if len(odd) == 1 else (
            f"trials contradict each other, the first of them most: {', '.join(one.trial for one in odd)}"
        )  # fmt: skip
        # Where all differ none is at fault: no trial is left out for a form that suits none.
        return [*good, *([Cause("", said, 1.0, "")] if odd else [])], weak


def _without(trial: str) -> str:
    """The line of a study that leaves a trial out."""
    return f'leave it out: exclude = ["{trial}"] in [data] of the study'


def _suspect(one: Suspicion | Differing | Pull) -> Cause:
    return Cause("suspect", one.text, one.share, one.remedy, sure=isinstance(one, Suspicion) and one.witnessed)


def _likely(one: tuple[float, Cause]) -> tuple[float, str]:
    """Its share, and of equal ones its line."""
    return one[0], one[1].line
