"""A short soak in real time beside a loaded core: every step, on time, in the same memory, and the same again."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long
SCRIPT = Path(__file__).with_name("soak.py")


def test_twenty_seconds_at_twenty_hertz():
    done = subprocess.run([sys.executable, str(SCRIPT), "20"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout)
    assert found["ticks"] == 400
    assert found["clipped"] >= 1
