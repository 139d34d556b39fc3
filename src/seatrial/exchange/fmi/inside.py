"""FMUs of others: an archive as a value, and live instances of it, for co-simulation by FMI 2.0 or 3.0.

FMPy reads and loads them (extra `fmi`).  An FMU is a program: whoever runs it trusts it, as SECURITY.md says.
"""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core.errors import RequestError, RunError
from ...core.values import dataclass
from ...ships.numbers import FACTORS

_TOLD = {"rev/min": "rpm", "r/min": "rpm", "1/min": "rpm", "Hz": "1/s", "knot": "kn", "kt": "kn"}
"""Other spellings of units of `ships.numbers`."""


@dataclass(frozen=True, eq=False)
class Archive:
    """An FMU, unpacked.

    Attributes:
        path: its file.
        description: what it says of itself, by FMPy.
        folder: into which it was unpacked; it goes with this value.
    """

    path: Path
    description: Any
    folder: str

    @staticmethod
    def of(path: Path, where: str) -> Archive:
        """The FMU of a file.

        Args:
            where: the key that names it, for messages.

        Raises:
            RequestError: no such file, no FMU, or none for co-simulation by FMI 2.0 or 3.0; FMPy is missing.
        """
        try:
            import fmpy
        except ImportError:
            raise RequestError(f"{where}: an FMU needs the extra 'fmi': pip install 'seatrial[fmi]'") from None
        if not path.is_file():
            raise RequestError(f"{where}: {path}: no such file")
        try:
            told = fmpy.read_model_description(str(path))
            kept = tempfile.mkdtemp(prefix="seatrial-fmu-")
            weakref.finalize(told, shutil.rmtree, kept, True)
            fmpy.extract(str(path), unzipdir=kept)
        except Exception as error:
            raise RequestError(f"{where}: {path}: not an FMU: {' '.join(str(error).split())[:200]}") from None
        if told.coSimulation is None or not str(told.fmiVersion).startswith(("2.", "3.")):
            raise RequestError(f"{where}: {path}: not for co-simulation by FMI 2.0 or 3.0")
        return Archive(path, told, kept)

    @property
    def variables(self) -> Mapping[str, Any]:
        """Its variables by name, as FMPy has them."""
        return {one.name: one for one in self.description.modelVariables}

    @property
    def outputs(self) -> frozenset[str]:
        """Names of its outputs."""
        return frozenset(name for name, one in self.variables.items() if one.causality == "output")

    @property
    def once(self) -> bool:
        """Whether a process can have one instance only."""
        return bool(self.description.coSimulation.canBeInstantiatedOnlyOncePerProcess)

    def unit(self, name: str) -> str:
        """Unit of a variable as seatrial spells it; empty where it says none."""
        told = self.variables[name].unit or ""
        return _TOLD.get(told, told)

    def factor(self, name: str, wanted: str) -> float:
        """What a value of a real variable is multiplied by to be in an SI unit; "-" where that is not known.

        Raises:
            RequestError: the variable is in a unit of another kind.
        """
        said = self.unit(name)
        if said in ("", "1", wanted) or wanted == "-":
            return 1.0
        if (said, wanted) not in FACTORS:
            known = ", ".join([wanted, *(one for one, unit in FACTORS if unit == wanted)])
            raise RequestError(f"{self.path.name}: {name} is in {said}; it must be in {known}")
        return FACTORS[said, wanted]

    def live(self, name: str, t: float, start: Mapping[str, float]) -> Live:
        """An instance that begins at a time [s] with values of its own variables.

        Raises:
            RunError: it does not start.
        """
        try:
            return Live(self, name, t, start)
        except Exception as error:
            raise RunError(f"{self.path.name} does not start: {' '.join(str(error).split())[:200]}") from None


class Live:
    """An instance of an FMU; whoever made it ends it."""

    def __init__(self, archive: Archive, name: str, t: float, start: Mapping[str, float]) -> None:
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        told = archive.description
        self._three = str(told.fmiVersion).startswith("3.")
        self._known = archive.variables
        one: Any = (FMU3Slave if self._three else FMU2Slave)(
            guid=told.guid, modelIdentifier=told.coSimulation.modelIdentifier, unzipDirectory=archive.folder,
            instanceName=name)  # fmt: skip
        one.instantiate()
        self._one: Any = one
        if self._three:
            one.enterInitializationMode(startTime=t)
        else:
            one.setupExperiment(startTime=t)
            one.enterInitializationMode()
        self.set(start)
        one.exitInitializationMode()

    def set(self, values: Mapping[str, float]) -> None:
        """Give real variables by name these values."""
        if values:
            places = [self._known[name].valueReference for name in values]
            (self._one.setFloat64 if self._three else self._one.setReal)(places, list(values.values()))

    def got(self, names: Sequence[str]) -> list[float]:
        """Values of real variables by name."""
        if not names:
            return []
        places = [self._known[name].valueReference for name in names]
        return [float(value) for value in (self._one.getFloat64 if self._three else self._one.getReal)(places)]

    def step(self, t: float, by: float) -> None:
        """Move on from a time by a step [s]; whatever FMPy raises: it failed, and does nothing more."""
        try:
            self._one.doStep(currentCommunicationPoint=t, communicationStepSize=by)
        except Exception:
            self._one = None  # after an error that may have been fatal not even its end may be called
            raise

    def end(self) -> None:
        """Terminate and free it."""
        if self._one is not None:
            one, self._one = self._one, None
            one.terminate()
            one.freeInstance()

    __del__ = end
