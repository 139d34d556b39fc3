"""What becomes of a folder of the garden when its user does what `check` and the fit print, and nothing else.

    python -m garden.remedies [NAME ...] [--seeds 1,2] [--fit] [--json FILE]      (with tests/ on PYTHONPATH)

Where `check` found something: ``check --remedy FILE``, ``mend --by FILE``, check again.  A line for [nuisance] goes
into the study.  Where only the fit found something, the line that it prints goes there, and it fits again.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from seatrial.core.errors import SeatrialError
from seatrial.data.check import Finding
from seatrial.workflow.data import import_logs, mend
from seatrial.workflow.identify import identify
from seatrial.workflow.validate import check

from .faults import FAULTS, Fault
from .logs import clean
from .run import FAR, capped, distances, keys, study, suspects
from .ships import hidden

_ROUNDS, _FITS = 2, 4
"""How often a user checks and mends; how often one fits, each time with the error that the last fit named first."""


@dataclass(frozen=True)
class Cure:
    """What became of a fault.

    Attributes:
        fault, seed: which.
        found: keys of the warnings and errors of the first check.
        printed: the remedies.
        after: keys of the last check, without those whose remedy is a line of the study.
        nuisance: lines of [nuisance] that were printed.
        off: distance from the truth, in sigma, of what a fit to the mended log calls identified; empty without a fit.
        suspected: what such a fit still suspects.
        refused: a step that was refused.
    """

    fault: str
    seed: int
    found: tuple[str, ...]
    printed: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    nuisance: tuple[tuple[str, float], ...] = ()
    off: tuple[tuple[str, float], ...] = ()
    suspected: tuple[str, ...] = ()
    refused: str = ""

    @property
    def detected(self) -> bool:
        """Whether check, or the first fit, found anything."""
        return bool(self.found or self.printed)

    @property
    def wrong(self) -> bool:
        """Whether a parameter is called identified far from the truth."""
        return any(not abs(sigmas) <= FAR for _, sigmas in self.off)

    @property
    def cured(self) -> bool:
        """Whether the fault is gone, and nothing new is there."""
        return not (self.refused or self.after or self.wrong)


def _told(where: Path) -> list[Finding]:
    some = check([where]).result.values()
    return list(dict.fromkeys(f for found in some for f in found if f.severity != "info"))


def _obey(refusal: str, mapping: Path) -> None:
    """Put the key that a refusal of the import names into the mapping."""
    if "sort = true under time in the mapping" in refusal:
        text = mapping.read_text(encoding="utf-8")
        mapping.write_text(text.replace('time = { column', 'time = { sort = true, column'), encoding="utf-8")


def cure(fault: Fault, seed: int, fit: bool = False) -> Cure:
    """Plant a fault, and do what is printed."""
    spoilt = fault.plant(clean(weather=fault.weather, seed=seed))
    with tempfile.TemporaryDirectory() as scratch:
        here = Path(scratch)
        mapping = spoilt.write_raw(here / "raw")
        where = here / "trials"
        printed, refusals = list[str](), ()
        try:
            import_logs("csv", here / "raw", where, mapping)
        except SeatrialError as error:
            printed, refusals = [str(error)], ("import",)
            _obey(str(error), mapping)
        try:
            import_logs("csv", here / "raw", where, mapping)
        except SeatrialError as error:
            return Cure(fault.name, seed, refusals, tuple(printed), refused=f"import: {error}")
        first = now = _told(where)
        printed, lines = [*printed, *(str(f) for f in first)], dict[str, float]()
        found = (*refusals, *keys(first))
        try:
            for k in range(_ROUNDS):
                lines |= {key: value for f in now for key, value in f.nuisance}
                if not any(f.steps for f in now):
                    break
                check([where], remedy=here / "steps.toml")
                mend([where], here / "steps.toml", here / f"mended_{k}")
                where = here / f"mended_{k}"
                now = _told(where)
        except SeatrialError as error:
            return Cure(fault.name, seed, found, tuple(printed), refused=str(error))
        lines |= {key: value for f in now for key, value in f.nuisance}
        left = keys([f for f in now if not f.nuisance])
        told = Cure(fault.name, seed, found, tuple(printed), left, tuple(lines.items()))
        return _fitted(told, spoilt.ship, here, where, free=not found) if fit else told


def _fitted(told: Cure, ship, here: Path, where: Path, free: bool) -> Cure:
    """The same with a fit; where `check` found nothing, the first fit tells, and the second does as it says."""
    truth, printed = hidden(ship), list(told.printed)
    path = study(ship.name, list(truth), here, where)
    text, own = path.read_text(encoding="utf-8"), "".join(f"{key} = {value:.3g}\n" for key, value in told.nuisance)
    common: list[str] = []
    try:
        for k in range(_FITS if free else 1):
            lines = own + (f"common = {{ {', '.join(common)} }}\n" if common else "")
            path.write_text(f"{text}[nuisance]\n{lines}" if lines else text, encoding="utf-8")
            [found] = identify(path, here / f"run_{k}").result.values()
            told_by_fit = [one for one in found.diagnosis.lines if one.startswith("remedy")] if found.diagnosis else []
            if not (free and told_by_fit):
                break
            printed += told_by_fit
            common += re.findall(r'"[\w.]+" = inf', told_by_fit[0])
    except SeatrialError as error:
        return Cure(**{**asdict(told), "refused": str(error)})
    off = tuple(distances(found, truth).items())
    more = (*suspects(found), *["capped"] * capped(found))
    return Cure(**{**asdict(told), "printed": tuple(printed), "off": off, "suspected": more})


def line(one: Cure) -> str:
    """One cure; where it failed, with what was printed."""
    worst = max((abs(s) for _, s in one.off), default=0.0)
    state = "-" if not one.detected else "cured" if one.cured else "FAILS"
    about = one.refused or ", ".join([*one.after, *(f"fit {s}" for s in one.suspected)])
    more = [f"    {said[:400]}" for said in one.printed] if state == "FAILS" else []
    return "\n".join([f"{one.fault:22} {one.seed:4} {state:6} {worst:5.1f}  {about[:90]}", *more])


def share(cures: Sequence[Cure]) -> str:
    """How many of the detected faults are gone."""
    detected = [one for one in cures if one.detected]
    return f"{sum(one.cured for one in detected)} of {len(detected)} detected faults are gone after their remedy"


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seeds", default="1")
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args(arguments)
    chosen = [f for f in FAULTS if not asked.names or f.name in asked.names]
    cures = list[Cure]()
    for seed in asked.seeds.split(","):
        for fault in chosen:
            cures.append(cure(fault, int(seed), asked.fit))
            sys.stdout.write(line(cures[-1]) + "\n")
            sys.stdout.flush()
    sys.stdout.write(share(cures) + "\n")
    if asked.json:
        asked.json.write_text(json.dumps([asdict(one) for one in cures], indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
