"""`seatrial` and `python -m seatrial`: the command line.

The one thing done here is what must be done before NumPy is loaded: its linear algebra on one thread.
The matrices of a fit are small; threads that wait for one another by spinning made a fit of half a
second last fifteen on a machine that was busy with something else.
"""

import os
import signal
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> int:
    """Run the command line; returns the exit status."""
    try:
        from .cli import main as run

        return run()
    except KeyboardInterrupt:  # before there is a command line to say so
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stderr.write("interrupted\n")
        return 130


if __name__ == "__main__":
    sys.exit(main())
