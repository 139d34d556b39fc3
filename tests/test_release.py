"""A release: one version everywhere, bounds of the recipe as of the project, sizes of wheel and core install held."""

from __future__ import annotations

import importlib
import io
import re
import sys
import tomllib
import zipfile
from importlib.metadata import distribution, requires

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from house import REPOSITORY, ROOT
from seatrial.core.version import __version__

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = yaml.safe_load((REPOSITORY / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
CHANGES = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")
PAGE = (REPOSITORY / "docs" / "development.md").read_text(encoding="utf-8")
WHEEL, INSTALLED = 5.0, 700.0
"""Most that a wheel and an install without extras may take [MB]."""


def test_one_version_stands_everywhere() -> None:
    citation = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))
    assert {PROJECT["version"], str(citation["version"]), RECIPE["context"]["version"]} == {__version__}
    newest = re.search(r"^## (\d+\.\d+\.\d+)", CHANGES, re.MULTILINE)
    assert newest is not None
    assert newest[1] == __version__


def test_the_recipe_asks_for_what_the_project_asks_for() -> None:
    asked = {canonicalize_name(one.name): one.specifier for one in map(Requirement, PROJECT["dependencies"])}
    run = [Requirement(re.sub(r" (?=[<>=])", "", one)) for one in RECIPE["requirements"]["run"]]
    told = {one.name: one.specifier for one in run}
    assert told.pop("python") == PROJECT["requires-python"]
    assert told == asked


def core() -> dict[str, str]:
    """Distributions that an install without extras brings, by canonical name, and the version here."""
    found: dict[str, str] = {}
    todo = [Requirement(one) for one in PROJECT["dependencies"]]
    while todo:
        one = todo.pop()
        name = canonicalize_name(one.name)
        if name not in found and (one.marker is None or one.marker.evaluate({"extra": ""})):
            found[name] = distribution(name).version
            todo += map(Requirement, requires(name) or ())
    return found


@pytest.mark.slow
def test_the_wheel_is_small() -> None:
    """Of the package as a wheel has it, deflated; docs/development.md says the size."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path in sorted(ROOT.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                wheel.write(path, path.relative_to(ROOT))
    size = packed.tell() / 1e6
    assert size <= WHEEL
    assert stated("wheel") == pytest.approx(size, rel=0.15)


@pytest.mark.slow
def test_an_install_without_extras_is_of_bounded_size() -> None:
    size = sum(one.size or 0 for name in core() for one in distribution(name).files or ()) / 1e6
    assert 50.0 < size <= INSTALLED
    assert stated("core install") == pytest.approx(size, rel=0.25)


@pytest.mark.slow
def test_the_bill_of_materials_has_what_an_install_brings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(REPOSITORY / "docs" / "site"))
    bill = importlib.import_module("sbom").bill()
    sys.modules.pop("sbom")
    assert {one["name"]: one["version"] for one in bill["components"]} == core()
    assert (bill["bomFormat"], bill["specVersion"], bill["metadata"]["component"]["name"]) == (
        "CycloneDX", "1.5", "seatrial")  # fmt: skip
    refs = [one["bom-ref"] for one in [bill["metadata"]["component"], *bill["components"]]]
    assert len(set(refs)) == len(refs)
    assert {one["ref"] for one in bill["dependencies"]} == set(refs)
    assert {on for one in bill["dependencies"] for on in one["dependsOn"]} == set(refs[1:])
    without = [one["name"] for one in bill["components"] if not one.get("licenses")]
    assert without == []


def stated(what: str) -> float:
    """MB that the page states."""
    found = re.search(rf"^\| {what} \| ([\d.]+) MB", PAGE, re.MULTILINE)
    assert found is not None, f"docs/development.md: no row '| {what} | N MB'"
    return float(found[1])
