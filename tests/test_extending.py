"""docs/extending.md, block by block: each extension stands where its first line says, and does what the page says."""

from __future__ import annotations

import importlib
import json
import math
import re
import textwrap
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rooms import rooms
from seatrial.cli.app import main
from seatrial.core.parameters import near, read
from seatrial.data import Trial
from seatrial.data.trialfile import read_trial
from seatrial.environment import CALM
from seatrial.forces import Flow
from seatrial.identify import Fit, Loss, Problem
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors.stream import Errors
from seatrial.sensors.suite import Suite
from seatrial.ships.files import FOLDER, load
from seatrial.simulate.run import simulate
from seatrial.study.study import read_estimator
from seatrial.testing import Log, Part, check_force, check_format
from seatrial.validate.requirements.probe import Probe
from seatrial.workflow import simulation

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


def blocks() -> dict[str, list[str]]:
    """Blocks of code of the page by the file that their first line names."""
    found: dict[str, list[str]] = {}
    for text in re.findall(r"^  ```(?:python|toml)\n(.*?)^  ```$", PAGE, re.DOTALL | re.MULTILINE):
        text = textwrap.dedent(text)
        first = text.partition("\n")[0]
        found.setdefault(first.removeprefix("# ").removesuffix(", in part"), []).append(text)
    return found


BLOCKS = blocks()
Put = Callable[[str], Any]


@pytest.fixture
def put(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Put]:
    """Puts a module of the page into its room, as a file; gives the module."""
    with rooms(tmp_path, monkeypatch) as made:
        yield lambda file: made.put(file, BLOCKS[file][0])


def within(file: str, module: str) -> dict[str, Any]:
    """A part of a module of the package, with what that module has at hand."""
    names = dict(vars(importlib.import_module(f"seatrial.{module}")))
    exec(BLOCKS[file][0], names)
    return names


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Tables with others laid over them."""
    out = dict(below)
    for key, value in above.items():
        inner = isinstance(value, Mapping) and isinstance(below.get(key), Mapping) and "value" not in value
        out[key] = merged(below[key], value) if inner and "prime" not in value else value
    return out


def written(path: Path, tables: Mapping[str, Any]) -> Path:
    import tomlkit

    path.write_text(tomlkit.dumps(dict(tables)), encoding="utf-8")
    return path


def test_every_kind_of_extension_of_the_page_has_code() -> None:
    kinds = re.findall(r"^- \*\*(An? [\w ]+|Weather)\*\*", PAGE, re.MULTILINE)
    assert len(kinds) >= 10
    nowhere = [file for file in BLOCKS if not re.search(r"\.(py|toml)$|^seatrial import", file)]
    assert not nowhere, "a block without a file"


def test_a_ship_file(tmp_path: Path) -> None:
    below = tomllib.loads((FOLDER / "kvlcc2_l7.toml").read_text(encoding="utf-8"))
    ship = load(written(tmp_path / "mine.toml", merged(below, tomllib.loads(BLOCKS["ships/mine.toml"][0]))))
    assert ship.model.controls == ("n_P", "delta", "n_bow")
    assert read(ship.model, "hull.Y_v") == pytest.approx(read(load("kvlcc2_l7").model, "hull.Y_v"), rel=1e-9)
    assert ship.actuators.rudder.dead_time == 0.2


@pytest.mark.slow
def test_a_force_of_its_own(put: Put, tmp_path: Path) -> None:
    module = put("forces/skeg.py")
    check_force(Part(module.EXAMPLES[0], rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0))
    skeg = module.Skeg(area=4.0, slope=1.5, x=-150.0)
    flow = Flow(5.0, 0.5, 0.01, 0.0, 0.0, 0.0, 0.0, 1000.0, 320.0, 20.0)
    assert tuple(skeg.force(flow)) == pytest.approx(
        (0.0, 3000.0 * math.hypot(5.0, 1.0), -150.0 * 3000.0 * math.hypot(5.0, 1.0)), rel=1e-6
    )
    below = tomllib.loads((FOLDER / "kvlcc2.toml").read_text(encoding="utf-8"))
    ship = load(written(tmp_path / "mine.toml", merged(below, tomllib.loads(BLOCKS["ships/mine.toml"][1]))))
    at = (0.0, 0.0, 0.0, 7.0, 0.5, 0.01)
    bare = load("kvlcc2")

    with_fin, without = (one.model.derivative(at, (1.5, 0.0), CALM) for one in (ship, bare))
    assert with_fin[5] != without[5]
    assert with_fin[4] > without[4], "at the stern the ship slides to port: the fin pushes it to starboard"


def test_a_family(put: Put, tmp_path: Path) -> None:
    put("models/lag.py")
    (tmp_path / "lagging.toml").write_text(BLOCKS["ships/lagging.toml"][0], encoding="utf-8")
    ship = load(tmp_path / "lagging.toml")
    run = simulate(ship, Turning(n_P=0.0, delta=0.2), duration=60.0, dt=0.1)
    assert run["r"][-1] == pytest.approx(0.05 * 0.2 * -math.expm1(-run.t[-1] / 20.0), rel=1e-6)


@pytest.mark.slow
def test_an_estimator(put: Put) -> None:
    """A study names it; the commands hand it who is told and a file of its own."""
    put("identify/population/draws.py")
    ship = load("mariner_nomoto")
    truth = simulate(ship, Zigzag(0.0, 0.35, 0.35), duration=300.0, dt=1.0, name="z")
    free = near(ship.model, "K", "T", ratio=0.4)
    far = tuple(replace(f, start=f.low) for f in free)
    loss = Loss({"x": 10.0, "y": 10.0, "psi": 0.01})
    problem = Problem(ship.having({f.path: f.start for f in far}), (truth,), far, loss)
    estimator = read_estimator(Path("study.toml"), {"type": "draws:Draws", "draws": 100})
    seen: list[tuple[int, float, float]] = []
    fit = estimator.fit(problem, progress=lambda *row: seen.append(row), checkpoint=Path("never made"))
    assert isinstance(fit, Fit)
    assert [row[0] for row in seen] == list(range(1, 101))
    assert fit.values == pytest.approx([read(ship.model, f.path) for f in free], rel=0.15)
    assert fit.objective == pytest.approx(seen[-1][1])
    assert seen[-1][1] < 0.1 * seen[0][1]
    assert [verdict.subject for verdict in fit.verdicts][:2] == ["K", "T"]
    assert not Path("never made").exists()


def test_a_study() -> None:
    from seatrial.core.records import filled, of_schema
    from seatrial.study.schema import StudyFile

    table = tomllib.loads(BLOCKS["studies/esso_osaka_mmg.toml"][0])
    study = filled(StudyFile, of_schema(table, "seatrial-study/1", "s"), "studies/esso_osaka_mmg.toml")
    assert study.data.validation == ["turning/turn_14-Oct-2020_14_29_49*"]
    assert read_estimator(Path("s"), table["estimator"]).window == 100.0


def test_a_manoeuvre(put: Put, capsys: pytest.CaptureFixture[str]) -> None:
    put("manoeuvres/weave.py")
    simulation.known.cache_clear()
    try:
        assert main(["simulate", "mariner_nomoto", "weave", "--rudder", "20", "--heading", "5", "--json"]) == 0
        told = json.loads(capsys.readouterr().out)
        assert told["indices"]["greatest_heading"]["value"] > 5.0
        assert main(["simulate", "mariner_nomoto", "weave", "--seed", "3"]) == 2
    finally:
        simulation.known.cache_clear()


def test_weather() -> None:
    names: dict[str, Any] = {}
    exec(BLOCKS["squall.py"][0], names)
    run = simulate(load("esso_osaka_3m"), Turning(n_P=10.0, delta=0.0), duration=20.0, dt=0.1,
                   environment=names["Squall"](U_T=5.0, begins=5.0))  # fmt: skip
    assert run["U_T"][20] == 0.0
    assert run["U_T"][100] == 5.0
    assert run["gamma_T"][100] == pytest.approx(0.0)


def test_an_instrument() -> None:
    made = within("sensors/instruments.py", "sensors.instruments")["DriftMeter"]
    truth = {"u": 3.0, "v_m": -0.3, "r": 0.0, "psi": 0.0}
    (exact,) = Suite((made(),)).start().read(0.0, truth)
    assert exact.values["beta"] == pytest.approx(math.atan(0.1))
    (wrong,) = Suite((made(drift=Errors(bias=0.01)),)).start().read(0.0, truth)
    assert wrong.values["beta"] == pytest.approx(math.atan(0.1) + 0.01)


def test_a_formula() -> None:
    from seatrial.ships.formulas.reading import read_particulars

    names = dict(vars(importlib.import_module("seatrial.ships.formulas.added_mass")))
    formula = eval(BLOCKS["ships/formulas/added_mass.py"][0], names)
    ship = read_particulars(ROOT / "examples" / "particulars" / "kvlcc2.toml").ship
    assert formula.gives(ship) == {"body.m_x": pytest.approx(0.05 * ship.m)}


def test_a_requirement() -> None:
    scopes = importlib.import_module("seatrial.validate.requirements.scopes")
    assert not hasattr(scopes, "KEEPS_WAY")
    item = within("validate/requirements/scopes.py", "validate.requirements.scopes")["KEEPS_WAY"]
    assert item.check(Probe.of(load("kvlcc2_l7"))).verdict == "pass"


def test_a_log_format(put: Put, tmp_path: Path) -> None:
    module = put("data/formats/compass.py")
    check_format(Log(module, module.EXAMPLE))
    (tmp_path / "voyage.cmp").write_text("0 350\n1 10\n2 30\n", encoding="utf-8")
    assert main(["import", "compass", str(tmp_path / "voyage.cmp"), "-o", str(tmp_path / "trials")]) == 0
    trial = read_trial(tmp_path / "trials" / "voyage.csv")
    assert np.degrees(trial["psi"]) == pytest.approx([350.0, 370.0, 390.0])
    (tmp_path / "voyage.cmp").write_text("0 350\n1 north\n", encoding="utf-8")
    assert main(["import", "compass", str(tmp_path / "voyage.cmp"), "-o", str(tmp_path / "trials")]) == 2


def test_a_log_format_by_a_mapping(tmp_path: Path) -> None:
    """North-east velocities are rotated, a rudder that is positive to port changes its sign."""
    (block,) = (texts[0] for file, texts in BLOCKS.items() if file.startswith("seatrial import csv"))
    speeds = '\n[channels.u]\ncolumn = "VN"\nunit = "m/s"\n[channels.v_m]\ncolumn = "VE"\nunit = "m/s"\n'
    (tmp_path / "mapping.toml").write_text(block + speeds, encoding="utf-8")
    rows = "\n".join(f"{t},90,{5 + t % 3},0,4" for t in range(12))
    (tmp_path / "voyage.csv").write_text(f"Time,HDG,RUD,VN,VE\n{rows}\n", encoding="utf-8")
    command = ["import", "csv", str(tmp_path / "voyage.csv"), "--mapping", str(tmp_path / "mapping.toml")]
    assert main([*command, "-o", str(tmp_path / "trials")]) == 0
    trial: Trial = read_trial(tmp_path / "trials" / "voyage.csv")
    assert trial["delta"][:3] == pytest.approx(-np.radians([5.0, 6.0, 7.0]))
    assert trial["u"][0] == pytest.approx(4.0)
