"""Tables of captive tests: our names, a mapping of foreign ones, primes, repeated runs, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.captive import read_captive

OURS = """U [m/s],beta [deg],r [deg/s],delta [deg],n_P [rpm],Y [N],N [N m]
1.0,-10,0,0,600,-50,-40
1.0,0,0,0,600,1,1
1.0,10,0,0,600,52,41
1.0,0,2.0,0,600,20,-30
1.0,0,2.0,0,600,20,-30
"""
MAPPING = """schema = "seatrial-captive/1"
L_pp = 5.0
d = 0.4
over = "{over}"
[columns]
U = {{ column = "V", unit = "m/s" }}
beta = {{ column = "drift", unit = "deg", sign = {sign} }}
r = {{ column = "r'", unit = "'" }}
Y = {{ column = "Y'", unit = "'" }}
N = {{ column = "N'", unit = "'" }}
"""
THEIRS = """run;V;drift;r';Y';N'
""".replace(";", ",") + "1,2.0,5,0,0.01,0.005\n2,2.0,0,0,0.0,0.0\n3,2.0,-5,0,-0.01,-0.005\n4,2.0,0,0.4,0.002,-0.001\n"


def written(folder: Path, **texts: str) -> list[Path]:
    out = []
    for name, text in texts.items():
        path = folder / name.replace("_toml", ".toml").replace("_csv", ".csv")
        path.write_text(text, encoding="utf-8")
        out.append(path)
    return out


def test_a_table_with_our_names_and_units(tmp_path: Path) -> None:
    (path,) = written(tmp_path, tank_csv=OURS)
    runs = read_captive([path], L_pp=7.0)
    assert (len(runs), runs.repeated) == (4, 1)
    assert runs.kinds == ("drift", "straight", "drift", "yaw")
    assert runs.column("v_m")[2] == pytest.approx(-math.sin(math.radians(10)))
    assert runs.column("r")[3] == pytest.approx(math.radians(2.0))
    assert runs.column("n_P")[0] == pytest.approx(10.0)
    assert runs.loads["N"].tolist() == [-40, 1, 41, -30]


@pytest.mark.parametrize(("over", "across"), [("L^2", 5.0), ("L d", 0.4)])
def test_primes_become_newtons_by_what_they_are_over(tmp_path: Path, over: str, across: float) -> None:
    table, mapping = written(tmp_path, tank_csv=THEIRS, map_toml=MAPPING.format(over=over, sign=1))
    runs = read_captive([table], mapping)
    force = 0.5 * 1000.0 * 5.0 * across * 2.0**2
    assert runs.loads["Y"][0] == pytest.approx(0.01 * force)
    assert runs.loads["N"][0] == pytest.approx(0.005 * force * 5.0)
    assert runs.column("r")[3] == pytest.approx(0.4 * 2.0 / 5.0)
    assert np.isclose(runs.U, 2.0).all()


def test_a_moment_about_another_point_becomes_one_about_midship(tmp_path: Path) -> None:
    said = MAPPING.format(over="L^2", sign=1)
    texts = {"at_midship": said, "ahead": said.replace("d = 0.4", "d = 0.4\nmoment_about = 0.5"),
             "beyond": said.replace("d = 0.4", "d = 0.4\nmoment_about = 3.0"),
             "alone": said.replace("d = 0.4", "moment_about = 0.5").replace('Y = {', '# Y = {')}  # fmt: skip
    table, *maps = written(tmp_path, tank_csv=THEIRS, **{f"{name}_toml": text for name, text in texts.items()})
    midship, ahead = (read_captive([table], one).loads for one in maps[:2])
    assert ahead["N"] == pytest.approx(midship["N"] + 0.5 * midship["Y"])
    assert ahead["N"][0] > midship["N"][0] > 0
    for one, words in zip(maps[2:], ("outside a model", "needs Y"), strict=True):
        with pytest.raises(DataError, match=words):
            read_captive([table], one)


def test_a_propeller_at_another_load_is_another_kind_of_test(tmp_path: Path) -> None:
    rows = "U [m/s],n_P [rps],delta [deg],X [N]\n1,10,0,1\n1,10,10,2\n1,10,20,3\n0.5,10,0,4\n0.5,10,10,5\n"
    runs = read_captive(written(tmp_path, tank_csv=rows), L_pp=7.0)
    assert runs.kinds == ("straight", "rudder", "rudder", "straight (other load)", "rudder (other load)")


def test_tables_of_one_program_are_read_together(tmp_path: Path) -> None:
    paths = written(tmp_path, drift_csv=OURS, open_csv="U [m/s],T [N]\n1.0,30\n")
    runs = read_captive(paths, L_pp=7.0)
    assert len(runs) == 5
    assert np.isnan(runs.loads["T"]).sum() == 4
    assert np.isnan(runs.loads["Y"]).sum() == 1


@pytest.mark.parametrize(
    ("table", "mapping", "said"),
    [(OURS, None, None), (OURS.replace("beta [deg]", "beta [m]"), None, "cannot measure beta"),
     (OURS.replace("U [m/s]", "V [m/s]"), None, "no speed"),
     (OURS.replace("Y [N],N [N m]", "a [N],b [N m]"), None, "no load"),
     (OURS.replace("-40\n", "\n"), None, None),
     (OURS.replace("1.0,-10", ",-10"), None, "row 1: no speed, or a gap"),
     (OURS.replace("600,-50", "600,x"), None, "line 2: 'x' is not a number"),
     ("a,b\n1,2\n", None, "no column such as"),
     (THEIRS, MAPPING.format(over="L^2", sign=-1), "Y falls with beta over 2 runs|Y falls with beta"),
     (THEIRS, MAPPING.format(over="B d", sign=1), "over is 'B d'"),
     (THEIRS, MAPPING.format(over="L d", sign=1).replace("d = 0.4\n", ""), "needs d"),
     (THEIRS, MAPPING.format(over="L^2", sign=1).replace('"drift"', '"Drift"'), "no column 'Drift'"),
     (THEIRS, MAPPING.format(over="L^2", sign=1).replace("beta =", "bta ="), "no quantity of a captive test 'bta'"),
     (THEIRS, MAPPING.format(over="L^2", sign=1).replace('"V", unit = "m/s"', '"V", unit = "\'"'), "cannot be primed"),
     (THEIRS, MAPPING.format(over="L^2", sign=3), "it must be 1 or -1"),
     ("", None, "the file is empty")],
)  # fmt: skip
def test_what_is_refused_in_one_line(tmp_path: Path, table: str, mapping: str | None, said: str | None) -> None:
    (path,) = written(tmp_path, tank_csv=table)
    place = None if mapping is None else written(tmp_path, map_toml=mapping)[0]
    if said is None:
        assert len(read_captive([path], place, L_pp=7.0)) == 4
        return
    with pytest.raises(DataError, match=said) as raised:
        read_captive([path], place, L_pp=7.0)
    assert str(tmp_path) in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_rudder_that_turns_to_port_is_refused(tmp_path: Path) -> None:
    rows = "U [m/s],delta [deg],N [N m]\n" + "".join(f"1.0,{d},{-d}\n" for d in (-20, -10, 10, 20))
    with pytest.raises(DataError, match="N falls with delta over 4 runs of rudder"):
        read_captive(written(tmp_path, tank_csv=rows), L_pp=7.0)
