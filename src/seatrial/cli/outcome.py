"""How a command ends: what went wrong in one line, and the exit status; Ctrl-C is reported once and obeyed at once."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
import warnings
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import Any

from click.exceptions import Exit

from ..core.errors import RunError, SeatrialError
from .render import fault, note_warning

WRONG, FAILED, INTERRUPTED, PIPE = 2, 1, 130, 141
# How long an interrupt may be on its way before it is taken to be lost [s].
_AGAIN = 0.5
# What a disk does to a request that was right: it is full, or fails.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


def ended(command: Any, arguments: Sequence[str]) -> int:
    """Run a command of the framework; what went wrong is reported in one line.

    Returns:
        0 done, 1 the run failed, 2 the request was wrong, 130 interrupted, 141 the reader of the output has left.
    """
    warnings.showwarning = note_warning
    if sys.stdout is None:
        fault("error: standard output is closed; redirect it to a file or to /dev/null")
        return WRONG
    with _interruptible():
        try:
            status = _run(command, list(arguments))
            sys.stdout.flush()
        except KeyboardInterrupt as error:
            _heard()
            fault(str(error) or "interrupted")
            return INTERRUPTED
        except BrokenPipeError:
            _give_up_output()
            return PIPE
        except Exception as error:
            return _status(error)
    return status


def _run(command: Any, arguments: list[str]) -> int:
    """The command without the framework's own handling of Ctrl-C, which writes to the terminal and hides it."""
    try:
        with command.make_context("seatrial", arguments[:] or ["--help"]) as context:  # it empties what it is given
            command.invoke(context)
    except Exit as done:
        return int(done.exit_code) if arguments else WRONG
    return 0


@contextmanager
def _interruptible() -> Generator[None, None, None]:
    """The first Ctrl-C ends what runs; a second one, which finds it still cleaning up, ends the process.

    Libraries in C sometimes swallow the exception of the first.  So a timer raises it again until it is on its way:
    until then no exception is being handled that stems from it.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is not signal.default_int_handler:
        yield
        return
    heard: list[int] = []

    def stop(number: int, frame: Any) -> None:
        if heard:
            os.write(2, b"interrupted\n")
            os._exit(INTERRUPTED)
        heard.append(number)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN, _AGAIN)
        raise KeyboardInterrupt

    def again(number: int, frame: Any) -> None:
        error = sys.exception()
        while error is not None:
            if isinstance(error, KeyboardInterrupt):
                return
            error = error.__context__
        raise KeyboardInterrupt

    signal.signal(signal.SIGALRM, again)
    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        if not heard:
            signal.signal(signal.SIGINT, before)


def _heard() -> None:
    """Ctrl-C is answered: a further one ends the process without a message."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        signal.signal(signal.SIGINT, lambda number, frame: os._exit(INTERRUPTED))


def _give_up_output() -> None:
    """Standard output has no reader: keep the interpreter from trying again when it ends."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):  # not a file of its own
        sys.stdout = None


def _status(error: Exception) -> int:
    """One line to standard error for what is known to go wrong; anything else is a fault of ours."""
    usage = getattr(error, "format_message", None)
    if usage is not None:
        fault(f"error: {usage()} (seatrial --help)")
    elif isinstance(error, OSError) and error.errno is not None:
        if error.filename is None and _no_room(error):
            _give_up_output()
        fault(f"error: {error.filename or 'standard output'}: {error.strerror}")
    elif isinstance(error, SeatrialError):
        fault(f"error: {error}")
    else:
        raise error
    return FAILED if isinstance(error, RunError) or _no_room(error) else WRONG


def _no_room(error: BaseException | None) -> bool:
    """Whether a full or failing disk is what lies behind an error."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _NO_ROOM:
            return True
        error = error.__cause__ or error.__context__
    return False
