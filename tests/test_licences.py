"""Licences of what the package needs: open ones, or the exceptions that docs/development.md names."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, distribution

import pytest

from house import REPOSITORY

OPEN = re.compile(r"\b(MIT|BSD|ISC|Apache|PSF|Python Software Foundation|MPL|Mozilla|HPND)\b")
# Weaker or closed ones, each with the reason that the page gives.
EXCEPTIONS = {"casadi": "LGPL", "nvidia-cuda-nvrtc": "NVIDIA",
              "fmpy": "", "python-can": "LGPL", "pymavlink": "LGPL"}  # fmt: skip
PAGE = (REPOSITORY / "docs" / "development.md").read_text(encoding="utf-8")


def needed() -> dict[str, str]:
    """Direct dependencies of the package and of its extras, by the extra that asks for them."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = {"": project["dependencies"], **project["optional-dependencies"]}
    return {
        re.split(r"[\[<>=!~; ]", one, maxsplit=1)[0].lower(): extra
        for extra, some in asked.items() if extra not in ("all", "test", "docs", "bench") for one in some
    }  # fmt: skip


def licence(name: str) -> str:
    """What a distribution says of its licence: expression, text's first line, and classifiers."""
    said = distribution(name).metadata
    first = (said.get("License") or "").strip().partition("\n")[0]
    classes = [one.rpartition(" :: ")[2] for one in said.get_all("Classifier") or () if one.startswith("License ::")]
    return "; ".join(filter(None, (said.get("License-Expression"), first, *classes)))


@pytest.mark.parametrize("name", sorted(needed()))
def test_a_dependency_is_open_or_a_named_exception(name: str) -> None:
    try:
        said = licence(name)
    except PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    if name in EXCEPTIONS and not OPEN.search(said):
        assert EXCEPTIONS[name] in said.replace("Lesser General Public License", "LGPL"), said
        assert f"`{name}`" in PAGE, f"{name} ({said}) is not named in docs/development.md"
        return
    assert OPEN.search(said), f"{name}: {said}"
    assert not re.search(r"\bA?GPL", said), f"{name}: {said}"


def test_what_is_needed_without_extras_lets_a_closed_program_use_it() -> None:
    """LGPL of CasADi allows it; nothing else that is always installed has conditions beyond notices."""
    weaker = {name for name, extra in needed().items() if not extra and not OPEN.search(licence(name))}
    assert weaker <= {"casadi"}
