"""The unit tier with the lowest and with the newest versions that pyproject.toml allows; takes half an hour each."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long
SCRIPT = Path(__file__).parents[2] / ".ci" / "versions"


def reachable(folder: Path) -> bool:
    """Whether pip gets a small package from whatever index it is set up for."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(folder), "iniconfig"]
    return subprocess.run(command, capture_output=True, check=False, timeout=60).returncode == 0


@pytest.mark.parametrize("which", ["lowest", "newest"])
def test_the_unit_tier_passes_with(which: str, tmp_path: Path) -> None:
    if not reachable(tmp_path):
        pytest.skip("no package index can be reached: the versions cannot be installed")
    done = subprocess.run([sys.executable, str(SCRIPT), which], capture_output=True, text=True, check=False)
    if done.returncode and done.stderr.startswith("no Python for"):
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
