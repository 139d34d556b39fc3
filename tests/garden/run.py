"""What a user does with a folder of the garden, and what was said: import, check, identify, nothing else.

    python -m garden.run [NAME ...] [--ship SHIP] [--seeds 1,2,3] [--no-fit] [--json FILE]

with tests/ on PYTHONPATH.

An outcome is silently wrong where a parameter is called identified beyond four of its sigmas from the truth and nobody
said anything that the same folder without the fault does not get to hear.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.core.errors import SeatrialError
from seatrial.data import Trial
from seatrial.data.check import Finding
from seatrial.workflow import Silent
from seatrial.workflow.data import import_logs
from seatrial.workflow.identify import identify
from seatrial.workflow.validate import check

from .faults import Fault, faults
from .logs import Folder, clean
from .ships import Ship, hidden

STUDY = """schema = "seatrial-study/1"
ship = "{ship}"
[data]
root = "{root}"
train = ["*"]
[free]
{free}
"""
FAR = 4.0
KEYS = {
    "bias.psi": "heading_bias", "bias.psi_speed": "heading_bias", "delay.receiver": "lag:x",
    "receiver.ahead": "lever_arm", "receiver.starboard": "lever_arm",
    "deviation.north": "heading_deviation", "deviation.east": "heading_deviation",
    "bias.r": "gyro_bias", "bias.u": "log_bias", "bias.v_m": "sway_bias",
    "scale.u": "log_scale", "scale.r": "gyro_scale", "delay.position": "lag:x", "delay.psi": "lag:psi",
    "delay.speed": "lag:u", "delay.r": "lag:r", "antenna.ahead": "lever_arm", "antenna.starboard": "lever_arm",
    "offset.delta": "rudder_offset", "port.delta": "rudder_sides", "scale.delta": "rudder_scale",
    "delay.delta": "lag:delta", "scale.n_P": "revolutions_scale", "delay.n_P": "lag:n_P",
    "current.north": "current", "current.east": "current", "wind.north": "wind", "wind.east": "wind",
    "scale.wind": "wind_scale", "direction.wind": "wind_to",
}
"""Names of suspects of a fit as the keys of `check` have them; those of one of several controls keep their own."""


@dataclass(frozen=True)
class Outcome:
    """What was said of one folder.

    Attributes:
        fault, seed: which.
        refused: by import or identify, in its words.
        findings: keys of the warnings and errors of `check`, with their channels.
        suspects: keys that the fit names, those that matter.
        capped: whether the fit says that no parameter is identified.
        off: distance from the truth in sigmas of each parameter that is called identified.
        seconds: of each step.
    """

    fault: str
    seed: int
    refused: str
    findings: tuple[str, ...]
    suspects: tuple[str, ...]
    capped: bool
    off: Mapping[str, float]
    seconds: tuple[float, float]

    @property
    def wrong(self) -> tuple[str, ...]:
        """Parameters called identified far from the truth."""
        return tuple(path for path, sigmas in self.off.items() if not abs(sigmas) <= FAR)

    @property
    def said(self) -> bool:
        """Whether anybody said anything."""
        return bool(self.refused or self.findings or self.suspects or self.capped)

    def named(self, culprits: Sequence[str]) -> bool:
        """Whether a culprit was named, by check, by the fit, or by a refusal that names key or column."""
        heard = {*self.findings, *self.suspects}
        heard |= {one.partition(":")[0] for one in heard}
        return bool(heard & set(culprits)) or any(_words(c) in self.refused for c in culprits if self.refused)


def _words(culprit: str) -> str:
    return {"time_repeats": "time repeats", "time_back": "time goes back"}.get(culprit, f"'{culprit}'")


def keys(findings: Sequence[Finding]) -> tuple[str, ...]:
    """Keys of warnings and errors, each with each of its channels."""
    told = [f for f in findings if f.severity != "info"]
    return tuple(sorted({f"{f.key}:{name}" for f in told for name in f.channels} | {f.key for f in told}))


def trials(folder: Folder) -> list[Trial]:
    """The logs of a folder as trials, without files."""
    return [Trial(log.name, log.t, dict(log.table), {}, dict(folder.meta)) for log in folder.logs]


def ship_file(ship: Ship, where: Path) -> str:
    """What a study calls the ship: its name, or a file where the one of the library lacks the windage of the garden."""
    text = (files("seatrial.ships") / f"{ship.name}.toml").read_text(encoding="utf-8")
    if ship.areas is None or "[wind]" in text:
        return ship.name
    numbers = {**ship.areas, "rho_air": 1.225, "C_Dt": 0.70, "C_Dl_bow": 0.90, "C_Dl_stern": 0.55, "delta": 0.40}
    units = {"A_T": "m^2", "A_L": "m^2", "L_OA": "m", "s_L": "m", "rho_air": "kg/m^3"}
    lines = ["[wind]", 'type = "wind_blendermann:Blendermann"']
    for name, value in numbers.items():
        unit = f', unit = "{units[name]}"' if name in units else ""
        lines.append(f'{name} = {{ value = {value!r}, source = "assumed"{unit} }}')
    path = where / f"{ship.name}.toml"
    path.write_text("\n".join([text, *lines, ""]), encoding="utf-8")
    return str(path)


def study(ship: str, free: Sequence[str], where: Path, trials: Path) -> Path:
    """A study of nothing but ship, data and seven free parameters."""
    lines = "\n".join(f'"{path}" = {{ ratio = 0.5 }}' for path in free)
    path = where / "study.toml"
    path.write_text(STUDY.format(ship=ship, root=trials, free=lines), encoding="utf-8")
    return path


def one(fault: Fault | None, seed: int, ship: str = "full", fit: bool = True, folder: Folder | None = None) -> Outcome:
    """Import, check and identify a folder with a fault, or without one."""
    name = fault.name if fault else "clean"
    sound = folder or clean(ship, fault.weather if fault else "calm", seed)
    spoilt = fault.plant(sound) if fault else sound
    empty = Outcome(name, seed, "", (), (), False, {}, (0.0, 0.0))
    with tempfile.TemporaryDirectory() as scratch:
        where = Path(scratch)
        mapping = spoilt.write_raw(where / "raw")
        try:
            import_logs("csv", where / "raw", where / "trials", mapping)
        except SeatrialError as error:
            return Outcome(**{**asdict(empty), "refused": f"import: {error}"})
        begun = time.perf_counter()
        found = [f for some in check([where / "trials"]).result.values() for f in some]
        told, spent = keys(found), time.perf_counter() - begun
        if not fit:
            return Outcome(**{**asdict(empty), "findings": told, "seconds": (spent, 0.0)})
        begun = time.perf_counter()
        truth = hidden(spoilt.ship)
        path = study(ship_file(spoilt.ship, where), list(truth), where, where / "trials")
        ear = Ear()
        try:
            outcome = identify(path, where / "run", sink=ear)
        except SeatrialError as error:
            return Outcome(**{**asdict(empty), "findings": told, "refused": f"identify: {error}"})
        [fitted] = outcome.result.values()
        spents = (spent, time.perf_counter() - begun)
        told = tuple(sorted({*told, *ear.heard()}))
        return Outcome(name, seed, "", told, suspects(fitted), capped(fitted), distances(fitted, truth), spents)


class Ear(Silent):
    """Keeps the notes of a fit."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, line: str) -> None:
        self.notes.append(line)

    def heard(self) -> set[str]:
        """Keys of the warnings of the lint that the garden asks for."""
        return {key for key, words in _LINT.items() if any(words in note for note in self.notes)}


_LINT = {"no_wind": "has no wind (U_T, gamma_T)"}


def distances(fit: Any, truth: Mapping[str, float]) -> dict[str, float]:
    """How many sigmas the parameters that are called identified are from the truth."""
    called = {v.subject: v.status for v in fit.verdicts}
    found: dict[str, float] = {}
    for free, value, sigma in zip(fit.free, fit.values, fit.sigma, strict=True):
        if called.get(free.path) == "identified":
            found[free.path] = float((value - truth[free.path]) / sigma) if sigma > 0 else float("inf")
    return found


def suspects(fit: Any) -> tuple[str, ...]:
    """Keys of the two likeliest suspects of a fit, those that matter."""
    causes = fit.diagnosis.causes[:2] if fit.diagnosis else ()
    turned = any(one.turned for one in causes)
    return (*(KEYS.get(one.name, one.name) for one in causes), *["wind_to"] * turned)


def capped(fit: Any) -> bool:
    """Whether the residuals forbid to call anything identified."""
    return bool(fit.diagnosis and fit.diagnosis.lacking)


def table(outcomes: Sequence[Outcome], planted: Mapping[str, Fault]) -> str:
    """Outcomes in lines, the sums last."""
    lines = [f"{'fault':22} seed named wrong silent  said"]
    silent = named = visible = wrong = 0
    for o in outcomes:
        fault = planted.get(o.fault)
        culprits = fault.culprits if fault else ()
        right, bad = o.named(culprits), bool(o.wrong)
        if fault and fault.visible:
            visible, named = visible + 1, named + right
        wrong, silent = wrong + (bad and o.said), silent + (bad and not o.said)
        worst = max((abs(s) for s in o.off.values()), default=0.0)
        about = o.refused or ", ".join([*o.findings, *(f"fit {s}" for s in o.suspects), *["capped"] * o.capped])
        lines.append(
            f"{o.fault:22} {o.seed:4} {'yes' if right else '-' if fault and fault.visible else '.':5} "
            f"{worst:5.1f} {'SILENT' if bad and not o.said else '      '}  {about[:120]}"
        )
    lines.append(f"{len(outcomes)} folders: {silent} silently wrong, {wrong} wrong though something was said; "
                 f"culprit named in {named} of {visible} visible")  # fmt: skip
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seeds", default="1")
    parser.add_argument("--ship", default="full")
    parser.add_argument("--no-fit", action="store_true")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args(arguments)
    known = faults(asked.ship)
    chosen = [f for f in known if not asked.names or f.name in asked.names]
    some: list[Fault | None] = [*([None] if not asked.names or "clean" in asked.names else []), *chosen]
    outcomes: list[Outcome] = []
    for seed, fault in product(asked.seeds.split(","), some):
        outcomes.append(one(fault, int(seed), asked.ship, not asked.no_fit))
        sys.stderr.write(table(outcomes[-1:], {f.name: f for f in known}).splitlines()[1] + "\n")
    sys.stdout.write(table(outcomes, {f.name: f for f in known}) + "\n")
    if asked.json:
        rows = [{**asdict(o), "wrong": o.wrong, "said": o.said} for o in outcomes]
        asked.json.write_text(json.dumps(rows, indent=1, default=_plain) + "\n", encoding="utf-8")
    return 0


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else dict(value)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
