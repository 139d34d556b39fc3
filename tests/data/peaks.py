"""The real command in a process of its own, whose peak of memory is measured; a time limit only ends it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

MEMORY, KILL = 500e6, 120.0
DRIVER = (
    "import sys\nfrom seatrial.cli.app import main\nstatus = main(sys.argv[1:])\n"
    "with open('/proc/self/status') as told:\n"
    "    print('PEAK', next(line.split()[1] for line in told if line.startswith('VmHWM')), file=sys.__stderr__)\n"
    "sys.exit(status)"
)


def peak(arguments: list[str], folder: Path) -> tuple[int, float, str]:
    """Exit status, peak of memory [bytes], and what was said, of a command."""
    ran = subprocess.run([sys.executable, "-c", DRIVER, *arguments], cwd=folder, capture_output=True, text=True,
                         timeout=KILL, check=False)  # fmt: skip
    found = re.search(r"PEAK (\d+)\n?", ran.stderr)
    assert found is not None, ran.stderr[-400:]
    return ran.returncode, 1024.0 * int(found[1]), ran.stderr.replace(found[0], "")
