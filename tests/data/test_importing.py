from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError, frt_esso, mapping, simman
from seatrial.data.importing import FORMATS, import_log, read_log
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


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sign = -1", "sgn = -1", "channels.delta: no key 'sgn'; near: sign"),
        ("frame =", "frames =", "no key 'frames'; near: frame"),
        ('"earth"', '"air"', "frame.velocity"),
        ("sign = -1", "sign = 2", "it must be 1 or -1"),
        ('unit = "kn"', 'unit = "knt"', "no unit 'knt'; near: .*kn"),
        ("[channels.delta]", "[channels.detla]", "no channel 'detla'; near: delta"),
        ('column = "HDG"\n', "", "channels.psi.column is missing"),
        ("mapping/1", "mapping/2", "schema"),
        ("[channels.u]", "[channels.u", "not readable as TOML"),
        ("[channels.psi]", "[channels.q_1]", "needs channels u"),
    ],
)
def test_bad_mapping(tmp_path, old, new, message):
    (tmp_path / "m.toml").write_text(MAPPING.replace(old, new))
    with pytest.raises(DataError, match=message) as error:
        mapping.read_mapping(tmp_path / "m.toml")
    assert "\n" not in str(error.value)


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
    assert FORMATS == ("frt-esso", "simman", "usv-asw", "nmea", "mcap", "rosbag2", "csv")


def test_esso(data_file, tmp_path):
    folder = data_file("esso_osaka_frt", "data")
    trial = read_log(folder / "zigzag" / "zigzag_31-Jul-2020_13_50_28.csv")
    assert np.isnan(trial["x"][-327:]).all()
    assert np.isfinite(trial["x"][:-327]).all()
    assert trial.t[-1] == pytest.approx(0.1 * (len(trial) - 1))
    assert trial.meta["kind"] == "zigzag"
    written = import_log("frt-esso", folder / "turning", tmp_path)
    again = read_trial(written[0])
    first = frt_esso.read(sorted((folder / "turning").glob("*.csv"))[0])
    assert len(written) == 14
    assert all(np.array_equal(again[n], first[n]) for n in first.channels)
    assert again.meta == first.meta


@pytest.mark.parametrize("folder", ["kvlcc2_hsva_simman2008", "kvlcc2_marin_simman2008"])
def test_simman(data_file, folder):
    for path in sorted(data_file(folder, "raw").glob("*.dat")):
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
