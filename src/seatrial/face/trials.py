"""Trials with verbs: read, drawn, as a table, checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self, overload

import numpy as np

from .. import data
from ..core.values import dataclass, fields, replace
from ..data.check import Finding, check_folder
from ..data.trialfile import read_trial as read_one
from ..data.trialfile import read_trials as read_several
from ..data.trialfile import write_trial
from ..report.blocks import Line, Numbers
from ..sensors import Sensors
from .tables import Table, Tabular, html, table_of

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes

_SHOWN = 12
"""As many findings as a person reads at once."""


@dataclass(frozen=True, eq=False, repr=False)
class Trial(data.Trial):
    """One recording, or one simulated run: time, channels by name in SI units and radians, and what is known of it.

    ``trial["psi"]`` is a channel as an array; ``trial.t`` the time [s].  Attributes are those of `seatrial.data.Trial`.
    """

    def plot(self, ax: Axes | None = None, *, label: str | None = None, outlines: int = 12) -> Axes:
        """Draw the track, north up at equal scale, with outlines of the ship.

        Args:
            ax: axes to draw on; None makes new ones.
            label: of the track in a legend; None is the name of the trial.
            outlines: number of outlines along the track; 0 for none.

        Returns:
            The axes.

        Raises:
            DataError: no position.
        """
        from .plots import track

        return track(self, ax, label=label, outlines=outlines, breadth=self.breadth)

    @property
    def breadth(self) -> float | None:
        """Breadth of the ship [m]; None where it is not known."""
        return None

    def plot_series(
        self, *rows: str | Sequence[str], axes: Axes | Sequence[Axes] | None = None, label: str | None = None
    ) -> Sequence[Axes]:
        """Draw channels over time, angles in degrees.

        Args:
            rows: a channel a row, or several of one unit in a row: ``("psi", "delta"), "u"``; by default heading,
                speeds, rate of turn and the controls.
            axes: axes to draw on, one a row; None makes new ones.
            label: of the lines in a legend.

        Returns:
            The axes, one a row.

        Raises:
            DataError: no such channel, or two units in one row.
        """
        from .plots import series

        return series(self, rows, axes, label=label)

    def to_frame(self, *, units: bool = False) -> pl.DataFrame:
        """Time and channels as a Polars data frame; any other library reads it, or the trial, by the Arrow interface.

        Args:
            units: name columns with their unit, ``psi [rad]``, as the trial file does.
        """
        import polars as pl

        names = ("t", *self.channels)
        return pl.DataFrame({f"{n} [{self.unit(n)}]" if units else n: np.ascontiguousarray(self[n]) for n in names})

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """The Arrow PyCapsule interface: ``pandas.DataFrame.from_arrow(trial)``, ``pyarrow.table(trial)``, ..."""
        return self.to_frame().__arrow_c_stream__(requested_schema)

    def with_noise(self, noise: Mapping[str, float], *, seed: int) -> Trial:
        """The same as sensors with white noise would record it.

        Args:
            noise: standard deviation by channel, SI units and radians.
            seed: of the noise.

        Raises:
            SensorError: no such channel, or a deviation below zero.
        """
        return trial_of(Sensors(noise).read(self, np.random.default_rng(seed)))

    def named(self, name: str) -> Self:
        """The same under another name, by which problems and pictures know it."""
        return replace(self, name=name)

    def save(self, path: str | Path) -> None:
        """Write a trial file, .csv or .parquet, and its sidecar; `read_trial` reads them."""
        write_trial(self, path)

    def _repr_html_(self) -> str:
        told = ("ship", "kind", "L_pp", "source", "licence")
        known = [(key, str(self.meta[key])) for key in told if key in self.meta]
        said = [("rows", f"{len(self)}, every {self.dt:.4g} s, {self.duration:.4g} s in all"), *known]
        title = repr(self).partition(",")[0] + ")"
        return html((Line(title, "heading"), Numbers(tuple(said)), self._ranges()))

    def _ranges(self) -> Table:
        """Range and gaps of each channel."""

        def row(name: str) -> tuple[str, str, float | None, float | None, int]:
            values = self[name][np.isfinite(self[name])]
            least, most = (float(values.min()), float(values.max())) if values.size else (None, None)
            return name, self.unit(name), least, most, len(self) - values.size

        return table_of("", ("channel", "unit", "least", "largest", "gaps"), tuple(map(row, self.channels)))


@dataclass(frozen=True, repr=False)
class Findings(Tabular, Sequence[Finding]):
    """What `check` has found, errors first.

    Attributes:
        found: the findings; each has severity, kind, trials, channels and the steps that mend it as fields.
        trials: number of trials checked.
    """

    found: tuple[Finding, ...]
    trials: int

    @overload
    def __getitem__(self, index: int) -> Finding: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Finding, ...]: ...
    def __getitem__(self, index: int | slice) -> Finding | tuple[Finding, ...]:
        return self.found[index]

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.found)

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Those that forbid using a trial as it is."""
        return tuple(one for one in self.found if one.severity == "error")

    @property
    def table(self) -> Table:
        """Severity, place, fault, evidence and remedy of each."""
        counts = [sum(one.severity == kind for one in self.found) for kind in ("error", "warning", "info")]
        title = f"{self.trials} trials: {counts[0]} errors, {counts[1]} warnings, {counts[2]} notes"
        head = ("severity", "where", "what", "evidence", "remedy")
        return table_of(title, head, tuple((f.severity, f.where, f.what, f.evidence, f.remedy) for f in self.found))

    def __repr__(self) -> str:
        """A line a finding: a column as wide as the longest sentence would not fit a terminal."""
        more = [f"... and {len(self) - _SHOWN} more"] if len(self) > _SHOWN else []
        return "\n".join([self.table.title, *map(str, self.found[:_SHOWN]), *more])


def trial_of(trial: data.Trial) -> Trial:
    """Any trial as one with verbs."""
    return trial if isinstance(trial, Trial) else Trial(*(getattr(trial, f.name) for f in fields(data.Trial)))


def read_trial(path: str | Path) -> Trial:
    """Read one trial file, .csv or .parquet, with its sidecar.

    Raises:
        DataError: naming file, column and line of what is wrong.
    """
    return trial_of(read_one(path))


def read_trials(paths: str | Path | Iterable[str | Path]) -> tuple[Trial, ...]:
    """Read trial files and folders of them; a folder gives its files sorted by name.

    Raises:
        DataError: an empty folder, two trials of one name, or what `read_trial` raises.
    """
    return tuple(map(trial_of, read_several(paths)))


def check(trials: data.Trial | Iterable[data.Trial]) -> Findings:
    """Faults of the trials of one ship, with evidence and remedy; trials checked together judge each other."""
    given = (trials,) if isinstance(trials, data.Trial) else tuple(trials)
    return Findings(check_folder(given), len(given))
