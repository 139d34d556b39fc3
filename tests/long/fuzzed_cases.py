"""Safety cases, and programs aboard: FMUs whose description is mutated, systems of the Open Simulation Platform."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "realtime"))

from machines import (  # noqa: E402
    ENGINE,
    ENGINE_REALS,
    GOVERNOR,
    GOVERNOR_REALS,
    KEEPER,
    KEEPER_REALS,
    SYSTEM,
)  # fmt: skip

from fmus import fmu  # noqa: E402
from seatrial.cli.app import main  # noqa: E402

Kind = tuple[Callable[[Path], Path], Callable[[Path, Path], list[str]]]
_CASE = """schema = "seatrial-case/1"
claim = "it keeps clear"
ship = "kvlcc2_l7"
stack = "{stack}"
traffic = ["ignores"]
[encounters]
roles = ["give-way"]
runs = 2
{more}"""
_SENSORS = """[weather]
wind = [0.0, 3.0]
current = [0.0, 0.1]
[sensors.radar]
"""
_RARE = """[rare]
breach = "contact"
runs = 100
"""


def said(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def _case(stack: str = "rules", more: str = "") -> Callable[[Path], Path]:
    return lambda folder: said(folder, "case.toml", _CASE.format(stack=stack, more=more))


def _argued(pattern: str) -> Callable[[Path], Path]:
    """A file that a case has left."""

    def made(folder: Path) -> Path:
        file = _case("ignores", _RARE)(folder)
        assert main(["case", str(file), "-o", str(folder / "argued"), "--json"]) == 0
        return sorted((folder / "argued").glob(pattern))[0]

    return made


def _verified(file: Path, _: Path) -> list[str]:
    return ["case", "--verify", str(file.parent)]


def _onward(file: Path, _: Path) -> list[str]:
    return ["case", str(file.parents[1] / "case.toml"), "-o", str(file.parent), "--json"]


_SCENE = """schema = "seatrial-scenario/1"
duration = 3
rate = 10.0
[own]
ship = "kvlcc2"
pilot = "none"
"""
_ABOARD = """[[fmu]]
file = "engine.fmu"
reads = { ordered = "n_P_cmd" }
gives = { shaft = "n_P" }
start = { tau = 4 }
"""


def _engine(folder: Path) -> Path:
    """The description of an engine's FMU, which `_aboard` packs again."""
    whole = fmu(folder, "engine", ENGINE, ENGINE_REALS)
    with zipfile.ZipFile(whole) as archive:
        archive.extractall(folder / "inside")
    said(folder, "scene.toml", _SCENE + _ABOARD)
    return folder / "inside" / "modelDescription.xml"


def _aboard(file: Path, _: Path) -> list[str]:
    folder = file.parents[1]
    with zipfile.ZipFile(folder / "engine.fmu", "w") as archive:
        for one in sorted(file.parent.rglob("*")):
            archive.write(one, one.relative_to(file.parent))
    return _sailed(folder / "scene.toml", "engine")


def _scene(folder: Path) -> Path:
    fmu(folder, "engine", ENGINE, ENGINE_REALS)
    return said(folder, "scene.toml", _SCENE + _ABOARD)


def _system(folder: Path) -> Path:
    for stem, body, reals in (("engine", ENGINE, ENGINE_REALS), ("keeper", KEEPER, KEEPER_REALS),
                              ("governor", GOVERNOR, GOVERNOR_REALS)):  # fmt: skip
        fmu(folder, stem, body, reals)
    said(folder, "scene.toml", _SCENE + '[system]\nfile = "system.xml"\nship = "vessel"\n')
    return said(folder, "system.xml", SYSTEM)


def _sailed(scene: Path, *trusted: str) -> list[str]:
    return ["range", str(scene), "--json", *(word for one in trusted for word in ("--trust", one))]


CASES: dict[str, Kind] = {
    "case": (_case(), lambda file, out: ["case", str(file), "-o", str(out), "--json"]),
    "case, weather and sensors": (_case("ignores", _SENSORS), lambda file, out: ["case", str(file), "-o", str(out)]),
    "case, rare": (_case("ignores", _RARE), lambda file, out: ["case", str(file), "-o", str(out)]),
    "case, signed": (_argued("case.json"), _verified),
    "case, part": (_argued("*part*"), _verified),
    "case, levels": (_argued("rare.json"), _onward),
    "fmu aboard, description": (_engine, _aboard),
    "fmu aboard, scenario": (_scene, lambda file, _: _sailed(file, "engine")),
    "system of the platform": (_system, lambda file, _: _sailed(file.with_name("scene.toml"), "engine", "keeper",
                                                                "governor")),
}  # fmt: skip
