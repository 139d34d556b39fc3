"""Bill of materials (CycloneDX 1.5, JSON) of what an install brings, from the metadata of what is installed here.

usage: python docs/site/sbom.py FILE.json [EXTRA ...]; without an extra that of the core
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, distribution, requires
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

NAME = "seatrial"


def bill(extras: Sequence[str] = ()) -> dict[str, Any]:
    """The document: components with version, licence and package URL, and who needs whom.

    Args:
        extras: of the project; what of them is not installed here is listed without a version.
    """
    needed: dict[str, list[str]] = {}
    todo = [(NAME, tuple(extras))]
    while todo:
        name, wanted = todo.pop()
        if name in needed:
            continue
        asked = [one for one in map(Requirement, _asked(name)) if _applies(one, wanted)]
        needed[name] = sorted({canonicalize_name(one.name) for one in asked})
        todo += [(canonicalize_name(one.name), tuple(one.extras)) for one in asked]
    own = _component(NAME, "application")
    parts = [_component(name, "library") for name in sorted(needed) if name != NAME]
    refs = {one["name"]: one["bom-ref"] for one in [own, *parts]}
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json", "bomFormat": "CycloneDX", "specVersion": "1.5",
        "version": 1, "metadata": {"component": own}, "components": parts,
        "dependencies": [{"ref": refs[name], "dependsOn": [refs[one] for one in some]}
                         for name, some in sorted(needed.items())],
    }  # fmt: skip


def _asked(name: str) -> list[str]:
    try:
        return requires(name) or []
    except PackageNotFoundError:
        return []


def _applies(one: Requirement, extras: Sequence[str]) -> bool:
    return one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in ("", *extras))


def _component(name: str, kind: str) -> dict[str, Any]:
    try:
        found = distribution(name)
    except PackageNotFoundError:
        return {"type": kind, "name": name, "bom-ref": f"pkg:pypi/{name}"}
    url = f"pkg:pypi/{name}@{found.version}"
    said = {"type": kind, "name": name, "version": found.version, "purl": url, "bom-ref": url}
    return said | ({"licenses": licences} if (licences := _licences(found.metadata)) else {})


def _licences(metadata: Any) -> list[dict[str, Any]]:
    """The expression of a distribution, else its classifiers, else the first line of its text."""
    if expression := metadata.get("License-Expression"):
        return [{"expression": expression}]
    classes = [one.rpartition(" :: ")[2] for one in metadata.get_all("Classifier") or ()
               if one.startswith("License ::")]  # fmt: skip
    names = classes or [line for line in (metadata.get("License") or "").strip().splitlines()[:1] if line]
    return [{"license": {"name": one}} for one in dict.fromkeys(names)]


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(bill(sys.argv[2:]), indent=1) + "\n", encoding="utf-8")
    print(path)
