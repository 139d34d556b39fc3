"""Systems under test: what steers the own ship in a case, of whatever kind, as one value.

A conduct by name, a function of one's own, an FMU and a policy that was learned are called with a scene of many runs at
once (`encounters.sailing`); a program of its own hears and steers by a link, one run at a time (`outside`).  Whichever
answers no more has fallen silent: its last orders hold.
"""

from __future__ import annotations

import importlib.util
import math
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from ...core.errors import RequestError
from ...core.records import Positive
from ...core.values import dataclass
from ...data import Array
from ...encounters.conduct import CONDUCTS, Master, Orders, Scene
from ...encounters.learning import Sight
from ...encounters.sailing import STEP, Command
from ...encounters.sensing import UNSEEN
from ...exchange.fmi.inside import Archive, Live
from ...realtime.links.wiring import Wiring
from .outside import Spoken

_SENT = "HDT,ROT,RMC,VBW,TTM,VDM,ZDA"
_OWN = {"own.x": "m", "own.y": "m", "own.psi": "rad", "own.north": "m/s", "own.east": "m/s"}
_TARGET = {"x": "m", "y": "m", "psi": "rad", "north": "m/s", "east": "m/s", "L": "m", "valid": ""}
_ORDERED = {"order.psi": "rad", "order.speed": ""}
"""Variables of an FMU and their units; those of a target are ``target[K].x`` and so on, from 1."""


@dataclass(frozen=True, kw_only=True)
class Stack:
    """A stack as a table of a case file.

    Attributes:
        speaks: by what it steers.
        command: what runs a program, in the folder of the case; ``{address}`` is HOST:PORT of the ship's NMEA over udp,
            ``{link}`` that of the link by which it steers where that is another.
        file: an FMU, or FILE.py:NAME of a function that gives a policy.
        reads: other files that it is made of, such as weights; a change of them makes another case.
        sends: sentences that a program is sent.
        answers: the sentence that it answers each time.
        patience: longest wait for an answer [s of the clock].
    """

    speaks: Spoken | Literal["fmu", "gymnasium"] = "nmea"
    command: str = ""
    file: str = ""
    reads: tuple[str, ...] = ()
    sends: str = _SENT
    answers: str = "ZDA"
    patience: Positive = 10.0

    @property
    def called(self) -> bool:
        """Whether it is called with scenes."""
        return self.speaks in ("fmu", "gymnasium")

    @property
    def told(self) -> str:
        """Its command or file."""
        return self.file if self.called else self.command

    def wiring(self, folder: Path) -> Wiring:
        """The wire on which a program hears.

        Raises:
            RequestError: a sentence that is none.
        """
        return Wiring("udp://127.0.0.1:0", only=self.sends, answers=self.answers, lock_step=True,
                      patience=self.patience, beside=self.command, folder=folder)  # fmt: skip


def stack_of(said: str | Stack, folder: Path) -> str | Command | Wiring:
    """What steers, of a case file in a folder.

    Raises:
        RequestError: no such conduct, file, function or program; an FMU or a policy that cannot steer.
    """
    if isinstance(said, str):
        return Guarded(_function(said, folder, "stack"), said) if ":" in said else conduct(said, "stack")
    given, other = ("file", "command") if said.called else ("command", "file")
    if not getattr(said, given) or getattr(said, other):
        raise RequestError(f'stack: one that speaks "{said.speaks}" has a {given}, and no {other}')
    for name in said.reads:
        if not (folder / name).is_file():
            raise RequestError(f"stack.reads: {folder / name}: no such file")
    if said.speaks == "fmu":
        return Guarded(Slave.of(folder / said.file), said.file)
    if said.speaks == "gymnasium":
        policy = _function(said.file, folder, "stack.file")()
        if not callable(getattr(policy, "predict", None)):
            raise RequestError(f"stack.file: what {said.file} gives has no predict(observations), as policies of "
                               "stable-baselines3 have")  # fmt: skip
        return Guarded(lambda scene: _Learned(policy, Sight(scene)), said.file)
    return said.wiring(folder)


def beside(said: str | Stack) -> list[str]:
    """Names of the files that it is made of, as far as it names them."""
    if isinstance(said, str):
        return [said.partition(":")[0]]
    return [*([said.file.partition(":")[0]] if said.called else shlex.split(said.command)), *said.reads]


def conduct(name: str, key: str) -> str:
    """A conduct by name.

    Raises:
        RequestError: there is none such.
    """
    if name not in CONDUCTS:
        raise RequestError(f"{key}: no conduct '{name}'; there are {', '.join(CONDUCTS)}")
    return name


def _function(said: str, folder: Path, key: str) -> Callable[..., Any]:
    """A function of a Python file beside the case."""
    file, colon, name = said.partition(":")
    path = folder / file
    spec = importlib.util.spec_from_file_location("seatrial_case_stack", path)
    if not colon or not path.is_file() or spec is None or spec.loader is None:
        raise RequestError(f"{key}: {path}: no such Python file; write FILE.py:NAME")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made = getattr(module, name, None)
    if not callable(made):
        raise RequestError(f"{key}: {path} has no function {name}")
    return cast("Callable[..., Any]", made)


@dataclass(frozen=True)
class Guarded:
    """A stack of somebody else's: one that fails at its first look is a wrong request, later it has fallen silent."""

    begin: Command
    name: str

    def __call__(self, scene: Scene) -> Master:
        return _Guarded(self.begin(scene), self.name)


class _Guarded:
    def __init__(self, master: Master, name: str) -> None:
        self._master, self._name, self._looks = master, name, 0

    def look(self, scene: Scene) -> Orders:
        """Its orders; NaN of those runs in which there are none."""
        none = np.full(len(scene.x), np.nan)
        if self._looks < 0:
            return Orders(none, none)
        try:
            psi, speed = (np.asarray(one, dtype=np.float64) for one in self._master.look(scene))
            if psi.shape != none.shape or speed.shape != none.shape:
                raise ValueError(f"orders of shape {psi.shape} and {speed.shape}; there are {len(none)} runs")
        except Exception as error:
            if self._looks == 0:
                raise RequestError(f"stack: {self._name} fails at its first look: {type(error).__name__}: "
                                   f"{error}") from error  # fmt: skip
            self._looks = -1
            return Orders(none, none)
        self._looks += 1
        return Orders(psi, speed)


@dataclass(frozen=True)
class _Learned:
    """A policy of the task `Encounter`, asked without noise."""

    policy: Any
    sight: Sight

    def look(self, scene: Scene) -> Orders:
        said = self.policy.predict(self.sight.observed(scene), deterministic=True)
        return self.sight.ordered(np.asarray(said[0] if isinstance(said, tuple) else said, dtype=np.float64))


@dataclass(frozen=True, eq=False)
class Slave:
    """A controller as a co-simulation FMU of FMI 2.0 or 3.0, an instance for each run.

    Attributes:
        archive: its file.
        inputs: those of `_OWN` and of the targets' that it has.
        outputs: those of `_ORDERED`.
        targets: how many others it takes.
    """

    archive: Archive
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    targets: int

    @staticmethod
    def of(path: Path) -> Slave:
        """The controller of a file.

        Raises:
            RequestError: none, or one without the variables of a controller, or with other units.
        """
        archive = Archive.of(path, "stack.file")
        known = archive.variables
        targets = next(k for k in range(1000) if f"target[{k + 1}].x" not in known)
        wanted = {**_OWN, **{f"target[{k}].{name}": unit for k in range(1, targets + 1)
                             for name, unit in _TARGET.items()}}  # fmt: skip
        if "order.psi" not in known or not targets or "own.psi" not in known:
            raise RequestError(f"stack.file: {path}: a controller has inputs such as own.psi and target[1].x, and the "
                               f"output order.psi; it has {', '.join(list(known)[:6])}")  # fmt: skip
        for name, unit in {**wanted, **_ORDERED}.items():
            said = known[name].unit if name in known else None
            if said and said != (unit or "1"):
                raise RequestError(f"stack.file: {path}: {name} is in {said}; it is in {unit or '1'} here")
        return Slave(archive, tuple(name for name in wanted if name in known),
                     tuple(name for name in _ORDERED if name in known), targets)  # fmt: skip

    def __call__(self, scene: Scene) -> Master:
        """Its instances, from a first scene on.

        Raises:
            RequestError: more ships than it takes, or runs than it can be at once.
        """
        runs, ships = scene.x.shape
        if ships - 1 > self.targets:
            raise RequestError(f"stack.file: the FMU takes {self.targets} targets, {ships - 1} are met")
        if runs > 1 and self.archive.once:
            raise RequestError("stack.file: the FMU allows one instance in a process; many runs need one each")
        return _Instances(self, scene)


class _Instances:
    """An FMU in each run, stepped between looks."""

    def __init__(self, slave: Slave, scene: Scene) -> None:
        self._slave, self._t = slave, scene.t
        begun = self._inputs(scene)
        self._live: list[Live | None] = [
            slave.archive.live(f"run {k}", scene.t, dict(zip(slave.inputs, begun[k].tolist(), strict=True)))
            for k in range(len(scene.x))
        ]

    def look(self, scene: Scene) -> Orders:
        """Orders after a step on what is seen now; NaN where the FMU failed, now or before."""
        psi, speed = np.full((2, len(scene.x)), np.nan)
        given = self._inputs(scene)
        for k, one in enumerate(self._live):
            if one is None:
                continue
            try:
                one.set(dict(zip(self._slave.inputs, given[k].tolist(), strict=True)))
                one.step(self._t, STEP)
                said = dict(zip(self._slave.outputs, one.got(self._slave.outputs), strict=True))
                psi[k], share = said["order.psi"], said.get("order.speed", 1.0)
                speed[k] = share if math.isfinite(share) else math.nan
            except Exception:
                self._live[k] = None
        self._t += STEP
        return Orders(psi, speed)

    def _inputs(self, scene: Scene) -> Array:
        """Values of the inputs, shape (runs, inputs); targets are in the order of the case, the same at each look."""
        values: dict[str, Array] = {}
        for name in ("x", "y", "psi", "north", "east"):
            whole = getattr(scene, name)
            values[f"own.{name}"] = whole[:, 0]
            values |= {f"target[{k}].{name}": whole[:, k] for k in range(1, whole.shape[1])}
        away = np.hypot(scene.x - scene.x[:, :1], scene.y - scene.y[:, :1]) < 0.5 * UNSEEN
        for k in range(1, self._slave.targets + 1):
            here = k < len(scene.L)
            values[f"target[{k}].valid"] = away[:, k].astype(np.float64) if here else np.zeros(len(scene.x))
            values[f"target[{k}].L"] = np.full(len(scene.x), scene.L[k] if here else 0.0)
        none = np.zeros(len(scene.x))
        return np.column_stack([values.get(name, none) for name in self._slave.inputs])
