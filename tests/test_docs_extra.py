"""The site is built from a fresh clone: whatever its pages import comes with the extra `docs`."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from house import REPOSITORY

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Pages of the Python interface, with every module refused that is not installed by then.
PAGES = """
import sys, tempfile
from pathlib import Path

refused = set(sys.argv[2].split(","))

class Refusing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in refused:
            raise ImportError(f"not installed: {name}")

sys.meta_path.insert(0, Refusing())
sys.path.insert(0, sys.argv[1])
import api
with tempfile.TemporaryDirectory() as out:
    print(",".join(api.write(Path(out))))
"""


def installed(extra: str) -> set[str]:
    """Distributions that `pip install seatrial[extra]` brings here, those that they need included."""
    found, todo = {"pip", "setuptools"}, [(Requirement(f"seatrial[{extra}]"), "")]
    while todo:
        wanted, own = todo.pop()
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": own}):
            continue
        name = canonicalize_name(wanted.name)
        if name == "seatrial":
            extras = PROJECT["optional-dependencies"]
            todo += [(Requirement(one), "") for e in wanted.extras for one in extras[e]]
            todo += [(Requirement(one), "") for one in PROJECT["dependencies"]]
        elif name not in found:
            found.add(name)
            try:
                todo += [(Requirement(one), e) for one in requires(name) or () for e in ("", *wanted.extras)]
            except PackageNotFoundError:
                continue
    return found


@pytest.mark.slow
def test_the_pages_of_the_interface_need_the_extra_docs_and_no_other() -> None:
    there = installed("docs")
    refused = {module for module, owners in packages_distributions().items()
               if module != "seatrial" and not {canonicalize_name(one) for one in owners} & there
               and module.isidentifier() and not module.startswith("_")}  # fmt: skip
    assert "torch" in refused, "the closure takes in everything; nothing would be found"
    told = subprocess.run(
        [sys.executable, "-c", PAGES, str(REPOSITORY / "docs" / "site"), ",".join(refused)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr[-500:]
    assert {"envs", "campaign", "seatrial"} <= set(told.stdout.strip().split(","))
