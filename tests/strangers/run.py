"""What a new user does with a stranger: particulars, import --guess, study new, identify, nothing edited; then judged.

    python -m strangers.run [SHIP ...] [--follow] [--json FILE] [--keep FOLDER]

with tests/ on PYTHONPATH.  Without a name all ships are tried, and the last lines are the figures of the whole.  With
--follow the line that a fit prints as its advice is put into the study, which is fitted again, while there is one.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shutil
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from garden.run import KEYS, keys
from seatrial.core.errors import SeatrialError
from seatrial.workflow import Silent
from seatrial.workflow.asked import Bands, Orders
from seatrial.workflow.data import guess_mapping, import_logs
from seatrial.workflow.evidence.bands import simulate_with_bands
from seatrial.workflow.folders.drafting import new_study
from seatrial.workflow.identify import identify
from seatrial.workflow.judging import estimate
from seatrial.workflow.simulation import simulate
from seatrial.workflow.validate import check

from .logs import FAULTS, sheet, unseen, written
from .ships import BY_NAME, Stranger

INSTRUMENTS = (
    "bias", "scale", "delay", "offset", "port", "antenna", "receiver", "deviation", "direction", "exchange", "sign",
    "stuck",
)  # fmt: skip
"""How the names of suspects begin that are errors of instruments; a current is none."""
GRADED = ("identified", "graded")
INSIDE = 1.96
"""Half the width of 95 % [sigma]."""
NEAR = 0.05
"""How near advance and tactical diameter of the unseen turn have to be."""
INDICES = ("advance", "tactical_diameter")
ROUNDS, WORSE = 3, 1.05
"""How often advice is followed, and from which factor of the error on trials kept back on it has made it worse."""
_ADVICE = re.compile(r'([\w."-]+ = .+?) in \[(\w+)\] of the study')


@dataclass(frozen=True)
class Outcome:
    """How a stranger fared.

    Attributes:
        name, fault: of the ship, and what was planted.
        refused: the step that refused, in its words; the rest is then empty.
        off: distance from the truth [sigma] of the parameters that have one, by status and path.
        blamed: instruments that the fit names or has freed beyond two sigma.
        found: keys of warnings of `check`.
        lacking: whether the fit says that the model does not explain the data.
        turn: relative errors of the unseen turn.
        inside: whether the truth lies in the bands of each, as far as there are bands.
        held_out: standardised errors on trials kept back of the fitted and the untuned ship.
        seconds: of the three commands.
        followed: the error of the fitted ship on trials kept back after each advice that was followed.
    """

    name: str
    fault: str
    refused: str = ""
    off: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    blamed: tuple[str, ...] = ()
    found: tuple[str, ...] = ()
    lacking: bool = False
    turn: Mapping[str, float] = field(default_factory=dict)
    inside: Mapping[str, bool] = field(default_factory=dict)
    held_out: tuple[float, float] = (math.nan, math.nan)
    seconds: float = math.nan
    followed: tuple[float, ...] = ()

    @property
    def culprits(self) -> tuple[str, ...]:
        return FAULTS[self.fault].culprits if self.fault else ()

    @property
    def innocent(self) -> tuple[str, ...]:
        """Instruments blamed that are right."""
        return tuple(one for one in self.blamed if not _is(one, self.culprits))

    @property
    def named(self) -> bool:
        """Whether the planted fault was named, by the fit or by check."""
        return any(_is(one, self.culprits) for one in (*self.blamed, *self.found))

    @property
    def near(self) -> bool:
        return bool(self.turn) and all(abs(error) <= NEAR for error in self.turn.values())

    @property
    def worsened(self) -> int:
        """How many of the advices that were followed made the error larger."""
        return sum(b > WORSE * a for a, b in zip((self.held_out[0], *self.followed), self.followed, strict=False))

    def counts(self, statuses: Iterable[str]) -> tuple[int, int]:
        """How many parameters of these statuses hold the truth inside 95 %, and how many there are."""
        distances = [z for status in statuses for z in self.off.get(status, {}).values()]
        return sum(abs(z) <= INSIDE for z in distances), len(distances)


def _is(name: str, culprits: Sequence[str]) -> bool:
    """Whether a suspect or finding is one of the culprits; of a shaft or rudder of several, of any."""
    return any(one == culprit or one.startswith(f"{culprit}_") or one.startswith(f"{culprit}:")
               for culprit in culprits for one in (name, KEYS.get(name, name)))  # fmt: skip


def followed(text: str, advice: str) -> str:
    """A study with the line of an advice in it; empty where the advice has no line, or the study has it already."""
    line = _ADVICE.search(advice)
    if line is None:
        return ""
    entry, table = line.groups()
    [(key, new)] = tomllib.loads(entry).items()
    old = tomllib.loads(text).get(table, {}).get(key, [] if isinstance(new, list) else {})
    merged: Any = [*old, *(one for one in new if one not in old)] if isinstance(new, list) else {**old, **new}
    if merged == old:
        return ""
    given, header = entry.partition(" = ")[0], f"[{table}]"
    kept = [row for row in text.splitlines() if not row.startswith(f"{given} = ")]
    at = next((k for k, row in enumerate(kept) if row.startswith(header)), None)
    body = ", ".join(f'"{name}"' for name in merged) if isinstance(new, list) else ", ".join(
        f'"{name}" = {value}' for name, value in merged.items())  # fmt: skip
    said = f"{given} = [{body}]" if isinstance(new, list) else f"{given} = {{ {body} }}"
    rows = [*kept, header, said] if at is None else [*kept[: at + 1], said, *kept[at + 1 :]]
    return "\n".join(rows) + "\n"


def _following(where: Path, fit: Any) -> tuple[float, ...]:
    """Errors on trials kept back, as advice after advice is followed."""
    text, errors = (where / "study.toml").read_text(encoding="utf-8"), list[float]()
    for k in range(ROUNDS):
        advice = fit.diagnosis.remedies if fit.diagnosis else ()
        text = followed(text, advice[0]) if advice else ""
        if not text:
            break
        study = where / f"study_{k + 1}.toml"
        study.write_text(text, encoding="utf-8")
        [fit] = identify(study, where / f"run_{k + 1}", sink=Silent()).result.values()
        errors.append(_held_out(where / f"run_{k + 1}")[0])
    return tuple(errors)


def one(stranger: Stranger, where: Path, *, follow: bool = False) -> Outcome:
    """Try a stranger in a folder that is new.

    Args:
        follow: whether the advice of the fit is followed.
    """
    ship = where / "ship.toml"
    estimate(sheet(stranger, where / "particulars.toml"), ship)
    written(stranger, where / "logs")
    begun = time.perf_counter()
    try:
        guess_mapping(where / "logs", where / "mapping.toml")
        import_logs("csv", where / "logs", where / "trials", where / "mapping.toml")
        new_study("new", str(ship), where / "trials", where / "study.toml", sink=Silent())
        done = identify(where / "study.toml", where / "run", sink=Silent())
    except SeatrialError as error:
        return Outcome(stranger.name, stranger.fault, refused=str(error))
    spent = time.perf_counter() - begun
    [fit] = done.result.values()
    turn, inside = _turned(stranger, where / "run")
    return Outcome(
        stranger.name, stranger.fault, "", _distances(stranger, fit), _blamed(fit),
        keys([f for some in check([where / "trials"]).result.values() for f in some]),
        bool(fit.diagnosis and fit.diagnosis.lacking), turn, inside, _held_out(where / "run"), spent,
        _following(where, fit) if follow else (),
    )  # fmt: skip


def _distances(stranger: Stranger, fit: Any) -> dict[str, dict[str, float]]:
    out: dict[str, dict[str, float]] = {}
    if not stranger.comparable:
        return out
    called = {v.subject: v.status for v in fit.verdicts}
    for free, value, sigma in zip(fit.free, fit.values, fit.sigma, strict=True):
        try:
            true = stranger.ship.value(free.path)
        except (KeyError, AttributeError):
            continue  # the truth has it in another form
        distance = float((value - true) / sigma) if sigma > 0 else math.inf
        out.setdefault(called.get(free.path, ""), {})[free.path] = distance
    return out


def _blamed(fit: Any) -> tuple[str, ...]:
    """Instruments among the two likeliest suspects, and those that were freed and are not zero."""
    if fit.diagnosis is None:
        return ()
    told = [one.name for one in fit.diagnosis.causes[:2]]
    told += [one.name for one in fit.diagnosis.errors if abs(one.size) > 2.0 * one.sigma]
    return tuple(name for name in dict.fromkeys(told) if name.startswith(INSTRUMENTS))


def _turned(stranger: Stranger, run: Path) -> tuple[dict[str, float], dict[str, bool]]:
    """The unseen turn by the fitted ship against the truth, and whether the bands hold it."""
    true, asked = unseen(stranger), Orders(rudder=35.0, side="starboard")
    try:
        bands = Bands(level=95.0, count=200, extrapolate=True)
        banded = simulate_with_bands(str(run / "model.toml"), "turning", bands, orders=asked)
    except SeatrialError:
        ran = simulate(str(run / "model.toml"), "turning", orders=asked)
        return {name: ran.indices[name].value / true[name] - 1.0 for name in INDICES if name in ran.indices}, {}
    found = {name: banded.indices[name] for name in INDICES if name in banded.indices}
    return ({name: value.value / true[name] - 1.0 for name, (value, _, _) in found.items()},
            {name: low.value <= true[name] <= high.value for name, (_, low, high) in found.items()})  # fmt: skip


def _held_out(run: Path) -> tuple[float, float]:
    """Standardised errors on trials kept back, as the report has them: of the fitted ship, and of the initial one."""
    told = json.loads((run / "report.json").read_text(encoding="utf-8"))["standardised"]
    return float(told["fitted"]), float(told["untuned"])


def table(outcomes: Sequence[Outcome]) -> str:
    """A line a ship, and the figures of the whole."""
    lines = [f"{'ship':14}{'fault':14}{'named':6}{'graded':>8}{'weak':>6}{'not':>7}{'advance':>9}"
             f"{'diameter':>9}{'bands':>6}{'held out':>9}{'untuned':>8}{'s':>6}  right, and blamed"]  # fmt: skip
    for o in outcomes:
        if o.refused:
            lines.append(f"{o.name:14}{o.fault or '-':14}refused: {o.refused[:140]}")
            continue
        grades = ["/".join(map(str, o.counts(some))) for some in (GRADED, ("weak",), ("not identified",))]
        errors = [f"{100.0 * o.turn[name]:+.1f}%" if name in o.turn else "-" for name in INDICES]
        bands = f"{sum(o.inside.values())}/{len(o.inside)}"
        lines.append(
            f"{o.name:14}{o.fault or '-':14}{('yes' if o.named else 'no') if o.fault else '.':6}"
            f"{grades[0]:>8}{grades[1]:>6}{grades[2]:>7}{errors[0]:>9}{errors[1]:>9}{bands:>6}"
            f"{o.held_out[0]:9.3g}{o.held_out[1]:8.3g}{o.seconds:6.1f}  {', '.join(o.innocent)}"
            + (f"  followed: {', '.join(f'{error:.3g}' for error in o.followed)}" if o.followed else "")
        )
    return "\n".join([*lines, *figures(outcomes)])


def figures(outcomes: Sequence[Outcome]) -> list[str]:
    """What the whole garden measures."""
    fits = [o for o in outcomes if not o.refused]
    spoilt = [o for o in fits if o.fault]
    grades = {"is called identified or graded": GRADED, "has a range": (*GRADED, "weak", "not identified", "at bound")}
    lacking = sum(o.lacking for o in fits)
    lines = [f"{len(outcomes)} ships, {len(outcomes) - len(fits)} refused; {lacking} fits do not explain the data"]
    for name, statuses in grades.items():
        inside, all_ = (sum(some) for some in zip(*(o.counts(statuses) for o in fits), strict=True)) if fits else (0, 0)
        lines.append(f"truth inside 95 % of what {name}: {inside} of {all_}")
    held = [ok for o in fits for ok in o.inside.values()]
    lines += [
        f"fits that blame an instrument that is right: {sum(bool(o.innocent) for o in fits)} of {len(fits)}",
        f"planted faults named: {sum(o.named for o in spoilt)} of {len(spoilt)}",
        f"unseen turn within {100 * NEAR:g} %: {sum(o.near for o in fits)} of {len(fits)}; "
        f"inside the bands: {sum(held)} of {len(held)}",
        f"held-out error below the untuned ship's: {sum(o.held_out[0] < o.held_out[1] for o in fits)} of {len(fits)}",
        f"advice followed: {sum(len(o.followed) for o in fits)}, of which made it worse: "
        f"{sum(o.worsened for o in fits)}",
        f"seconds of three commands: {sum(o.seconds for o in fits):.0f} in all",
    ]  # fmt: skip
    return lines


def recorded(outcomes: Sequence[Outcome], arguments: Sequence[str]) -> str:
    """The outcomes as JSON, with the command that made them and the figures of the whole."""
    rows = ",\n  ".join(json.dumps(asdict(one)) for one in outcomes)
    command = json.dumps(" ".join(["PYTHONPATH=src:tests python -m strangers.run", *arguments]))
    return f'{{"command": {command},\n "figures": {json.dumps(figures(outcomes))},\n "outcomes": [\n  {rows}]}}\n'


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="SHIP", choices=[*BY_NAME, []])
    parser.add_argument("--follow", action="store_true", help="put printed advice into the study and fit again")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--keep", type=Path, help="folder for what the commands write, one of each ship")
    asked = parser.parse_args(arguments)
    outcomes: list[Outcome] = []
    for stranger in BY_NAME.values():
        if asked.names and stranger.name not in asked.names:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            outcomes.append(one(stranger, Path(scratch), follow=asked.follow))
            if asked.keep:
                shutil.copytree(scratch, asked.keep / stranger.name, dirs_exist_ok=True)
        sys.stderr.write(table(outcomes[-1:]).splitlines()[1] + "\n")
    sys.stdout.write(table(outcomes) + "\n")
    if asked.json:
        asked.json.write_text(recorded(outcomes, arguments), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
