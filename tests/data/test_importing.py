from __future__ import annotations

import importlib
import sys

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.formats import csv as mapping
from seatrial.data.formats import formats, frt_esso, reader, simman
from seatrial.data.found import told
from seatrial.data.importing import import_log
from seatrial.data.trialfile import read_trial
from seatrial.ships.files import load

MAPPING = """schema = "seatrial-mapping/1"
time = { column = "Time", unit = "s" }
frame = { velocity = "earth" }
L_pp = 7.0
[channels.psi]
column = "HDG"
unit = "deg"
[channels.delta]
column = "RUD"
unit = "deg"
sign = -1
[channels.u]
column = "VN"
unit = "kn"
[channels.v_m]
column = "VE"
unit = "kn"
"""
LOG = "Time,HDG,RUD,VN,VE,NOTE\n0,350,10,0,1,hello\n1,10,10,0,1,x\n2,90,10,0,1,\n"


def test_mapping_reads_any_table(tmp_path):
    (tmp_path / "m.toml").write_text(MAPPING)
    (tmp_path / "log.csv").write_text(LOG)
    [path] = import_log("csv", tmp_path / "log.csv", tmp_path / "out", tmp_path / "m.toml")
    trial = read_trial(path)
    assert path == tmp_path / "out" / "log.csv"
    assert np.degrees(trial["psi"]) == pytest.approx([350, 370, 450])
    assert np.degrees(trial["delta"]) == pytest.approx([-10] * 3)
    assert trial["u"][2] == pytest.approx(1852 / 3600)
    assert trial["v_m"][2] == pytest.approx(0, abs=1e-12)
    assert trial.meta["L_pp"] == 7.0
    assert len(trial.meta["processing"]) == 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sign = -1", "sgn = -1", "channels.delta.sgn: no key 'sgn'; near: sign"),
        ("frame =", "frames =", "no key 'frames'; near: frame"),
        ('"earth"', '"air"', "frame.velocity"),
        ("sign = -1", "sign = 2", "it must be 1 or -1"),
        ('unit = "kn"', 'unit = "knt"', "no unit 'knt'; near: .*kn"),
        ("[channels.delta]", "[channels.detla]", "no channel 'detla'; near: delta"),
        ('column = "HDG"\n', "", "channels.psi.column is missing"),
        ("mapping/1", "mapping/2", "schema"),
        ("L_pp = 7.0", "L_pp = 7000.0", "L_pp is 7000.0; it must be a number from 0.1 to 600"),
        ("L_pp = 7.0", "water_density = 1.025", "water_density is 1.025"),
        ("L_pp = 7.0", "L_pp = 7.0\nL_pp = 8.0", "not readable as TOML: Cannot overwrite"),
        ("L_pp = 7.0", "L_pp = " + 5000 * "7", "not readable as TOML"),
        ("L_pp = 7.0", "L_pp = " + 400 * "7", "L_pp: an integer of"),
        ("L_pp = 7.0", "L_pp = " + 50_000 * "[", "nested too deep"),
        ("L_pp = 7.0", "L_pp = 2024-99-99", "not readable as TOML"),
        ("L_pp = 7.0", 'L_pp = "7"', "L_pp"),
        ("sign = -1", "offset = inf", "offset"),
        ("[channels.u]", "[channels.u", "not readable as TOML"),
        ("[channels.psi]", "[channels.q_1]", "needs channels u"),
    ],
)
def test_bad_mapping(tmp_path, old, new, message):
    (tmp_path / "m.toml").write_text(MAPPING.replace(old, new))
    with pytest.raises(DataError, match=message) as error:
        mapping.read_mapping(tmp_path / "m.toml")
    assert "\n" not in str(error.value)


def test_an_offset_is_in_the_unit_of_the_column(tmp_path):
    """A gyro that shows 3 deg too much; a clock that is half an hour off."""
    text = MAPPING.replace('column = "HDG"\nunit = "deg"', 'column = "HDG"\nunit = "deg"\noffset = -3.0')
    (tmp_path / "m.toml").write_text(text.replace('unit = "s"', 'unit = "min", offset = 30.0'))
    (tmp_path / "log.csv").write_text(LOG)
    trial = mapping.read(tmp_path / "log.csv", mapping.read_mapping(tmp_path / "m.toml"))
    assert np.degrees(trial["psi"]) == pytest.approx([347, 367, 447])
    assert trial.t.tolist() == [1800.0, 1860.0, 1920.0]


@pytest.mark.slow
def test_what_a_person_added_to_a_sidecar_outlives_the_next_import(tmp_path):
    (tmp_path / "m.toml").write_text(MAPPING)
    (tmp_path / "log.csv").write_text(LOG)
    again = ("csv", tmp_path / "log.csv", tmp_path / "out", tmp_path / "m.toml")
    [path] = import_log(*again)
    sidecar = path.with_suffix(".yaml")
    with sidecar.open("a") as file:
        file.write('set_points: {"delta [deg]": 10}\nkind: turning\n')
    for _ in range(2):
        import_log(*again)
        meta = read_trial(path).meta
        assert (meta["set_points"], meta["kind"], meta["L_pp"]) == ({"delta [deg]": 10}, "turning", 7.0)
        assert meta["processing"][-1] == "kept from the sidecar: set_points, kind"
    sidecar.write_text(sidecar.read_text().replace("L_pp: 7.0", "L_pp: 7.1"))
    before = sidecar.read_bytes(), path.read_bytes()
    with pytest.raises(DataError, match=r"log\.yaml: L_pp is 7\.1.* 7\.0"):
        import_log(*again)
    assert before == (sidecar.read_bytes(), path.read_bytes())
    sidecar.write_text(sidecar.read_text().replace("L_pp: 7.1", "L_pp: 7.0"))
    (tmp_path / "log.csv").write_text(LOG.replace("10,10", "11,12").replace(",1,", ",2,"))
    with pytest.raises(DataError, match=r"log\.yaml.* set_points, kind of another recording"):
        import_log(*again)


def test_one_bad_log_leaves_nothing_behind(tmp_path):
    (tmp_path / "m.toml").write_text(MAPPING)
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "a.csv").write_text(LOG)
    (logs / "b.csv").write_text(LOG.replace("HDG", "HDT"))
    with pytest.raises(DataError, match=r"b\.csv: line 1: no column 'HDG'; near: HDT"):
        import_log("csv", logs, tmp_path / "out", tmp_path / "m.toml")
    assert not (tmp_path / "out").exists()


def test_requests_that_are_wrong(tmp_path):
    (tmp_path / "a.csv").write_text(LOG)
    with pytest.raises(DataError, match="no format 'frt-eso'; near: frt-esso"):
        import_log("frt-eso", tmp_path, tmp_path / "o")
    with pytest.raises(DataError, match="near: nmea"):
        import_log("nmeb", tmp_path, tmp_path / "o")
    with pytest.raises(DataError, match="needs a mapping"):
        import_log("csv", tmp_path, tmp_path / "o")
    with pytest.raises(DataError, match=r"no column 'Time'|no column"):
        import_log("frt-esso", tmp_path / "a.csv", tmp_path / "o")
    assert set(formats()) >= {"frt-esso", "simman", "usv-asw", "nmea", "mcap", "rosbag2", "csv"}


def test_a_header_of_two_columns_of_one_name_is_refused(tmp_path):
    (tmp_path / "m.toml").write_text(MAPPING)
    table = mapping.read_mapping(tmp_path / "m.toml")
    (tmp_path / "log.csv").write_text(LOG.replace("NOTE", "HDG"))
    with pytest.raises(DataError, match=r"log\.csv: column 'HDG', line 1"):
        mapping.read(tmp_path / "log.csv", table)
    (tmp_path / "log.csv").write_text(LOG.replace("NOTE", "NOTE,NOTE").replace("o\n", "o,\n").replace("x\n", "x,\n")
                                      .replace(",1,\n", ",1,,\n"))  # fmt: skip
    assert len(mapping.read(tmp_path / "log.csv", table)) == 3  # what nobody reads may stand twice
    heads = list(frt_esso.COLUMNS)
    (tmp_path / "turn.csv").write_text("\n".join([",".join([*heads, heads[3]]), *2 * [",".join(14 * ["0"])]]))
    with pytest.raises(DataError, match="line 1: 2 columns of this name"):
        frt_esso.read(tmp_path / "turn.csv")


@pytest.mark.slow
def test_esso(data_file, tmp_path):
    folder = data_file("esso_osaka_frt", "data")
    trial = frt_esso.read(folder / "zigzag" / "zigzag_31-Jul-2020_13_50_28.csv")
    assert np.isnan(trial["x"][-327:]).all()
    assert np.isfinite(trial["x"][:-327]).all()
    assert trial.t[-1] == pytest.approx(0.1 * (len(trial) - 1))
    assert trial.meta["kind"] == "zigzag"
    written = import_log("frt-esso", folder / "turning", tmp_path)
    again = read_trial(written[0])
    first = frt_esso.read(sorted((folder / "turning").glob("*.csv"))[0])
    assert len(written) == 14
    assert all(np.array_equal(again[n], first[n]) for n in first.channels)
    assert again.meta == told(first).meta
    assert again.meta["missing"] == ["speed through water", "depth"]


@pytest.mark.parametrize("folder", [
    pytest.param("kvlcc2_hsva_simman2008", marks=pytest.mark.slow), "kvlcc2_marin_simman2008",
])
def test_simman(data_file, folder):
    files = sorted(data_file(folder, "raw").glob("*.dat"))
    assert files
    for path in files:
        trial = simman.read(path)
        u, v, psi = trial["u"], trial["v_m"], trial["psi"]
        slip = np.gradient(trial["x"], trial.t) - (u * np.cos(psi) - v * np.sin(psi))
        assert np.sqrt(np.mean(slip**2)) < 2e-3 * u.max()
        assert np.corrcoef(v, trial["r"])[0, 1] < -0.8
        assert set(trial.meta["set_points"]) == {"rudder", "heading"}
        assert np.abs(trial["delta"]).max() == pytest.approx(trial.meta["set_points"]["rudder"], rel=0.1)


def test_not_simman(tmp_path):
    (tmp_path / "a.dat").write_text("hello\n")
    with pytest.raises(DataError, match="begins with 'HSVA' or 'MARIN'"):
        simman.read(tmp_path / "a.dat")


def test_the_trials_of_the_tank_are_those_of_the_ship_in_the_library():
    """One ship, one water: what an imported trial says of both is what the ship file was made with."""
    ship = load("esso_osaka_3m")
    assert frt_esso.META["ship"] == ship.name
    assert frt_esso.META["L_pp"] == ship.L_pp
    assert frt_esso.META["water_density"] == ship.model.body.rho
    assert frt_esso.META["scale"] * ship.L_pp == pytest.approx(325.0, abs=0.01), "the tanker is 325 m long"


def test_a_format_is_one_module_of_the_folder(tmp_path, monkeypatch):
    """Imports and studies find it by its name; a suffix without a dot marks a folder as one recording."""
    package = importlib.import_module("seatrial.data.formats")
    (tmp_path / "rooms").mkdir()
    (tmp_path / "rooms" / "boxed.py").write_text(
        "import numpy as np\nfrom seatrial.data import Trial\nname, suffixes = 'boxed', ('box.txt',)\n"
        "def read(source, mapping=None):\n    t = np.arange(3.0)\n    return Trial(source.stem, t, {'psi': 0.1 * t})\n"
    )
    monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path / "rooms")])
    (tmp_path / "logs" / "run").mkdir(parents=True)
    (tmp_path / "logs" / "run" / "box.txt").touch()
    [path] = import_log("boxed", tmp_path / "logs", tmp_path / "out")
    assert path.name == "run.csv"
    assert read_trial(path)["psi"][2] == 0.2
    with pytest.raises(DataError, match=r"out: .*box\.txt"):
        import_log("boxed", tmp_path / "out", tmp_path / "o")
    with pytest.raises(DataError, match="boxed takes no mapping"):
        import_log("boxed", tmp_path / "logs", tmp_path / "o", tmp_path / "m.toml")
    sys.modules.pop("seatrial.data.formats.boxed")


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [("L_pp = 7.0", "L_pp = true", "L_pp is True"), ("L_pp = 7.0", "skip = 1.5", "skip is 1.5"),
     ("L_pp = 7.0", "skip = -1", "skip"), ("L_pp = 7.0", "channels.v_m = 3\n", "channels.v_m"),
     ('frame = { velocity = "earth" }', "frame = 3", "frame is 3"),
     ('unit = "s" }', 'unit = "s", sign = -1 }', "time.sign: no key"),
     ('schema = "seatrial-mapping/1"\n', "", "schema"), ("L_pp = 7.0", 'delimiter = ""', "delimiter")],
)  # fmt: skip
def test_a_wrong_type_or_key_of_a_mapping_is_named(tmp_path, old, new, place):
    text = MAPPING.replace(old, new)
    (tmp_path / "m.toml").write_text(text.partition("[channels.v_m]")[0] if "channels.v_m = 3" in new else text)
    with pytest.raises(DataError, match=place) as error:
        mapping.read_mapping(tmp_path / "m.toml")
    assert "m.toml" in str(error.value)


@pytest.mark.parametrize("number", ["nan", "1e-40", "1e200", "9223372036854775808"])
@pytest.mark.parametrize(("schema", "format"), [
    ("seatrial-mapping/1", "csv"), ("seatrial-nmea/1", "nmea"), ("seatrial-robot/1", "mcap")])  # fmt: skip
def test_numbers_that_arithmetic_cannot_use_are_refused_in_every_mapping(tmp_path, schema, format, number):
    path = tmp_path / "m.toml"
    path.write_text(f'schema = "{schema}"\n[datum]\nlatitude = {number}\nlongitude = 139.5\n')
    with pytest.raises(DataError, match=r"m\.toml: .*datum\.latitude"):
        reader(format, path)
