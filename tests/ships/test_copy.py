"""`seatrial copy`: a complete, commented file of a ship, which sails as the ship does."""

import json
import os
import re
import tomllib

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.core.parameters import values
from seatrial.ships.files import FOLDER, library, load, variants
from seatrial.simulate.run import simulate
from seatrial.validate.requirements.probe import Held
from seatrial.workflow import RequestError
from seatrial.workflow.judging import copy

ALL = (*library(), *variants())


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_a_copy_sails_as_the_ship_does_to_the_last_bit(name, tmp_path):
    ship, made = load(name), copy(name, tmp_path / "mine.toml")
    assert made.name == "mine"
    assert made.of == (ship.of or ship.name)
    assert values(made.model) == values(ship.model)
    assert made.actuators == ship.actuators
    assert made.validity == ship.validity
    length = 2.0 * ship.L_pp / ship.speed
    order = Held(ship.n_P or 1.0, 0.8 * (ship.n_P or 1.0), 0.1)
    if not ship.model.trained:
        return
    runs = [simulate(one, order, duration=length, start=(0.0, 0.0, 0.3, ship.speed, 0.0, 0.0)) for one in (ship, made)]
    for channel in ("x", "y", "psi", "u", "v_m", "r"):
        assert np.array_equal(runs[0][channel], runs[1][channel])


def test_a_ship_that_is_like_another_becomes_whole_and_works_from_any_folder(tmp_path):
    near = tmp_path / "near"
    near.mkdir()
    (near / "base.toml").write_bytes((FOLDER / "kvlcc2_l7.toml").read_bytes())
    (near / "child.toml").write_text('schema = "seatrial-ship/1"\nlike = "base.toml"\n[hull]\n'
                                     'R_0 = { prime = 0.03, source = "mine" }\n')  # fmt: skip
    made = copy(near / "child.toml", tmp_path / "whole.toml")
    for path in near.iterdir():
        path.unlink()
    assert "like" not in tomllib.loads((tmp_path / "whole.toml").read_text())
    here = os.getcwd()
    try:
        os.chdir(near)
        assert load(tmp_path / "whole.toml").model == made.model
    finally:
        os.chdir(here)
    assert made.entries["hull.R_0"].given == 0.03


def test_each_number_has_its_meaning_and_what_is_left_out_is_offered(tmp_path):
    copy("otter", tmp_path / "boat.toml")
    text = (tmp_path / "boat.toml").read_text()
    assert "position to starboard of the centreline" in text
    offered = re.findall(r"^# (T_nu = \{.*)", text, re.M)
    assert len(offered) == 2
    # Taking the comment mark away is all that it takes to set the number.
    (tmp_path / "boat.toml").write_text(text.replace(f"# {offered[0]}", offered[0].replace("0.0", "0.5"), 1))
    assert values(load(tmp_path / "boat.toml").model)["thrusters.port.T_nu"] == 0.5


@pytest.mark.slow
def test_every_offered_number_of_the_library_can_be_set(tmp_path):
    for name in ("kvlcc2", "esso_osaka_3m_harbour", "twin_virtual", "mariner", "otter"):
        path = tmp_path / f"{name}_2.toml"
        copy(name, path)
        text = path.read_text()
        path.write_text(re.sub(r"^# (\w+ = \{ value)", r"\1", text, flags=re.M))
        if name != "esso_osaka_3m_harbour":  # its tunnels take one of K_T and T_0
            assert values(load(path).model) == values(load(name).model)


@pytest.mark.parametrize("name", ["old.toml", "old.txt", "nowhere/new.toml", "model.toml"])
def test_a_bad_destination_is_refused_in_one_line_and_nothing_is_written(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.toml").write_text("mine")
    (tmp_path / "weights.npz").write_bytes(b"mine")
    ship = "esso_osaka_3m_network" if name == "model.toml" else "kvlcc2"
    before = {p: p.read_bytes() for p in tmp_path.iterdir()}
    assert main(["copy", ship, name]) == 2
    said = capsys.readouterr().err
    assert len(said.strip().splitlines()) == 1
    assert {p: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_an_unknown_ship_is_refused(tmp_path):
    with pytest.raises(Exception, match="no ship"):
        copy("kvlc", tmp_path / "new.toml")
    assert not list(tmp_path.iterdir())


def test_json(tmp_path, capsys):
    assert main(["copy", "kvlcc2", str(tmp_path / "big.toml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["of"] == "kvlcc2"


def test_request_error_names_the_file(tmp_path):
    (tmp_path / "old.toml").write_text("mine")
    with pytest.raises(RequestError, match="exists already"):
        copy("kvlcc2", tmp_path / "old.toml")
