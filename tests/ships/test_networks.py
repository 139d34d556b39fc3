"""A network's ship file and its weights: one fit in two files, never half of one and half of another."""

from __future__ import annotations

import contextlib
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models.network import KINDS, Limits, Network, initial
from seatrial.models.neural import Neural
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load, save, to_toml
from seatrial.simulate.run import simulate

MEMORY = {"feedforward": 1, "forgetting": 4}
LIMITS = Limits((-1.0,) * 7, (1.0,) * 7, (0.1, 0.1, 0.1), 2.0)


def ship_of(kind: str = "forgetting", seed: int = 1, **form: Any) -> Ship:
    drawn = initial(Network(kind, (6, 5), memory=MEMORY.get(kind, 0), **form), seed)
    return replace(load("esso_osaka_3m"), name="net", model=Neural(dt=0.1, network=drawn), validity={}, n_P=10.0)


@pytest.mark.parametrize("kind", KINDS)
def test_saved_and_read_back(kind: str, tmp_path: Path) -> None:
    ship = ship_of(kind, limits=LIMITS, scale=(0.1, 0.2, 0.3, 7.0, 0.5, 3.0, 1 / 3))
    save(ship, tmp_path / "model.toml", {"study": "mine"})
    assert sorted(os.listdir(tmp_path)) == ["model.toml", "weights.npz"]
    back = load(tmp_path / "model.toml")
    assert back.model == ship.model
    assert back.L_pp == ship.L_pp
    assert back.notes["provenance"] == {"study": "mine"}
    assert to_toml(back) == to_toml(load(save(back, tmp_path / "model.toml")))


def test_several_ships_in_a_folder_keep_their_own_weights(tmp_path: Path) -> None:
    for seed in (1, 2):
        save(ship_of(seed=seed), tmp_path / f"net_{seed}.toml")
    for seed in (1, 2):
        assert load(tmp_path / f"net_{seed}.toml").model == ship_of(seed=seed).model
    assert sorted(p.name for p in tmp_path.glob("*.npz")) == ["net_1.weights.npz", "net_2.weights.npz"]


def test_a_save_that_is_cut_off_leaves_the_old_pair_or_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process ends before any one of the moves that a save consists of."""
    path, old, new = tmp_path / "model.toml", ship_of(seed=1), ship_of(seed=2)
    save(old, path)
    move, outcomes = os.replace, []
    for cut in range(4):
        moves = []

        def cut_off(a: Any, b: Any, cut: int = cut, moves: Any = moves) -> None:
            if len(moves) == cut:
                raise KeyboardInterrupt
            moves.append(b)
            move(a, b)

        monkeypatch.setattr(os, "replace", cut_off)
        with contextlib.suppress(KeyboardInterrupt):
            save(new, path)
        monkeypatch.setattr(os, "replace", move)
        found = load(path).model
        outcomes.append("new" if found == new.model else "old" if found == old.model else "neither")
        save(old, path)
    assert outcomes == ["old", "old", "new", "new"]
    assert sorted(os.listdir(tmp_path)) == ["model.toml", "weights.npz"]


def test_weights_of_another_fit(tmp_path: Path) -> None:
    save(ship_of(seed=1), tmp_path / "model.toml")
    (tmp_path / "other").mkdir()
    save(ship_of(seed=2), tmp_path / "other" / "model.toml")
    shutil.copy(tmp_path / "other" / "weights.npz", tmp_path / "weights.npz")
    with pytest.raises(ShipError, match=r"weights\.npz: .*\b\w{12}\b.*model\.toml.*\b\w{12}\b"):
        load(tmp_path / "model.toml")
    (tmp_path / "weights.npz").write_bytes(b"no archive")
    with pytest.raises(ShipError, match=r"weights\.npz: "):
        load(tmp_path / "model.toml")
    (tmp_path / "weights.npz").unlink()
    with pytest.raises(ShipError, match=r"model\.toml: .*weights\.npz"):
        load(tmp_path / "model.toml")


def test_weights_of_another_form(tmp_path: Path) -> None:
    text = save(ship_of(), tmp_path / "model.toml").read_text()
    for before, after, told in (
        ("layers = [6, 5]", "layers = [7, 5]", r"network: W_x0\b.*\(3, 6\).*\(3, 7\)"),
        ('kind = "forgetting"', 'kind = "feedforward"', "memory is 4 samples"),
        ('kind = "forgetting"', 'kind = "forgetful"', "no kind of network 'forgetful'; known: "),
        ("wind = true", 'wind = "yes"', r"network\.wind is 'yes'"),
        ("wind = true", "breeze = true", "no key 'breeze'; "),
        ("memory = 4", "memory = 4.5", r"network\.memory is 4\.5"),
        ("layers = [6, 5]", "layers = [6, 5.5]", r"network\.layers\b"),
        ("layers = [6, 5]", "", "network: missing layers"),
        ('weights = "weights.npz"', 'weights = "../weights.npz"', r"network\.weights\b"),
        ("sha256", "# sha256", "missing sha256"),
    ):
        assert before in text
        (tmp_path / "model.toml").write_text(text.replace(before, after))
        with pytest.raises(ShipError, match=told) as error:
            load(tmp_path / "model.toml")
        assert "\n" not in str(error.value)


def test_a_network_that_is_yet_to_be_trained_is_a_ship(tmp_path: Path) -> None:
    ship = replace(ship_of(), model=Neural(dt=0.1, network=Network("rnn", (6,))))
    back = load(save(ship, tmp_path / "blank.toml"))
    assert back.model == ship.model
    assert os.listdir(tmp_path) == ["blank.toml"]
    with pytest.raises(ValueError, match="untrained"):
        simulate(back, Zigzag(n_P=10.0, delta=0.2, psi=0.2), duration=5.0)


@pytest.mark.slow
def test_through_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Simulate, show, resample, predict and validate; what cannot be done is said in a line."""
    model = str(save(ship_of(limits=LIMITS), tmp_path / "model.toml"))
    run, folder = str(tmp_path / "run.csv"), str(tmp_path)
    assert main(["simulate", model, "zigzag", "--duration", "30", "--wind", "2,40", "-o", run]) == 1  # not over by then
    assert main(["show", model]) == 0
    assert "kind forgetting, layers [6, 5], memory 4" in " ".join(capsys.readouterr().err.split())
    assert main(["predict", model, run, "--restart", "10", "-o", f"{folder}/predicted"]) == 0
    assert main(["validate", model, run, "--restart", "10"]) == 0
    assert main(["resample", run, "--dt", "0.5", "-o", f"{folder}/slow"]) == 0
    capsys.readouterr()
    for command in (
        ["predict", model, f"{folder}/slow", "-o", f"{folder}/p"],
        ["export", model, "--c", f"{folder}/c"],
        ["export", model, "--casadi", f"{folder}/a.casadi"],
        ["export", model, "--python", f"{folder}/a.py", "--actuators", "0.1"],
        ["design", model, "--free", "network.*"],
        ["simulate", model, "zigzag", "--dt", "0.05"],
        ["resample", run, "--dt", "0", "-o", f"{folder}/slow"],
    ):
        assert main(command) in (1, 2)
        told = capsys.readouterr().err.strip().splitlines()
        assert told[-1].startswith("error: "), told
        assert not [line for line in told if "Traceback" in line]


def test_the_file_holds_what_it_says(tmp_path: Path) -> None:
    ship: Any = ship_of()
    save(ship, tmp_path / "model.toml")
    with np.load(tmp_path / "weights.npz") as archive:
        assert {name: archive[name].shape for name in archive} == ship.model.network.shapes
