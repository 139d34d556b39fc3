"""The example of docs/realtime.md runs as it is printed."""

import math
import re
from pathlib import Path

import pytest

from scenes import on_wire, scene
from seatrial.data.nmea.sentences import decode
from seatrial.data.nmea.ship import Fittings
from seatrial.realtime.conning import Conning
from seatrial.realtime.on_wire import fitted
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
TEXT = (Path(__file__).parents[2] / "docs" / "realtime.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"^```python\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    exec(compile(block, "docs/realtime.md", "exec"), {})
    assert capsys.readouterr().out.splitlines() == ["1200 0 True", "True"]


@pytest.mark.slow
def test_the_printed_orders_do_what_stands_beside_them():
    text = (Path(__file__).parents[2] / "docs/tutorials/hardware-in-the-loop.md").read_text(encoding="utf-8")
    said = {line[3:6]: line.encode() + b"\r\n" for line in re.findall(r"^\$AG\S+", text, re.MULTILINE)}
    assert set(said) == {"ROR", "HTC", "PRC"}
    con = Conning(SHIP, fitted(SHIP, Fittings()), full=10.0)
    assert con.take(decode(said["ROR"]), "a", 0.0) == {"delta": pytest.approx(math.radians(10.0))}, "to starboard"
    assert con.take(decode(said["PRC"]), "a", 0.0) == {"n_P": pytest.approx(1.5)}
    stage, wire = on_wire(scene(rate=2.0))
    wire.waiting.append(said["HTC"])
    stage.loop.run(900.0)
    assert math.remainder(stage.own.plant["psi"] - math.radians(45.0), math.tau) == pytest.approx(0.0, abs=0.02)
