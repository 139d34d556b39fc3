"""The command bench: what is there is measured, what is not is told; times themselves are no test."""

from __future__ import annotations

import json
import sys
import types
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seatrial.bench as room
from seatrial.bench import PEERS, Peer, Row, fossen, shipmmg, turn
from seatrial.bench.timing import best, control_loop, machine
from seatrial.cli.app import main
from seatrial.workflow.installation import bench as bench_workflow

QUICK = Peer("quick", "something quick", "seatrial", "comes with seatrial", lambda: (Row("a step", 2e-9, 3e-6),))
ABSENT = Peer("absent", "a program that is not here", "no_such_program", "pip install it", lambda: 1 / 0)


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_workflow, "control_loop", lambda: 5.0)
    monkeypatch.setattr(room, "PEERS", (QUICK, ABSENT))


@pytest.mark.usefixtures("peers")
def test_the_installed_are_measured_and_the_others_told(capsys: Any) -> None:
    assert main(["bench"]) == 0
    out, err = capsys.readouterr()
    assert "2 ns" in out
    assert "3 us" in out
    assert "1.5e+03 x" in out
    assert "absent: not installed (pip install it)" in out
    assert "Python control loop 5.0 to 5.0 ms" in out
    assert "measuring: something quick" in err
    assert "other work" not in err


@pytest.mark.usefixtures("peers")
def test_the_file_and_the_object_say_the_same(tmp_path: Path, capsys: Any) -> None:
    assert main(["bench", "quick", "-o", str(tmp_path / "new"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "new" / "bench.json").read_text())
    assert told["rows"] == [{"peer": "quick", "version": told["rows"][0]["version"], "what": "a step", "ours_s": 2e-9,
                             "theirs_s": 3e-6, "ratio": pytest.approx(1500.0)}]  # fmt: skip
    assert told["not_installed"] == []
    assert told["machine"] == machine()


@pytest.mark.usefixtures("peers")
def test_a_busy_machine_is_told(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    loops = iter((5.0, 5.0, 5.1, 8.0))
    monkeypatch.setattr(bench_workflow, "control_loop", lambda: next(loops))
    assert main(["bench", "quick"]) == 0
    assert "the machine had other work" in capsys.readouterr().err


@pytest.mark.usefixtures("peers")
def test_an_absent_peer_alone_is_no_failure(capsys: Any) -> None:
    assert main(["bench", "absent"]) == 0
    assert "absent: not installed" in capsys.readouterr().out


def test_a_peer_of_another_version_leaves_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any
) -> None:
    def moved() -> tuple[Row, ...]:
        raise TypeError("no such\nargument")

    monkeypatch.setattr(bench_workflow, "control_loop", lambda: 5.0)
    monkeypatch.setattr(room, "PEERS", (replace(QUICK, name="moved", measure=moved), QUICK))
    assert main(["bench", "-o", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert "1.5e+03 x" in out
    assert err.splitlines()[-1].startswith("error: moved cannot be measured: TypeError: no such argument (installed")
    assert json.loads((tmp_path / "bench.json").read_text())["failed"][0]["peer"] == "moved"


def test_the_list_measures_nothing(capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_workflow, "control_loop", lambda: 1 / 0)
    assert main(["bench", "--list"]) == 0
    out = capsys.readouterr().out
    assert all(peer.name in out for peer in PEERS)
    assert main(["bench", "--list", "--json"]) == 0
    assert [one["name"] for one in json.loads(capsys.readouterr().out)["peers"]] == [peer.name for peer in PEERS]


def test_an_unknown_name_is_one_line(tmp_path: Path, capsys: Any) -> None:
    assert main(["bench", "shipmg", "-o", str(tmp_path / "new")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith("error: ")
    assert "'shipmg'" in err
    assert ", ".join(peer.name for peer in PEERS) in err
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_the_shortest_run_counts() -> None:
    assert 0.0 < best(lambda: None, 0.0, 3) < 0.1
    assert replace(QUICK, module="no_such_program").installed is False
    assert control_loop() > 0.0


@pytest.mark.slow
def test_the_turn_of_the_benchmark_turns() -> None:
    z = turn.track(2.5)
    assert z[-1, 2] > np.pi
    assert turn.widest_step(turn.ship().L_pp) == turn.STEPS[0]


@pytest.mark.long
def test_the_tanker_of_fossen_is_called_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in with the signatures of the program."""
    seen: list[tuple[float, float]] = []

    class Tanker:
        def __init__(self, depth: float, rpm: float) -> None:
            seen.append((depth, rpm))
            self.nu = np.array([4.8, 0, 0, 0, 0, 0], float)

        def dynamics(self, eta: Any, nu: Any, u_actual: Any, u_control: Any, sampleTime: float) -> tuple[Any, Any]:
            return nu, u_actual + sampleTime * (u_control - u_actual)

    monkeypatch.setattr(fossen, "STEPS", 3)
    module = types.ModuleType(fossen.MODULE)
    module.tanker = Tanker  # type: ignore[attr-defined]
    for name in ("python_vehicle_simulator", "python_vehicle_simulator.vehicles"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, fossen.MODULE, module)
    assert fossen.theirs() > 0.0
    assert seen == [(fossen.DEEP, fossen.RPM)]


def test_others_sail_the_turn_that_we_sail(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same ship from its speed on, the same rudder and revolutions over the same time."""
    kept = dict.fromkeys(("Mmg3DofBasicParams", "Mmg3DofManeuveringParams"), dict)
    peer = types.SimpleNamespace(**kept, simulate_mmg_3dof=lambda *given, **more: (*given, more))
    monkeypatch.setattr(shipmmg, "import_module", lambda name: peer)
    basic, _, t, delta, n_P, more = shipmmg.their_turn(max_step=0.1)
    ship = turn.ship()
    assert (t[0], t[-1]) == (0.0, turn.DURATION)
    assert np.ptp(np.diff(t)) < 1e-9
    assert (set(delta), set(n_P)) == ({turn.DELTA}, {turn.N_P})
    assert (more["u0"], more["max_step"]) == (ship.speed, 0.1)
    assert (basic["L_pp"], basic["m_x"], basic["m_y"]) == (ship.L_pp, ship.model.body.m_x, ship.model.body.m_y)
