"""Error classes of the package, with one base.

Every error that is raised on purpose is a `SeatrialError`: its text is one line for the user that says what is wrong,
where, and what would be right.  It is either a `RequestError` (exit status 2: the request was wrong, nothing has been
done) or a `RunError` (exit status 1: the request was right and the run failed).  The rooms export the classes that
they raise.
"""

from __future__ import annotations

import signal
import tomllib
from typing import Literal

__all__ = [
    "AccessError", "BusyError", "CampaignError", "ChartError", "ClusterError",
    "CommandError", "CompilerError", "DataError", "DeviceError",
    "FitError", "HopelessError", "LoopError", "MissingError", "NmeaError", "NoTorchError",
    "ParameterError", "Reason", "RefusalError", "ReportError",
    "RequestError", "ResumeError", "RunError", "SeatrialError", "SensorError", "ShipError", "SimulationError",
    "StudyError", "TaskError", "TomlError", "UsageError", "WeatherError", "WireError",
    "first_line", "obeyed",
]  # fmt: skip

Reason = Literal["length", "form", "checksum", "kind", "field"]


def obeyed() -> None:
    """Stop the timer that repeats a Ctrl-C until it is handled (the command line sets it)."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)


def first_line(error: BaseException, most: int = 200) -> str:
    """What another program's error says, in one line of at most so many characters; its kind where it says nothing."""
    return ((str(error).splitlines() or [""])[0] or type(error).__name__)[:most]


class SeatrialError(Exception):
    """Base of the errors of the package; the text is one line for the user."""


class RequestError(SeatrialError, ValueError):
    """The request was wrong: a file, a key, a value, an option."""


class RunError(SeatrialError, RuntimeError):
    """The request was right and the run failed."""


class ParameterError(RequestError):
    """A parameter path, value or interval that cannot be used."""


class TomlError(RequestError, tomllib.TOMLDecodeError):
    """A TOML file that cannot be read; the text states the reason in one line."""

    def __init__(self, text: str) -> None:
        ValueError.__init__(self, text)


class AccessError(RequestError):
    """A request to a page or a link without the key that it asks for."""


class BusyError(RequestError):
    """A folder that another process works in; the text names the process."""


class CampaignError(RequestError):
    """A campaign that cannot be carried out as it is, or a folder that holds another one."""


class DataError(RequestError):
    """A log or a trial that cannot be used: what, where and what would be right, in one line whatever the log holds."""

    def __init__(self, text: str = "") -> None:
        line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
        super().__init__(line if len(line) <= 1200 else f"{line[:800]} ... {line[-300:]}")


class MissingError(DataError, KeyError):
    """A channel, an index or a parameter that there is not; the text has the near names."""

    __str__ = Exception.__str__


class TrackError(DataError):
    """A log of instruments without time, heading, position and rate of turn: a folder of others can do without it."""


class NmeaError(DataError):
    """A sentence or a datagram that is not valid.

    Attributes:
        reason: "length", "form", "checksum", "kind" (valid, but not supported by seatrial) or "field".
    """

    def __init__(self, text: str, reason: Reason) -> None:
        super().__init__(text)
        self.reason: Reason = reason


class ChartError(RequestError):
    """A chart, a fender or a place in a harbour that cannot be; the text says where and what would be right."""


class WeatherError(RequestError):
    """Weather that cannot be made; the text says what and what would be right."""


class ShipError(RequestError):
    """A ship file that cannot be used; the text names the file, the key and what would be right."""


class SensorError(RequestError):
    """A sensor of a channel that the run does not have, or with an impossible figure."""


class StudyError(RequestError):
    """A study that cannot be run; the text names the key and what would be right."""


class HopelessError(StudyError):
    """Chains that would not agree by their end."""


class NoTorchError(StudyError):
    """PyTorch is absent or fails to load, so that no network can be trained here; other fits can be made."""


class ResumeError(StudyError):
    """A checkpoint of another problem."""


class ReportError(RequestError):
    """A report that cannot be written; the text states the reason."""


class LoopError(RequestError):
    """A loop that cannot run as asked; the text says what would be right."""


class CommandError(RequestError):
    """An order that no ship can take: no such control, or no number."""


class WireError(RequestError):
    """An address that cannot be used; the text says what would be right."""


class RefusalError(RequestError):
    """A request to the bridge page that is not carried out; the text states the reason."""


class TaskError(RequestError):
    """A task or a setting of an environment that cannot be; the text says what would be right."""


class UsageError(RequestError):
    """A command that cannot be carried out; the text names what, where and the alternatives."""


class DeviceError(RequestError):
    """A device that is not here, or that cannot do what is asked; the text names what is missing."""


class CompilerError(RunError):
    """No kernel can be made on this machine; the text states the reason."""


class SimulationError(RunError):
    """A run that left the finite or the valid; the text names time, state and lane.

    Attributes:
        time: when it did [s], where known.
    """

    def __init__(self, text: str, time: float | None = None) -> None:
        super().__init__(text)
        self.time = time


class ClusterError(RunError):
    """The cluster was lost while it worked; what it had finished is kept."""


class FitError(RunError):
    """An estimation that failed; the text states why and where."""
