"""`seatrial` and `python -m seatrial`: the command line.

The one thing done here is what must be done before NumPy is loaded: its linear algebra on one thread.
The matrices of a fit are small; threads that wait for one another by spinning made a fit of half a
second last fifteen on a machine that was busy with something else.
"""

import os
import signal
import sys

_INTERRUPTED = 130
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> int:
    """Run the command line; returns the exit status."""
    try:
        from .cli.app import main as run

        status = run()
    except KeyboardInterrupt:  # before there is a command line to say so
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stderr.write("interrupted\n")
        status = _INTERRUPTED
    if status == _INTERRUPTED:  # at once: threads of a fit that are still at work are not waited for
        sys.stderr.flush()
        os._exit(status)
    return status


if __name__ == "__main__":
    sys.exit(main())
