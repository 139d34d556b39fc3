"""What commands print with `--json` is what the published schema says: every command, run as a user runs it."""

from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click import Context
from jsonschema import Draft202012Validator

from seatrial.cli.app import app, main
from seatrial.data.trialfile import write_trials
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

ROOT = Path(__file__).parents[2]
SCHEMA: dict[str, Any] = json.loads((ROOT / "docs/static/seatrial.schema.json").read_text(encoding="utf-8"))
NOISE = Sensors({"x": 0.02, "y": 0.02, "psi": 0.002, "u": 0.01, "v_m": 0.01, "r": 0.001})
STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "trials"
train = ["zigzag_20", "turning_*", "zigzag_15"]
test = ["zigzag_10"]
[free]
"hull.N_v" = { ratio = 0.5, prior = 0.2 }
"hull.N_r" = { ratio = 0.5, prior = 0.2 }
"""
TABLE = "n_1 [1/s],T_1 [N]\n" + "".join(f"{n},{3.0 * n * abs(n)}\n" for n in (-4, -2, 2, 4, 6, 8))

QUICK = (
    ("ships", "show kvlcc2_l7", "show qiuxin5 --sources", "copy otter otter.toml", "ships --check otter.toml"),
    ("simulate kvlcc2_l7 turning", "simulate mariner zigzag", "scale kvlcc2_l7 --to-length 320",
     "roll kvlcc2_l7 --gm 0.125 --kg 0.4", "export kvlcc2_l7 --python ship.py", "cite kvlcc2_l7"),
    ("models", "models --for berthing", "doctor", "bench scipy --list", "thrust-map thrust.csv",
     f"estimate {ROOT}/examples/particulars/kcs.toml -o kcs.toml"),
    ("import --guess logs -o mapping.toml", "import csv logs --mapping mapping.toml -o imported",
     "check trials --against imported"),
    ("trials trials", "check trials --remedy steps.toml", "mend trials --by cut.toml -o mended",
     "resample trials --dt 1.0 -o slow", "convert trials/zigzag_10.csv --to mcap -o bags",
     "study new kvlcc2_l7 trials -o drawn.toml"),
)  # fmt: skip
LONG = (
    "identify study.toml -o run", "validate run/model.toml trials/zigzag_10.csv",
    "validate run/model.toml trials/zigzag_10.csv --for collision-avoidance", "cite run",
    "predict run/model.toml trials/zigzag_10.csv -o predicted", "card run/model.toml", "calibrate run/model.toml",
    "simulate run/model.toml zigzag --rudder 10 --heading 10 --bands 95 --draws 200", "imo kvlcc2_l7",
    "imo run/model.toml --bands 95 --draws 200", "requirements kvlcc2_l7 --scope collision-avoidance",
    "design kvlcc2_l7 --free hull.N_v", "harbour berthing", f"range {ROOT}/examples/range/crossing.toml",
    f"yardstick {ROOT}/studies/yardstick/virtual_kvlcc2.toml --method kvlcc2_l7", "demo -o demo",
)  # fmt: skip
"""Commands in the order in which one needs what another has written."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Trials of a model ship, tables of the same, and what the commands are given beside."""
    at, ship, rng = tmp_path_factory.mktemp("json"), load("kvlcc2_l7"), np.random.default_rng(2)
    n_P, deg = approach(ship)[1], np.pi / 180.0
    plans = {f"zigzag_{a}": Zigzag(n_P, a * deg, a * deg) for a in (10, 15, 20)}
    runs = [NOISE.read(simulate(ship, plan, duration=120.0, dt=0.1, every=5, name=name), rng)
            for name, plan in {**plans, "turning_35": Turning(n_P, 35 * deg)}.items()]  # fmt: skip
    for name in ("trials", "logs"):
        (at / name).mkdir()
    write_trials(tuple(runs), at / "trials")
    for one in runs[:2]:
        columns = {"Time [s]": one.t, "North [m]": one["x"], "East [m]": one["y"],
                   "Heading [deg]": one["psi"] / deg % 360.0, "Surge [m/s]": one["u"], "Sway [m/s]": one["v_m"],
                   "Rudder [deg]": one["delta"] / deg}  # fmt: skip
        rows = [",".join(columns), *(",".join(f"{v:.4f}" for v in row) for row in zip(*columns.values(), strict=True))]
        (at / "logs" / f"{one.name}.csv").write_text("\n".join(rows) + "\n")
    (at / "study.toml").write_text(STUDY)
    (at / "thrust.csv").write_text(TABLE)
    (at / "cut.toml").write_text('schema = "seatrial-steps/1"\n[[steps]]\ndo = "cut"\nwhere = [[0.0, 5.0]]\n')
    return at


def said(
    line: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> dict[str, Any]:
    """What a command prints: one line, one object."""
    monkeypatch.chdir(folder)
    status = main([*line.split(), "--json"])
    out, err = capsys.readouterr()
    assert out.count("\n") == 1, f"{status}: {err}"
    return json.loads(out)


def wrong(command: str, document: dict[str, Any]) -> list[str]:
    """Where a document is not as published, and its keys that are not published at all."""
    own = SCHEMA["$defs"][command]
    found = [f"{'/'.join(map(str, one.absolute_path))}: {one.message[:300]}"
             for one in Draft202012Validator(own).iter_errors(document)]  # fmt: skip
    return found + [f"{key}: is not published" for key in document if key not in own["properties"]]


@pytest.mark.parametrize("lines", [
    *(pytest.param(lines, marks=pytest.mark.slow, id=lines[0]) for lines in QUICK),
    pytest.param(LONG, marks=pytest.mark.long, id=LONG[0]),
])  # fmt: skip
def test_what_is_printed_is_what_is_published(
    lines: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = {line: wrong(line.split()[0], said(line, folder, monkeypatch, capsys)) for line in lines}
    assert {line: one for line, one in found.items() if one} == {}


def test_every_command_that_prints_json_has_its_part_of_the_schema_with_words_for_each_key() -> None:
    Draft202012Validator.check_schema(SCHEMA)
    context = Context(app)
    commands = {name: app.get_command(context, name) for name in app.list_commands(context)}
    functions: dict[str, Any] = {name: vars(one)["_function"] for name, one in commands.items()}
    printing = {name for name, one in functions.items() if "json" in inspect.signature(one).parameters}
    assert printing == SCHEMA["$defs"].keys()
    assert [one["$ref"] for one in SCHEMA["anyOf"]] == [f"#/$defs/{name}" for name in SCHEMA["$defs"]]
    for name, own in SCHEMA["$defs"].items():
        assert own["description"], name
        assert set(own.get("required", ())) <= own["properties"].keys(), name
        for key, one in own["properties"].items():
            assert one["description"].endswith("."), f"{name}: {key}"


def test_a_document_that_differs_is_found() -> None:
    plain = {"ship": "a", "of": "b", "file": "c.toml"}
    assert wrong("copy", plain) == []
    assert wrong("copy", {**plain, "more": 1}) == ["more: is not published"]
    assert wrong("copy", {**plain, "ship": 3})[0].startswith("ship: 3 is not of type")
    assert "required" in wrong("copy", {"ship": "a"})[0]
