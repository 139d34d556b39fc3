"""Whether a manoeuvre stays within the data that a model was trained on.

States, controls and apparent wind are points in a space scaled by the training set's own standard
deviations.  A sample is novel where its k nearest neighbours in training are farther away than they are
for all but one in a hundred of the training samples, each of those judged by the other files only
(a file always covers itself).  So a hundredth of novel samples is what unseen data of the same kind show.

Each state of a steady turn occurs in zigzags and random manoeuvres too, for seconds.  What a force that is a little
wrong does to a track grows with the time for which it acts alike, so means over the recent past are channels as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ..core.values import dataclass
from ..data import Array, DataError, Trial

LEAVES, EDGE = 0.20, 0.05
"""Shares of novel samples above which a manoeuvre leaves the training data, or touches their edge."""

VERDICTS = {"leaves": "leaves the training data", "edge": "touches the edge of the training data",
            "inside": "stays within the training data"}  # fmt: skip
"""Each verdict in words."""

WIND = ("wind ahead", "wind aside")
"""Components of the apparent wind that the ship meets, from ahead and from starboard [m/s]."""

_MOTION, _STEERING = ("u", "v_m", "r"), ("n_P", "delta")
# Between the name of a channel and the seconds of its mean over the past: "r over 66 s".
_OVER = " over "
# The past is the time in which a ship at the rate of turn that one sample in a hundred exceeds turns so far [rad].
_TURNED, _QUICK = 4.0, 0.99
_NEIGHBOURS, _QUANTILE = 5, 0.99
# Neighbouring samples of a log are the same sample again; one a second is enough.
_STEP = 1.0
_BLOCKS = 5
# A channel is named where it makes up this share of the squared distance, or leaves the range in this share of samples.
_TELLING, _OUTSIDE = 0.25, 0.05


@dataclass(frozen=True)
class Reference:
    """The distribution of a training set.

    Attributes:
        channels: what spans the space; see `columns`.
        scale: standard deviation of each channel over the training set, of a mean over the past the geometric mean of
            its own and that of what it is a mean of, SI units, shape (channels,).
        points: training samples over their scale, one a second, shape (points, channels).
        limit: distance to the neighbours that one training sample in a hundred exceeds, unit of the scaled space.
        low, high: range of each channel over every training sample, SI units, shape (channels,).
        own: share of novel samples of each training file, judged by the other files.
    """

    channels: tuple[str, ...]
    scale: Array
    points: Array
    limit: float
    low: Array
    high: Array
    own: Mapping[str, float]

    @cached_property
    def tree(self) -> Any:
        """Search tree of the points."""
        from scipy import spatial

        return spatial.KDTree(self.points)

    def novelty(self, rows: Array) -> Array:
        """Distance to the training neighbours over the limit, shape (rows,), of complete rows of the channels."""
        return _nearest(self, rows / self.scale)[0]

    @staticmethod
    def of(trials: Sequence[Trial], channels: Sequence[str] | None = None) -> Reference:
        """The distribution of some trials.

        Args:
            trials: the training set; with fewer than three files, each is judged in five stretches.
            channels: None takes u, v_m, r, propeller, rudder, wind and the past, as far as every trial has them.

        Raises:
            DataError: no trial, a channel that is missing or never changes, or too few complete samples.
        """
        if not trials:
            raise DataError("coverage: no training trial to compare with")
        names = tuple(remembered(trials, usual(trials)) if channels is None else channels)
        if not names:
            raise DataError("coverage: no channel that all trials share; u, v_m, r, n_P, delta and wind are looked for")
        every = [columns(trial, names) for trial in trials]
        whole = np.concatenate([table[np.isfinite(table).all(axis=1)] for table in every])
        if len(whole) < 2 * _NEIGHBOURS:
            raise DataError(f"coverage: {len(whole)} complete training samples of {', '.join(names)}; more are needed")
        scale = whole.std(axis=0)
        # Few pasts are independent: over their own deviation alone the next one would be novel by chance.
        for k, (channel, over, _) in enumerate(name.partition(_OVER) for name in names):
            if over and channel in names:
                scale[k] = math.sqrt(scale[k] * scale[names.index(channel)])
        # a control that never moved: any movement is then new, on the scale of its own size
        scale = np.where(scale > 0, scale, np.maximum(np.abs(whole[0]), 1e-6))
        thin = [_thin(trial, table) / scale for trial, table in zip(trials, every, strict=True)]
        groups = _groups([t.name for t in trials], thin)
        far = apart([part for _, part in groups])
        limit = float(np.quantile(np.concatenate(far), _QUANTILE))
        own: dict[str, list[float]] = {}
        for (name, _), one in zip(groups, far, strict=True):
            own.setdefault(name, []).extend((one > limit).tolist())
        return Reference(
            names, scale, np.concatenate(thin), max(limit, 1e-12), whole.min(axis=0), whole.max(axis=0),
            {name: float(np.mean(found)) for name, found in own.items()},
        )  # fmt: skip


@dataclass(frozen=True)
class Coverage:
    """How one trial lies within a training set.

    Attributes:
        name: of the trial.
        t: times of the judged samples [s]; rows with gaps are left out.
        novelty: distance to the training neighbours over the limit, above 1 is novel; shape (samples,).
        share: share of novel samples; about .01 is expected of more of the same.
        telling: by channel, its part of the squared distance of the novel samples, adding up to 1.
        outside: by channel, share of samples beyond the range of the training set.
    """

    name: str
    t: Array
    novelty: Array
    share: float
    telling: Mapping[str, float]
    outside: Mapping[str, float]

    @property
    def verdict(self) -> str:
        """"inside", "edge" or "leaves"."""
        return "leaves" if self.share > LEAVES else "edge" if self.share > EDGE else "inside"

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that make the trial novel, the worst first; none where it is inside.

        The past of a channel is not named beside the channel itself.
        """
        if self.verdict == "inside":
            return ()
        blamed = [n for n in self.telling if self.telling[n] > _TELLING or self.outside[n] > _OUTSIDE]
        own = [n for n in blamed if _OVER not in n or n.partition(_OVER)[0] not in blamed]
        worst = max(self.telling, key=lambda n: self.telling[n])
        return tuple(sorted(own or [worst], key=lambda n: -self.telling[n]))

    def __str__(self) -> str:
        where = f", in {', '.join(self.channels)}" if self.channels else ""
        return (f"{self.name}: this manoeuvre {VERDICTS[self.verdict]}{where} "
                f"({100 * self.share:.1f} % of the samples are novel, 1 % is usual)")  # fmt: skip

    def numbers(self) -> dict[str, Any]:
        """The same for a JSON file, without the samples."""
        return {"verdict": self.verdict, "share": self.share, "channels": list(self.channels),
                "telling": dict(self.telling), "outside": dict(self.outside), "novelty": {
                    "median": float(np.median(self.novelty)), "largest": float(self.novelty.max())}}  # fmt: skip


def coverage(reference: Reference, trial: Trial) -> Coverage:
    """How a trial lies within the training set.

    Raises:
        DataError: a channel of the reference is missing, or no row is complete.
    """
    table = columns(trial, reference.channels)
    good = np.isfinite(table).all(axis=1)
    if not good.any():
        raise DataError(f"{trial.name}: no complete row of {', '.join(reference.channels)}")
    rows = table[good]
    novelty, offset = _nearest(reference, rows / reference.scale)
    novel = novelty > 1.0
    worst = offset[novel] if novel.any() else offset
    parts = worst.sum(axis=0) / max(float(worst.sum()), 1e-300)
    beyond = ((rows < reference.low) | (rows > reference.high)).mean(axis=0)
    return Coverage(
        trial.name, trial.t[good], novelty, float(novel.mean()),
        dict(zip(reference.channels, parts.tolist(), strict=True)),
        dict(zip(reference.channels, beyond.tolist(), strict=True)),
    )  # fmt: skip


def usual(trials: Iterable[Trial]) -> tuple[str, ...]:
    """u, v_m, r, propeller, rudder and apparent wind, as far as every trial has them."""
    every = list(trials)
    found = [n for n in (*_MOTION, *_STEERING) if all(n in t or f"{n}_cmd" in t for t in every)]
    windy = all("U_T" in t and "gamma_T" in t and "psi" in t for t in every)
    return (*found, *(WIND if windy else ()))


def remembered(trials: Iterable[Trial], names: Sequence[str]) -> tuple[str, ...]:
    """The channels, and the means over the past of rate of turn, propeller and rudder, as far as these are of them."""
    pools = [np.abs(trial["r"]) for trial in trials if "r" in trial] if "r" in names else []
    rates = np.concatenate([pool[np.isfinite(pool)] for pool in pools]) if pools else np.zeros(0)
    quick = float(np.quantile(rates, _QUICK)) if rates.size else 0.0
    past = [n for n in ("r", *_STEERING) if n in names] if quick > 0.0 else []
    return (*names, *(f"{name}{_OVER}{_TURNED / quick:.3g} s" for name in past))


def told(names: Iterable[str], trial: Trial) -> bool:
    """Whether a trial has what these channels are made of."""
    return {name.partition(_OVER)[0] for name in names} <= set(usual([trial]))


def columns(trial: Trial, channels: Sequence[str]) -> Array:
    """Channels side by side, shape (samples, channels); an order stands in for a control that was not logged.

    A mean over the past is exponential and begins at none, so that little past says little.

    The apparent wind is made of the true wind and the ship's own velocity, so that a prediction has one too.

    Raises:
        DataError: a channel is missing.
    """
    wind: dict[str, Array] = {}
    if set(WIND) & set(channels):
        bearing = trial["gamma_T"] - trial["psi"]
        apparent = trial["U_T"] * np.cos(bearing) + trial["u"], trial["U_T"] * np.sin(bearing) + trial["v_m"]
        wind = dict(zip(WIND, apparent, strict=True))
    found: list[Array] = []
    for name, over, span in (channel.partition(_OVER) for channel in channels):
        logged = name if name in trial or f"{name}_cmd" not in trial else f"{name}_cmd"
        own = wind[name] if name in wind else trial[logged]
        found.append(_recent(own, trial.dt, float(span.removesuffix(" s"))) if over and len(trial) > 1 else own)
    return np.column_stack(found)


def _recent(x: Array, dt: float, span: float) -> Array:
    """Exponential mean of the readings so far, gaps bridged by straight lines; NaN without any."""
    from scipy.signal import lfilter

    known, kept = np.flatnonzero(np.isfinite(x)), math.exp(-dt / span)
    if not known.size:
        return x
    bridged = np.interp(np.arange(x.size), known, x[known])
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], bridged), dtype=np.float64)


def _thin(trial: Trial, table: Array) -> Array:
    """The first complete row of each step: a slow receiver may have none on the rows of an even stride."""
    good = np.flatnonzero(np.isfinite(table).all(axis=1))
    stride = max(round(_STEP / trial.dt), 1) if len(trial) > 1 else 1
    return table[good[np.unique(good // stride, return_index=True)[1]]]


def _groups(names: Sequence[str], thin: Sequence[Array]) -> list[tuple[str, Array]]:
    """Files, or stretches of them where there are too few files to judge one by the others."""
    pairs = [(name, part) for name, part in zip(names, thin, strict=True) if len(part)]
    if len(pairs) >= 3:
        return pairs
    return [(name, block) for name, part in pairs for block in np.array_split(part, _BLOCKS) if len(block)]


def apart(parts: Sequence[Array]) -> list[Array]:
    """Root mean square distance of each part's points to their nearest neighbours among the other parts.

    One search among all points serves every part: it returns more neighbours than are needed, and is repeated with more
    where too many of them are of the part itself.
    """
    from scipy import spatial

    points, owner = np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    tree: Any = spatial.KDTree(points)
    wanted = np.minimum(_NEIGHBOURS, len(points) - np.bincount(owner))[owner]
    out = np.full(len(points), np.nan)
    left, many = np.arange(len(points)), 4 * _NEIGHBOURS
    while left.size:
        many = min(many, len(points))
        far, which = tree.query(points[left], k=many)
        foreign = owner[which] != owner[left, None]
        place = np.cumsum(foreign, axis=1)
        taken = foreign & (place <= wanted[left, None])
        squares = np.where(taken, far**2, 0.0).sum(axis=1)
        done = place[:, -1] >= wanted[left]
        out[left[done]] = np.sqrt(squares[done] / wanted[left[done]])
        left, many = left[~done], 4 * many
    return np.split(out, np.cumsum([len(part) for part in parts])[:-1])


def _nearest(reference: Reference, at: Array) -> tuple[Array, Array]:
    """Root mean square distance to the nearest points over the limit, and the squared offset from them by channel."""
    points = reference.points
    far, which = reference.tree.query(at, k=min(_NEIGHBOURS, len(points)))
    far, which = np.atleast_2d(far.T).T, np.atleast_2d(which.T).T
    offset = np.mean((points[which] - at[:, None, :]) ** 2, axis=1)
    return np.sqrt(np.mean(far**2, axis=1)) / reference.limit, offset
