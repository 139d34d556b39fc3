from __future__ import annotations

import numpy as np
import polars
import pytest

from seatrial.data import DataError, Trial
from seatrial.data.sidecar import CONVENTIONS
from seatrial.data.trialfile import read_trial, read_trials, write_trial


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_round_trip_is_exact(tmp_path, suffix):
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.01, 1, 50))
    x = rng.normal(size=50) * 10.0 ** rng.integers(-300, 300, 50)
    x[7] = np.nan
    meta = {"ship": "s", "scale": 45.714, "L_pp": np.float64(7.0), "set_points": {"rudder": 0.1 + 0.2},
            "processing": ["one: yes"]}  # fmt: skip
    trial = Trial("a.b", t, {"x": x, "thrust": rng.normal(size=50)}, {"thrust": "N"}, meta)
    write_trial(trial, tmp_path / f"a.b{suffix}")
    back = read_trial(tmp_path / f"a.b{suffix}")
    assert back.name == "a.b"
    assert np.array_equal(back.t, t)
    assert np.array_equal(back["x"], x, equal_nan=True)
    assert np.array_equal(back["thrust"], trial["thrust"])
    assert back.units == trial.units
    assert back.meta == {**CONVENTIONS, **meta}
    assert sorted(f.name for f in tmp_path.iterdir()) == sorted([f"a.b{suffix}", "a.b.yaml"])


def test_units_become_si(tmp_path):
    (tmp_path / "a.csv").write_text(
        "t [min],psi [deg],r [deg/s],n_P [rpm],u [kn],U_T [km/h],delta_2 [deg],q [kN]\n"
        "0,180,1,60,1,3.6,90,5\n1,90,1,60,1,3.6,90,5\n"
    )
    trial = read_trial(tmp_path / "a.csv")
    assert trial.t[1] == 60
    assert trial["psi"] == pytest.approx([np.pi, np.pi / 2])
    assert trial["r"][0] == pytest.approx(np.pi / 180)
    assert trial["n_P"][0] == pytest.approx(1)
    assert trial["u"][0] == pytest.approx(0.514444, rel=1e-5)
    assert trial["U_T"][0] == pytest.approx(1)
    assert trial["delta_2"][0] == pytest.approx(np.pi / 2)
    assert (trial["q"][0], trial.unit("q")) == (5, "kN")
    assert trial.meta == CONVENTIONS


BAD = {
    "no unit": ("t [s],x\n0,1\n1,2\n", r"column 'x', line 1: no unit; write 'x \[m\]'"),
    "unknown unit": ("t [s],x [metre]\n0,1\n1,2\n", "line 1: column 'x': no unit 'metre'"),
    "wrong unit": ("t [s],x [kn]\n0,1\n1,2\n", "unit 'kn' cannot measure it; right would be one of: m"),
    "no time": ("x [m],y [m]\n0,1\n1,2\n", r"no column 't \[s\]'"),
    "back": ("t [s],x [m]\n0,1\n2,2\n1,3\n", "column 't', line 4: time goes back"),
    "repeated": ("t [s],x [m]\n0,1\n\n1,2\n1,3\n", "column 't', line 5: time repeats"),
    "word": ("t [s],x [m]\n0,1\n1,two\n", "column 'x', line 3: 'two' is not a number"),
    "comma decimals": ("t [s];x [m]\n0;1\n", "separated by commas"),
    "underscore": ("t [s],x [m]\n0,1\n1,1_000\n", "column 'x', line 3: '1_000' is not a number"),
    "full width": ("t [s],x [m]\n0,1\n1,\uff11\uff12\n", "column 'x', line 3: '\uff11\uff12' is not a number"),
    "infinite": ("t [s],x [m]\n0,1\n1,inf\n", "column 'x', line 3: infinite"),
    "no seconds": ("t [s],x [m]\n0,1\n1e300,2\n", r"line 3: time is 1e\+300 s; .* is it in ms or us"),
    "one row": ("t [s],x [m]\n0,1\n", "1 row of numbers"),
    "header only": ("t [s],x [m]\n", "0 rows of numbers"),
    "empty": ("", "the file is empty"),
    "binary": ("\0\1\2", "a binary file"),
    "ragged": ("t [s],x [m]\n0,1\n1\n", "line 3 has 1 cells, not 2"),
    "twice": ("t [s],x [m],x [m]\n0,1,2\n", "column 'x', line 1: named twice"),
    "lost time": ("t [s],x [m]\n0,1\n,2\n2,3\n", "column 't', line 3: no time"),
    "name": ("t [s],2x [m]\n0,1\n", "write 'name"),
    "foreign": ("t [s],x_position_mid [m]\n0,1\n", "import it first: seatrial import frt-esso"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_file_is_one_line_that_names_the_place(tmp_path, case):
    text, message = BAD[case]
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=message) as error:
        read_trial(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_empty_rows_at_the_end_stay_as_a_gap(tmp_path):
    (tmp_path / "a.csv").write_text("t [s],x [m]\n0,1\n0.5,2\n,\n,\n")
    trial = read_trial(tmp_path / "a.csv")
    assert trial.t == pytest.approx([0, 0.5, 1, 1.5])
    assert np.isnan(trial["x"][2:]).all()
    assert "2 empty rows" in trial.meta["processing"][-1]


def test_missing_file_names_near_ones(tmp_path):
    (tmp_path / "turning_35.csv").touch()
    with pytest.raises(DataError, match=r"near: turning_35\.csv"):
        read_trial(tmp_path / "turnin_35.csv")


SIDECARS = {
    "a: [": "line 1|not YAML",
    "- 1": "must be keys with values",
    "ship: s": "schema is None",
    "schema: manoeuvre-trial/1\nscale: -1": "scale is -1; it must be a number from 0.01 to 10000",
    "schema: manoeuvre-trial/1\nreference_point: cg": "reference_point is 'cg'",
    "schema: manoeuvre-trial/1\nprocessing: x": "processing must be a list",
    "schema: manoeuvre-trial/1\nL_ppp: 3": "no key 'L_ppp'; near: L_pp; .*'notes'",
    "schema: manoeuvre-trial/1\nweather: calm": "no key 'weather'",
    "schema: manoeuvre-trial/1\nL_pp: 7000": "L_pp is 7000; it must be a number from 0.1 to 600",
    "schema: manoeuvre-trial/1\nwater_density: 1.025": "water_density is 1.025; .* 900 to 1100",
    "schema: manoeuvre-trial/1\nscale: 1:45": "scale is '1:45'; it must be a number",
    "schema: manoeuvre-trial/1\nL_pp: 1_0": "L_pp is '1_0'; it must be a number",
    "schema: manoeuvre-trial/1\nset_points: {rudder: 35}": "rudder is 35 rad; .* called 'rudder .deg.'",
    "schema: manoeuvre-trial/1\nset_points: {'delta [grad]': 5}": "no unit of an angle",
    "schema: manoeuvre-trial/1\nheld: n_P": "held must be a list of texts, one a channel",
    "schema: manoeuvre-trial/1\ndatum: {latitude: 95, longitude: 0}": "datum at latitude 95",
    "schema: manoeuvre-trial/1\ndatum: {lat: 35}": "datum needs latitude and longitude",
    "schema: manoeuvre-trial/1\nstart: 2024-99-99": "start is '2024-99-99'; write 2024-05-01T12:00:00",
    "schema: manoeuvre-trial/1\nstart: 9999-12-31T00:00:00+00:00": "go from 1970 to 2262",
    "schema: manoeuvre-trial/1\ndelta_positive: port_turn\ndelta_positive: starboard_turn": "line 3: .* twice",
    "schema: manoeuvre-trial/1\n? [1]\n: 2": "a key is a plain text",
    "schema: manoeuvre-trial/1\nnotes: &n [*n]": "anchors and aliases are not read",
    "schema: manoeuvre-trial/1\nL_pp: " + 400 * "9": "a whole number of more than 19 digits",
    "schema: manoeuvre-trial/1\nL_pp: " + 5000 * "9": "a whole number of more than 19 digits",
    "schema: manoeuvre-trial/1\nL_pp: 1e308": "it must be a number from",
    "schema: manoeuvre-trial/1\nnotes: " + 50_000 * "[": "nested too deeply",
    "schema: manoeuvre-trial/1\nnotes: !!python/name:os.system": "not YAML",
    'schema: manoeuvre-trial/1\n"a\\nb\\e[31m": 1': r"no key 'a\\nb\\x1b",
    "#" + 1_000_001 * "a": "200000 are the most",
}


@pytest.mark.slow
@pytest.mark.parametrize("text", SIDECARS, ids=range(len(SIDECARS)))
def test_bad_sidecar(tmp_path, text):
    (tmp_path / "a.csv").write_text("t [s],x [m]\n0,1\n1,2\n")
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(DataError, match=SIDECARS[text]) as caught:
        read_trial(tmp_path / "a.csv")
    assert str(caught.value).isprintable()


def test_a_few_lines_of_aliases_become_no_gigabytes(tmp_path):
    lines = ["a0: &a0 [x]", *(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 10))]
    (tmp_path / "a.csv").write_text("t [s],x [m]\n0,1\n1,2\n")
    (tmp_path / "a.yaml").write_text("\n".join(["schema: manoeuvre-trial/1", *lines]))
    with pytest.raises(DataError, match=r"line 2: not YAML .anchors and aliases are not read"):
        read_trial(tmp_path / "a.csv")


def test_texts_that_look_like_numbers_come_back_as_texts(tmp_path):
    texts = ("1e3", "08", "010", "no", "1:30", "1_000", "~", "", "2024-05-01", "0x1F", "true", ".inf", "a\nb", "é")
    meta = {"notes": {f"k{k}": text for k, text in enumerate(texts)} | {"e": 1e-5, "n": 8, "f": True, "o": None}}
    write_trial(Trial("a", np.arange(2.0), {"x": np.zeros(2)}, {}, meta), tmp_path / "a.csv")
    assert read_trial(tmp_path / "a.csv").meta["notes"] == meta["notes"]


def test_foreign_rudder_sign_is_turned(tmp_path):
    (tmp_path / "a.csv").write_text("t [s],delta [rad]\n0,1\n1,2\n")
    (tmp_path / "a.yaml").write_text("schema: manoeuvre-trial/1\ndelta_positive: port_turn\n")
    trial = read_trial(tmp_path / "a.csv")
    assert trial["delta"] == pytest.approx([-1, -2])
    assert trial.meta["delta_positive"] == "starboard_turn"


def test_failed_write_leaves_the_old_file(tmp_path, made):
    write_trial(made, tmp_path / "made.csv")
    before = {f.name: f.read_bytes() for f in tmp_path.iterdir()}
    for bad in (made.having(q=made.t), made.having(x=made.t / 0.0 if False else np.full(len(made), np.inf))):
        with pytest.raises(DataError):
            write_trial(bad, tmp_path / "made.csv") if "q" not in bad else write_trial(
                Trial(bad.name, bad.t, bad.channels, {"q": "bogus"}, bad.meta), tmp_path / "made.csv"
            )
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == before


def test_read_trials_sorts_a_folder_and_refuses_an_empty_one(tmp_path, made):
    with pytest.raises(DataError, match="no trial file"):
        read_trials(tmp_path)
    for name in ("b", "a"):
        write_trial(made, tmp_path / f"{name}.csv")
    assert [t.name for t in read_trials([tmp_path, tmp_path / "a.csv"])] == ["a", "b"]
    write_trial(made, tmp_path / "a.parquet")
    with pytest.raises(DataError, match="second trial of this name"):
        read_trials(tmp_path)


def test_bad_parquet(tmp_path):
    (tmp_path / "a.parquet").write_bytes(b"PAR1 no")
    with pytest.raises(DataError, match="not a readable Parquet"):
        read_trial(tmp_path / "a.parquet")


def test_channels_of_thrusters_come_out_in_si(tmp_path):
    path = tmp_path / "log.csv"
    head = "t [s],alpha_1 [deg],alpha_1_cmd [deg],n_bow [rpm],f_2 [kN],n_cells [-]"
    path.write_text(f"{head}\n0,90,45,60,2,3\n1,0,0,0,0,3\n")
    trial = read_trial(path)
    assert trial["alpha_1"][0] == pytest.approx(np.pi / 2)
    assert trial["alpha_1_cmd"][0] == pytest.approx(np.pi / 4)
    assert (trial["n_bow"][0], trial["f_2"][0], trial["n_cells"][0]) == (1.0, 2000.0, 3.0)
    assert [trial.unit(n) for n in ("alpha_1", "n_bow", "f_2", "n_cells")] == ["rad", "1/s", "N", "-"]


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ("[]", "must be a JSON object of texts"),
        ('{"t": 1, "x": "m"}', "must be a JSON object of texts"),
        ('{"t": "s", "x": ["m"]}', "must be a JSON object of texts"),
        (100_000 * "[", "not a readable Parquet file"),
        ('{"t": "s"}', "column 'x': no unit"),
        ('{"t": "s", "x": "m"}', "column 'x', row 2: infinite"),
    ],
    ids=range(6),
)
def test_damaged_units_of_a_parquet_file(tmp_path, units, message):
    frame = polars.DataFrame({"t": [0.0, 1.0, 2.0], "x": [0.0, np.inf, 1.0]})
    frame.write_parquet(tmp_path / "a.parquet", metadata={"seatrial.units": units})
    with pytest.raises(DataError, match=message) as caught:
        read_trial(tmp_path / "a.parquet")
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("text", [
    "time,lat,lon\n1,2,3\n", "time;lat;lon\n1;2;3\n", "$GPRMC,120000,A,1000.0,N\n", '{"a":1}\n',
    "2020-01-01 10:00:00,1\n2020-01-01 10:00:01,2\n", ",,,\n",
])  # fmt: skip
def test_a_raw_log_is_told_to_be_imported(tmp_path, text):
    (tmp_path / "raw.csv").write_text(text)
    for given in (tmp_path, tmp_path / "raw.csv", [tmp_path / "raw.csv"]):
        with pytest.raises(DataError, match=r"raw\.csv: no trial file.*seatrial import --guess") as caught:
            read_trials(given)
        assert str(caught.value).isprintable()


def test_a_fault_in_the_header_of_a_trial_file_is_still_named(tmp_path):
    for text, told in (("t;x\n0;1\n", "separated by commas"), ("t,x [m]\n0,1\n", r"write 't \[s\]'"),
                       ("time,psi\n0,1\n", "column 'time'")):  # fmt: skip
        (tmp_path / "a.csv").write_text(text)
        with pytest.raises(DataError, match=told):
            read_trial(tmp_path / "a.csv")


def test_a_name_that_no_file_system_takes_is_told_in_one_line(tmp_path):
    for given in (tmp_path / ("a" * 300), ["a" * 300 + ".csv"], "a/" * 3000):
        with pytest.raises(DataError) as caught:
            read_trials(given)
        assert len(str(caught.value)) < 200
