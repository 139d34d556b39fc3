"""Stacks in processes of their own: one that answers, one that falls silent, one that ends, one that never speaks."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.meeting import Meeting
from seatrial.encounters.rules import Alone
from seatrial.realtime.range.encounter import encountered
from seatrial.realtime.range.scenario import Scenario, ordinary
from seatrial.workflow.safety import case as module
from seatrial.workflow.safety.case import case
from seatrial.workflow.safety.claimed import CONTACT, MUTE, CaseFile
from seatrial.workflow.safety.outside import Ran, ran
from seatrial.workflow.safety.stacks import Stack

STACK = '''
import functools, operator, socket, sys, time
host, _, port = sys.argv[1].rpartition(":")
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.connect((host, int(port)))
link.settimeout(30.0)
def say(body):
    link.send(f"${body}*{functools.reduce(operator.xor, body.encode()):02X}\\r\\n".encode())
say("AGHTC,V,,,,,,,,,,,,T,R")
count = 0
while True:
    lines = link.recv(4096).decode().splitlines()
    if any(line[3:6] == "ZDA" for line in lines):
        count += 1
        BODY
        say("AGHTC,V,,,H,N,,,,,40.0,,,T,C")
'''
STACKS = {"answers": "pass", "hangs": "count < 60 or time.sleep(60)", "ends": "count < 60 or sys.exit(0)",
          "fails": "count < 60 or sys.exit(3)"}  # fmt: skip


def met() -> Scenario:
    """Head-on: both would be at (1600, 0) after 200 s."""
    one = Meeting(8.0, np.array([3200.0]), np.array([0.0]), np.array([math.pi]), np.array([8.0]))
    return encountered(ordinary("own", 100.0, 8.0), one, ["ignores"])


def of(folder: Path, body: str, **more: Any) -> Ran:
    (folder / "stack.py").write_text(STACK.replace("BODY", body), encoding="utf-8")
    return ran(met(), Stack(command="python stack.py {address}", sends="HDT,ZDA", **more).wiring(folder))


@pytest.mark.slow
@pytest.mark.parametrize("kind", STACKS)
def test_a_run_goes_to_its_end_on_the_last_orders_whatever_becomes_of_the_stack(tmp_path: Path, kind: str) -> None:
    found = of(tmp_path, STACKS[kind], patience=0.5)
    assert found.tracks is not None
    assert (found.spoke, found.valid) == (True, True)
    assert found.tracks.t[-1] == pytest.approx(440.0, abs=1.0)
    assert math.degrees(found.tracks.psi[0, -1]) == pytest.approx(40.0, abs=1.0)  # by the last order
    if kind == "answers":
        assert found.silent is None
    else:
        assert found.silent is not None
        assert 59.0 < found.silent < 63.0  # an answer a second


@pytest.mark.slow
def test_a_run_in_lock_step_is_the_same_again(tmp_path: Path) -> None:
    one, two = (of(tmp_path, "pass").tracks for _ in range(2))
    assert one is not None
    assert two is not None
    assert all((getattr(one, name) == getattr(two, name)).all() for name in ("t", "x", "y", "psi", "u", "v_m"))


@pytest.mark.slow
def test_a_stack_that_never_speaks_is_silent_from_the_first(tmp_path: Path) -> None:
    (tmp_path / "mute.py").write_text("import time\ntime.sleep(30)\n", encoding="utf-8")
    found = ran(met(), Stack(command="python mute.py", sends="HDT,ZDA", patience=0.3).wiring(tmp_path))
    assert (found.spoke, found.silent) == (False, 0.0)
    assert found.tracks is not None
    assert abs(found.tracks.y[0]).max() < 1.0  # it goes straight on


def test_what_a_run_on_a_wire_is_counted_as() -> None:
    zero = np.zeros((2, 3))
    tracks: Any = SimpleNamespace(t=np.arange(3.0), x=zero, psi=zero, u=zero, v_m=zero)
    judged: Any = type("J", (), {"ship": 0, "margins": {"16": np.array(-1.0)}, "contact": np.array(True),
                                 "gap": np.array(-2.0), "broken": lambda self, where: ("16",)})()  # fmt: skip
    by_itself, asked = Alone({"10": np.array(-0.5)}), list[Any]()
    setup: Any = SimpleNamespace(judged=lambda tracks: ((judged,), by_itself), grounds=None, together=20,
                                 current=lambda *some: asked.append(some) or np.zeros((2, 20)))  # fmt: skip

    def counted(one: Ran, run: int = 47) -> Any:
        found = module._on_wire(setup, one, run)
        return found.broken, found.judged, found.closest

    assert counted(Ran(tracks, 12.0, True, True), 0) == (("10", "16", CONTACT, MUTE), ("10", "16"), -2.0)
    assert counted(Ran(tracks, None, True, True)) == (("10", "16", CONTACT), ("10", "16"), -2.0)
    assert asked == [(0, 20), (40, 20)]  # the weather of its part
    assert counted(Ran(tracks, 0.0, True, False)) == (("10", "16", CONTACT, MUTE), ("10", "16"), -2.0)
    assert counted(Ran(tracks, None, False, True)) == (None, (), None)  # out of its validity
    assert counted(Ran(None, None, True, True)) == (None, (), None)  # it blew up
    with pytest.raises(RequestError, match="stack: no valid sentence"):
        counted(Ran(tracks, 0.0, True, False), 0)


@pytest.mark.parametrize(("change", "said"), [
    ({"command": "no_such_program_here {address}"}, "cannot be run"),
    ({"command": "python stack.py", "sends": "HDT,ZDT"}, "no sentence 'ZDT'"),
    ({"command": "python stack.py", "answers": "TTM"}, "no sentence 'TTM'"),
    ({"command": "python stack.py", "sends": "HDT,TTM"}, "an answer to each ZDA, which it does not send; it sends HDT"),
    ({"command": "python stack.py", "answers": "HDG", "sends": "HDT,ZDA"}, "each HDG, which it does not send"),
])  # fmt: skip
def test_a_program_that_cannot_be_is_a_line(tmp_path: Path, change: dict[str, str], said: str) -> None:
    with pytest.raises(RequestError, match=said):
        ran(met(), Stack(**change).wiring(tmp_path))


@pytest.mark.slow
def test_a_case_with_a_program_counts_its_silence_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_TOGETHER_ON_WIRE", 1)
    monkeypatch.setattr(module, "ran", lambda played, *how: ran(replace(played, duration=80.0), *how))
    (tmp_path / "stack.py").write_text(STACK.replace("BODY", STACKS["ends"]), encoding="utf-8")
    (tmp_path / "case.toml").write_text(
        'schema = "seatrial-case/1"\nclaim = "c"\nship = "kvlcc2"\ntraffic = ["ignores"]\n'
        '[stack]\ncommand = "python stack.py {address}"\nsends = "HDT,ZDA"\n'
        '[encounters]\nroles = ["give-way"]\nruns = 2\n', encoding="utf-8")  # fmt: skip
    found = case(tmp_path / "case.toml", tmp_path / "out").result
    assert (found.share(MUTE).hits, found.share(MUTE).runs) == (2, 2)
    assert len(found.parts) == 2
    (tmp_path / "out" / "part-0000001.json").unlink()
    assert case(tmp_path / "case.toml", tmp_path / "out").result == found
    (tmp_path / "stack.py").write_text(STACK.replace("BODY", "pass"), encoding="utf-8")
    with pytest.raises(RequestError, match="is of another case"):  # another stack under the same name
        case(tmp_path / "case.toml", tmp_path / "out")


def test_a_program_is_a_table_and_a_conduct_a_word() -> None:
    assert CaseFile(claim="c", ship="s").called == "rules"
    assert CaseFile(claim="c", ship="s", stack=Stack(command="python a.py")).called == "python a.py (nmea)"
