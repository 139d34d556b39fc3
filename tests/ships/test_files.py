"""Ship files: every number with its source, every mistake with its place, every save bit for bit."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from seatrial.actuators import Actuators
from seatrial.core.parameters import ParameterError, Parts, Terms, read, values
from seatrial.ships import Entry, Ship, ShipError
from seatrial.ships.files import FOLDER, library, load, save, to_toml, variants
from seatrial.ships.writing import OWN as NOT_PASSED_ON
from tiers import slow_but

every_ship = pytest.mark.parametrize("name", [*library(), *variants()])
OF_EACH_FAMILY = {type(load(name).model): name for name in library()}.values()
L7 = (FOLDER / "kvlcc2_l7.toml").read_text(encoding="utf-8")


def write(folder: Path, text: str) -> Path:
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_library_holds_the_ships_that_the_command_line_names() -> None:
    assert {"kvlcc2", "kvlcc2_l7", "esso_osaka_3m"} <= set(library())


class TestLike:
    """A ship file that holds only what differs from another one."""

    HEAD = 'schema = "seatrial-ship/1"\n'

    def test_numbers_notes_and_sources_lie_over_those_of_the_other_ship(self, tmp_path: Path) -> None:
        own = load(write(tmp_path, self.HEAD + 'like = "suzaku"\n[rudder]\nkappa = { value = 0.7, source = "trial" }\n'
                         '[notes]\ntitle = "another"\n'))  # fmt: skip
        base = load("suzaku")
        assert own.name == "own"
        different = {path for path, value in values(own.model).items() if value != read(base.model, path)}
        assert different == {"rudder.kappa"}
        assert own.entries["rudder.kappa"].source == "trial"
        assert own.entries["rudder.epsilon"] == base.entries["rudder.epsilon"]
        assert (own.notes["title"], own.notes["cautions"]) == ("another", base.notes["cautions"])

    def test_a_number_is_replaced_whole(self, tmp_path: Path) -> None:
        text = self.HEAD + 'like = "suzaku"\n[rudder]\nl_R = { value = -80.0, unit = "m", source = "trial" }\n'
        assert read(load(write(tmp_path, text)).model, "rudder.l_R") == -80.0

    @pytest.mark.parametrize(
        ("like", "words"),
        [('"suzako"', "like: .*near: suzaku"), ('"own.toml"', "this ship again"), ("3", "names a ship of the library"),
         ('"absent.toml"', "no such ship file")],
    )  # fmt: skip
    def test_a_ship_that_is_not_there(self, tmp_path: Path, like: str, words: str) -> None:
        with pytest.raises(ShipError, match=words):
            load(write(tmp_path, f"{self.HEAD}like = {like}\n"))


def test_the_folder_of_a_fit_is_answered_with_the_ship_in_it(tmp_path: Path) -> None:
    (tmp_path / "fit").mkdir()
    (tmp_path / "fit" / "model.toml").write_text("schema = 1\n", encoding="utf-8")
    with pytest.raises(ShipError, match=r"fit/model\.toml$"):
        load(tmp_path / "fit")


def usual_values(thing: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Path and default of each number that a class is well without."""
    for f in fields(thing):
        value = getattr(thing, f.name)
        if "spec" in f.metadata and f.default is not MISSING:
            yield prefix + f.name, f.default
        elif isinstance(value, Parts):
            for name, part in value.items():
                yield from usual_values(part, f"{prefix}{f.name}.{name}.")
        elif is_dataclass(value) and not isinstance(value, type | Terms):
            yield from usual_values(value, f"{prefix}{f.name}.")


@every_ship
def test_every_number_has_a_source_and_every_ship_a_title(name: str) -> None:
    ship = load(name)
    assert ship.name == name
    assert ship.L_pp > 0 < ship.speed
    assert ship.notes["title"]
    bare = {name for name, usual in usual_values(ship.model) if read(ship.model, name) == usual}
    for path in values(ship.model):
        entry = ship.entries.get(path)
        assert path in bare if entry is None else entry.source, path


def test_primes_and_units_become_si() -> None:
    ship = load("kvlcc2_l7")
    L, d, rho = 7.0, 0.46, 1000.0
    assert read(ship.model, "rudder.l_R") == pytest.approx(-0.710 * L)
    assert read(ship.model, "body.m_y") == pytest.approx(0.223 * 0.5 * rho * L**2 * d)
    assert read(ship.model, "body.J_z") == pytest.approx(0.011 * 0.5 * rho * L**4 * d)
    assert read(ship.model, "hull.Y_v") == -0.315
    assert ship.entries["hull.Y_v"] == Entry(ship.entries["hull.Y_v"].source, -0.315, prime=True)
    assert ship.actuators.rudder.rate == pytest.approx(math.radians(15.8))
    assert ship.actuators.rudder.high == pytest.approx(math.radians(35.0))
    assert load("kvlcc2").speed == pytest.approx(15.5 * 1852 / 3600)
    assert load("kvlcc2_l7").validity["u"] == (0.0, 1.5)


def test_esso_osaka_weighs_what_its_particulars_say() -> None:
    assert read(load("esso_osaka_3m").model, "body.m") == pytest.approx(244.6, abs=0.05)


@every_ship
def test_a_saved_ship_loads_bit_for_bit(name: str, tmp_path: Path) -> None:
    ship = load(name)
    again = load(save(ship, tmp_path / "copy.toml"))
    assert again == replace(ship, notes={key: note for key, note in ship.notes.items() if key not in NOT_PASSED_ON})
    assert to_toml(again) == to_toml(ship)


@pytest.mark.parametrize("name", slow_but([*library(), *variants()], *OF_EACH_FAMILY))
def test_a_saved_fit_keeps_values_sources_and_provenance(name: str, tmp_path: Path) -> None:
    ship = load(name)
    odd = {path: value * (1.0 - 1.0 / 3.0e3) for path, value in values(ship.model).items()}
    entries = {path: replace(entry, sigma=0.1 / 3) for path, entry in ship.entries.items()}
    fitted = replace(ship.having(odd), entries=entries)
    provenance = {"study": 'a "quoted" name\n', "loss": 0.1 + 0.2, "trials": ["a.csv", "b.csv"], "seed": 3,
                  "settings": {"window": 60.0, "restart": True}, "nothing": None}  # fmt: skip
    again = load(save(fitted, tmp_path / "model.toml", provenance))
    assert again.model == fitted.model
    assert again.actuators == fitted.actuators
    kept = {key: value for key, value in provenance.items() if value is not None}
    assert again.notes["provenance"] == kept
    assert again.notes["title"] == ship.notes["title"]
    for path, entry in ship.entries.items():
        assert entry.source in again.entries[path].source
        assert again.entries[path].sigma == 0.1 / 3
    twice = load(save(again, tmp_path / "twice.toml"))
    assert twice == again


def test_a_ship_made_in_a_script_can_be_saved(tmp_path: Path) -> None:
    ship = load("kvlcc2")
    bare = Ship(name="mine", model=ship.model, actuators=Actuators(), L_pp=320.0, speed=8.0, n_P=1.8)
    again = load(save(bare, tmp_path / "mine.toml"))
    assert (again.model, again.speed, again.n_P, again.name) == (ship.model, 8.0, 1.8, "mine")
    zee = load("zeefakkel")
    again = load(save(replace(zee, entries={}), tmp_path / "zee.toml"))
    assert (again.model, again.L_pp) == (zee.model, zee.L_pp)


def test_a_number_that_is_not_finite_is_not_saved(tmp_path: Path) -> None:
    with pytest.raises(ShipError, match=r"hull\.Y_v is nan"):
        save(load("kvlcc2").having({"hull.Y_v": math.nan}), tmp_path / "model.toml")
    assert not os.listdir(tmp_path)


def test_a_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = save(load("zeefakkel"), tmp_path / "model.toml")
    before = path.read_bytes()

    def full(*_: Any) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="no space"):
        save(load("kvlcc2"), path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["model.toml"]


@pytest.mark.parametrize("given", ["kvlcc", "KVLCC2", "esso_osaka_4m"])
def test_an_unknown_ship_names_the_near_ones(given: str) -> None:
    with pytest.raises(ShipError, match=r"kvlcc2|esso_osaka_3m"):
        load(given)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(ShipError, match=r"nowhere\.toml: "):
        load("nowhere.toml")


HULL = "Y_v = { prime = -0.315,"
MISTAKES = {
    "unknown number": (HULL, "Y_vee = { prime = -0.315,", r"hull.*Y_vee.*Y_v"),
    "missing number": (re.compile(r"Y_rrr = .*\n"), "", r"hull: missing Y_rrr"),
    "unknown table": ("[propeller]", "[propellor]", r"propellor.*propeller"),
    "missing table": (re.compile(r"\[rudder\][^\[]*"), "", r"\[rudder\] is missing"),
    "unknown module": ("hull:Polynomial", "hul:Polynomial", r"hull\.type.*hull"),
    "unknown class": ("hull:Polynomial", "hull:Polynom", r"hull\.type.*Polynomial"),
    "no class": ('"hull:Polynomial"', '"hull"', r"module:Class"),
    "unknown family": ("mmg:Mmg", "mmg:MMG", r"family.*Mmg"),
    "no type": ('type = "hull:Polynomial"\n', "", r"hull\.type"),
    "no unit": ('x_G = { value = 0.25, unit = "m",', "x_G = { value = 0.25,", r"body\.x_G: no unit.*unit = \"m\""),
    "no source": (re.compile(r"Y_v = .*\n"), "Y_v = { prime = -0.3 }\n", r"hull\.Y_v: no source"),
    "neither": (re.compile(r"Y_v = .*\n"), 'Y_v = { source = "s" }\n', r"either value or prime"),
    "both": (HULL, "Y_v = { prime = -0.315, value = 2, ", r"not both"),
    "bare number": (re.compile(r"Y_v = .*\n"), "Y_v = -0.315\n", r"hull\.Y_v: "),
    "text": (HULL, 'Y_v = { prime = "x",', r"hull\.Y_v: 'x' is not a number"),
    "truth": (HULL, "Y_v = { prime = true,", r"hull\.Y_v: True is not a number"),
    "not a number": (HULL, "Y_v = { prime = nan,", r"hull\.Y_v\.prime is nan"),
    "infinite": (HULL, "Y_v = { prime = inf,", r"hull\.Y_v: inf is not finite"),
    "unknown key": (HULL, "Y_v = { prime = -0.315, sauce = 2,", r"hull\.Y_v.*sauce.*source"),
    "out of range": ("t_P = { value = 0.22", "t_P = { value = 22.0", r"propeller\.t_P: 22.*\[-0.5, 1\]"),
    "wrong unit": ('d = { value = 0.46, unit = "m"', 'd = { value = 0.46, unit = "kg"', r"body\.d.*'kg'.*m"),
    "no prime": ("k_0 = { value", "k_0 = { prime", r"propeller\.k_0.*cannot be primed"),
    "schema": ("seatrial-ship/1", "seatrial-ship/9", r"seatrial-ship/9.*seatrial-ship/1"),
    "not TOML": ("[hull]", "[hull", r"cannot be read as TOML"),
    "actuator": ("[actuators.rudder]", "[actuators.ruder]", r"actuators.*ruder.*rudder"),
    "no speed": ("speed = {", "sped = {", r"approach.*sped.*speed"),
    "validity channel": ("u = [0.0", "w = [0.0", r"validity.*'w'"),
    "validity order": ("u = [0.0, 1.5]", "u = [1.5, 0.0]", r"validity\.u.*no width"),
    "validity form": ("u = [0.0, 1.5]", "u = [1.5]", r"validity\.u.*\[low, high\]"),
    "table": ("[approach]\n", "[[approach]]\n", r"approach is not a table"),
}


@pytest.mark.parametrize("name", list(MISTAKES))
def test_a_mistake_is_one_line_that_names_file_and_key(name: str, tmp_path: Path) -> None:
    old, new, expected = MISTAKES[name]
    text = old.sub(new, L7, count=1) if isinstance(old, re.Pattern) else L7.replace(old, new, 1)
    assert text != L7
    path = write(tmp_path, text)
    with pytest.raises(ShipError, match=expected) as caught:
        load(path)
    assert "own.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_primed_mass_needs_its_yardsticks(tmp_path: Path) -> None:
    text = re.sub(r"\nL_pp = .*", '\nL_pp = { prime = 1, source = "s" }', L7)
    with pytest.raises(ShipError, match="L_pp"):
        load(write(tmp_path, text))


BRICK = (
    "from dataclasses import dataclass\n"
    "from pathlib import Path\n"
    "from seatrial.forces import Force\n"
    "from seatrial.core.parameters import spec\n"
    "Path(__file__).with_name('ran').touch()\n"
    "@dataclass(frozen=True, kw_only=True)\n"
    "class Brick:\n"
    "    mirror_symmetric = True\n"
    "    drag: float = spec('kg/s', 'drag over speed')\n"
    "    def force(self, flow):\n"
    "        return Force(-self.drag * flow.u, 0.0, 0.0)\n"
)
OWN = '[hull]\ntype = "{}:Brick"\ndrag = {{ value = 3.0, unit = "kg/s", source = "guess" }}\n\n'


def brick(folder: Path, module: str) -> Path:
    """A ship file with a force of a module that lies beside it, and leaves a trace when it runs."""
    (folder / f"{module}.py").write_text(BRICK)
    return write(folder, re.sub(r"\[hull\][^\[]*", OWN.format(module), L7))


def test_a_force_of_ones_own_needs_no_registration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = brick(tmp_path, "my_hull")
    monkeypatch.syspath_prepend(str(tmp_path))
    ship = load(path, trust=("my_hull",))
    assert read(ship.model, "hull.drag") == 3.0
    assert load(save(ship, tmp_path / "again.toml"), trust=True).model == ship.model


def test_a_ship_file_runs_no_code_that_nobody_trusts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = brick(tmp_path, "planted_hull")
    monkeypatch.syspath_prepend(str(tmp_path))
    for trust in (False, (), ("planted",), "planted_hul"):
        with pytest.raises(ShipError, match=r"hull\.type: no module 'planted_hull'.*--trust planted_hull"):
            load(path, trust=trust)
    assert not (tmp_path / "ran").exists()
    ship = load(path, trust=True)
    assert (tmp_path / "ran").exists()
    with pytest.raises(ShipError, match="--trust"):  # what is saved from a trusted ship is a file like any other
        load(save(ship, tmp_path / "fit.toml"))
    with pytest.raises(ShipError, match="family: no module 'planted_family'"):
        load(write(tmp_path, L7.replace("mmg:Mmg", "planted_family:Mmg")), trust=("planted_hull",))


@pytest.mark.parametrize("name", ["seatrial.__main__:Mmg", "seatrial.cli.app:Around", "seatrial.bench.turn:Mmg"])
def test_a_ship_file_names_classes_of_the_rooms_of_parts_only(tmp_path: Path, name: str) -> None:
    with pytest.raises(ShipError, match="family: no module"):
        load(write(tmp_path, L7.replace("mmg:Mmg", name)))


def test_what_a_ship_file_refuses_a_script_refuses() -> None:
    ship = load("kvlcc2_l7")
    with pytest.raises(ParameterError, match=r"rudder\.t_R is 5; it can be -1 to 1"):
        ship.having({"rudder.t_R": 5})
    with pytest.raises(ParameterError, match=r"body\.m is -1 kg; it can be"):
        ship.having({"hull.Y_v": -0.3, "body.m": -1.0})
    assert read(ship.having({"rudder.t_R": 0.5}).model, "rudder.t_R") == 0.5


SLIPS = {
    "mass in tonnes": (
        r"m = {[^}]*}", 'm = { value = 3.27, unit = "kg", source = "x" }', r"body\.m is 3.27 kg, 0.0008"),
    "inertia over a thousand": (
        r"I_zG = {[^}]*}", 'I_zG = { value = 10.0, unit = "kg m^2", source = "x" }',
        r"body\.I_zG.*gyration of 0.0079 L_pp"),
    "rudder at the bow": (r"x_R = {[^}]*}", 'x_R = { prime = 0.5, source = "x" }', r"rudder\.x_R is 3.5 m: .*bow"),
    "rudder in millimetres": (
        r"x_R = {[^}]*}", 'x_R = { value = -3500.0, unit = "m", source = "x" }', r"rudder\.x_R is -3500 m, off a ship"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_unit_or_sign_is_told_in_one_line(slip: str, tmp_path: Path) -> None:
    was, now, words = SLIPS[slip]
    text = re.sub(rf"(?m)^{was}", now, L7)
    assert text != L7
    with pytest.raises(ShipError, match=words) as refused:
        load(write(tmp_path, text))
    assert "\n" not in str(refused.value)
    assert load(write(tmp_path, text + '\n[notes.provenance]\nstudy = "s"\n'))  # what a fit found stays readable


def test_surge_damping_that_drives_the_ship_is_refused(tmp_path: Path) -> None:
    path = save(load("qiuxin5"), tmp_path / "tug.toml")
    path.write_text(re.sub(r"(?m)^X_u = { value = -", "X_u = { value = ", path.read_text()))
    with pytest.raises(ShipError, match=r"damping\.X_u is 8\.98"):
        load(path)


def test_a_family_without_numbers_of_its_own_takes_no_keys(tmp_path: Path) -> None:
    path = save(load("qiuxin5"), tmp_path / "tug.toml")
    path.write_text(path.read_text() + '\n[model]\ncoriolsi = "consistent"\n')
    with pytest.raises(ShipError, match="model: no number 'coriolsi'"):
        load(path)


def test_a_ship_knows_its_file_unless_something_was_laid_over_it() -> None:
    where = FOLDER / "kvlcc2.toml"
    assert load("kvlcc2").file == load(where).file == where
    over = load("kvlcc2", over={"body": {"x_G": {"value": 10.0, "unit": "m", "source": "here"}}})
    assert (over.file, values(over.model)["body.x_G"]) == (None, 10.0)
    assert replace(load("kvlcc2"), file=None) == load("kvlcc2"), "where it lies is no part of what a ship is"


def test_a_ship_of_the_library_is_read_once_and_anew_where_more_is_laid_over_it() -> None:
    first = load("esso_osaka_3m")
    assert load("esso_osaka_3m") is first
    assert load(FOLDER / "esso_osaka_3m.toml") is first
    over = load("esso_osaka_3m", over={"body": {"d": {"value": 0.2, "unit": "m", "source": "a test"}}})
    assert read(over.model, "body.d") == 0.2 != read(load("esso_osaka_3m").model, "body.d")


def test_a_file_elsewhere_is_read_each_time(tmp_path: Path) -> None:
    path = write(tmp_path, L7)
    assert read(load(path).model, "body.d") == 0.46
    write(tmp_path, L7.replace("d = { value = 0.46", "d = { value = 0.47", 1))
    assert read(load(path).model, "body.d") == 0.47
