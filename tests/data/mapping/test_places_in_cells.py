"""Positions that stand in one cell, or on the grid of UTM: every way to write one comes back to its last digit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.geodesy import zone_of
from seatrial.data.guess import guess
from seatrial.data.mapping.angles import halves
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read

HEAD = 'schema = "seatrial-mapping/1"\ntime = { column = "t", unit = "s" }\n'
KNOT = 1852.0 / 3600.0


def parts(angle: float, digits: int) -> tuple[str, str]:
    """Whole degrees and minutes; the minutes are rounded before they are split from the degrees."""
    whole = round(abs(angle) * 60.0, digits)
    return f"{int(whole // 60.0)}", f"{whole % 60.0:0{3 + digits}.{digits}f}"


def side(angle: float, letters: str) -> str:
    return letters[0] if angle >= 0.0 else letters[1]


FORMS: dict[str, tuple[str, float, Callable[[float, float], str]]] = {
    "35 10.5000N 139 42.1000E": ("dms", 1e-4 / 60.0, lambda a, o: " ".join(
        " ".join(parts(x, 4)) + side(x, s) for x, s in ((a, "NS"), (o, "EW")))),
    "N35-10.5000 / E139-42.1000": ("dms", 1e-4 / 60.0, lambda a, o: " / ".join(
        side(x, s) + "-".join(parts(x, 4)) for x, s in ((a, "NS"), (o, "EW")))),
    "35° 10.5000' N, 139° 42.1000' E": ("dms", 1e-4 / 60.0, lambda a, o: ", ".join(
        "{}° {}' ".format(*parts(x, 4)) + side(x, s) for x, s in ((a, "NS"), (o, "EW")))),
    "35.1750000, 139.7016667": ("deg", 1e-7, lambda a, o: f"{a:.7f}, {o:.7f}"),
    "(35.1750000 139.7016667)": ("deg", 1e-7, lambda a, o: f"({a:.7f} {o:.7f})"),
    "35.1750000N 139.7016667E": ("deg", 1e-7, lambda a, o: f"{abs(a):.7f}{side(a, 'NS')} {abs(o):.7f}{side(o, 'EW')}"),
    "139.7016667E;35.1750000N": ("deg", 1e-7, lambda a, o: f"{abs(o):.7f}{side(o, 'EW')};{abs(a):.7f}{side(a, 'NS')}"),
    "POINT(139.7016667 35.1750000)": ("deg", 1e-7, lambda a, o: f"POINT({o:.7f} {a:.7f})"),
    "SRID=4326;POINT Z (139.7016667 35.1750000 12)": (
        "deg", 1e-7, lambda a, o: f"SRID=4326;POINT Z ({o:.7f} {a:.7f} 12)"),
}  # fmt: skip


def written(path: Path, cells: list[str], mark: str = ",") -> Path:
    lines = [f"t{mark}Position", *(f'{k}{mark}"{cell}"' for k, cell in enumerate(cells))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("form", FORMS)
def test_every_way_to_write_a_place_comes_back(form: str, tmp_path: Path) -> None:
    format, digit, write = FORMS[form]
    hand = np.random.default_rng(7)
    latitude = hand.choice([-1.0, 1.0]) * (hand.uniform(0.0, 70.0) + 1e-4 * np.arange(60))
    longitude = hand.choice([-1.0, 1.0]) * (hand.uniform(0.0, 170.0) + 1e-4 * np.arange(60))
    path = written(tmp_path / "log.csv", [write(a, o) for a, o in zip(latitude, longitude, strict=True)])
    (tmp_path / "m.toml").write_text(
        f'{HEAD}[position]\nlatitude = "Position"\nlongitude = "Position"\nformat = "{format}"\ndatum = [0.0, 0.0]\n')
    assert halves(write(1.0, -2.0)) is not None
    (trial,) = read(path, read_mapping(tmp_path / "m.toml"))
    datum = trial.meta["datum"]
    assert (datum["latitude"], datum["longitude"]) == (0.0, 0.0)
    a, b = 6378137.0, 6378137.0 * np.sqrt(1.0 - 0.00669437999014)
    c, s = np.cos(np.radians(latitude)), np.sin(np.radians(latitude))
    across, up = a**2 * c / np.hypot(a * c, b * s), b**2 * s / np.hypot(a * c, b * s)
    metres = 111_320.0 * 0.51 * digit
    np.testing.assert_allclose(trial["x"], up, atol=1.02 * metres)
    np.testing.assert_allclose(trial["y"], across * np.sin(np.radians(longitude)), atol=1.5 * metres)


def turn(folder: Path, form: str, south: bool = False) -> Path:
    """A turn of 200 s at 5 m/s, its places in cells."""
    t = np.arange(200.0)
    course = 40.0 + 20.0 * np.sin(t / 25.0)
    north, east = (np.cumsum(5.0 * one(np.radians(course))) for one in (np.cos, np.sin))
    latitude = (-35.17 if south else 35.17) + north / 110_950.0
    longitude = (-70.2 if south else 139.7) + east / (111_320.0 * np.cos(np.radians(35.17)))
    rows = [f'{k},"{FORMS[form][2](a, o)}",{c:.2f},{5.0 / KNOT:.3f},{c:.2f}'
            for k, a, o, c in zip(range(200), latitude, longitude, course, strict=True)]  # fmt: skip
    (folder / "log.csv").write_text("\n".join(["Time [s],Position,Heading,SOG,COG", *rows]) + "\n", encoding="utf-8")
    return folder / "log.csv"


@pytest.mark.slow
@pytest.mark.parametrize("south", [False, True])
@pytest.mark.parametrize("form", FORMS)
def test_a_guess_reads_them_and_the_track_confirms_it(form: str, south: bool, tmp_path: Path) -> None:
    path = turn(tmp_path, form, south)
    text = guess(path).text
    assert 'latitude = "Position"\nlongitude = "Position"' in text
    assert 'unit = "kn"' in text
    (tmp_path / "m.toml").write_text(text)
    (trial,) = read(path, read_mapping(tmp_path / "m.toml"))
    assert np.hypot(np.gradient(trial["x"]), np.gradient(trial["y"]))[1:-1] == pytest.approx(5.0, rel=0.06)


def test_a_longitude_that_comes_first_is_seen_by_its_size(tmp_path: Path) -> None:
    cells = [f"{139.7 + 1e-5 * k:.6f} {35.1 + 1e-5 * k:.6f}" for k in range(60)]
    lines = ["Time [s],Position,Heading", *(f'{k},"{cell}",40' for k, cell in enumerate(cells))]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    text = guess(tmp_path / "log.csv").text
    assert 'first = "longitude"' in text
    (tmp_path / "m.toml").write_text(text)
    (trial,) = read(tmp_path / "log.csv", read_mapping(tmp_path / "m.toml"))
    assert trial.meta["datum"] == pytest.approx({"latitude": 35.1, "longitude": 139.7})


def test_numbers_in_pairs_that_are_no_place_stay_texts(tmp_path: Path) -> None:
    lines = ["Time [s],Heading,Pair", *(f'{k},{k / 7:.3f},"{k} {k + 1}"' for k in range(60))]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    assert "[position]" not in guess(tmp_path / "log.csv").text


@pytest.mark.parametrize(("cell", "decimal", "found"), [
    ("35,175; 139,702", ",", ("35,175", "139,702")), ("35,175 139,702", ",", ("35,175", "139,702")),
    ("35,175, 139,702", ",", None), ("35.175", ".", None), ("POINT(139.702)", ".", None), ("N35 10.5", ".", None),
    ("POINT(1 2 3 4)", ".", ("2", "1")), ("[1,2]", ".", ("1", "2")), ("", ".", None),
])  # fmt: skip
def test_a_cell_is_halved_or_is_none(cell: str, decimal: str, found: tuple[str, str] | None) -> None:
    assert halves(cell, decimal) == found


TWO = '[position]\nlatitude = "Position"\nlongitude = "b"\n'
PLACE = '[position]\nlatitude = "Position"\nlongitude = "Position"\n'


@pytest.mark.parametrize(("cells", "keys", "said"), [
    (["35.1, 139.7", "here"], PLACE, r"column 'Position', line 3: 'here' is no latitude and longitude"),
    (["35.1, 139.7", "95.1, 139.7"], PLACE, r"column 'Position, latitude', line 3: 95.1 is no latitude"),
    (["35.1, 139.7"] * 2, PLACE + 'latitude_letter = "x"\n', "columns of minutes and letters are of two columns"),
    (["35.1, 139.7"] * 2, PLACE + 'format = "utm"\nzone = "32N"\n', "northings and eastings are two columns"),
    (["1"] * 2, TWO + 'first = "longitude"\n', "position.first is of one"),
    (["1"] * 2, TWO + 'format = "utm"\n', 'position.zone and format = "utm"'),
    (["1"] * 2, TWO + 'zone = "32N"\n', 'position.zone and format = "utm"'),
    (["1"] * 2, TWO + 'format = "utm"\nzone = "61N"\n', "no zone of UTM"),
    (["1"] * 2, PLACE + '[channels.psi]\ncolumn = "Position"\nunit = "deg"\n', "is used twice"),
])  # fmt: skip
def test_what_cannot_be_a_place_is_refused(cells: list[str], keys: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", cells)
    (tmp_path / "m.toml").write_text(HEAD + keys)
    with pytest.raises(DataError, match=said):
        read(path, read_mapping(tmp_path / "m.toml"))


def utm(latitude: np.ndarray, longitude: np.ndarray, zone: int) -> tuple[np.ndarray, np.ndarray]:
    """Northing and easting of the northern half by the series of Snyder (1987), eq. 8-9 to 8-15, to a millimetre."""
    a, e2 = 6378137.0, 0.00669437999014
    phi, lam = np.radians(latitude), np.radians(longitude - (6 * zone - 183))
    second = e2 / (1.0 - e2)
    N, T = a / np.sqrt(1.0 - e2 * np.sin(phi) ** 2), np.tan(phi) ** 2
    C, A = second * np.cos(phi) ** 2, lam * np.cos(phi)
    M = a * ((1 - e2 / 4 - 3 * e2**2 / 64 - 5 * e2**3 / 256) * phi
             - (3 * e2 / 8 + 3 * e2**2 / 32 + 45 * e2**3 / 1024) * np.sin(2 * phi)
             + (15 * e2**2 / 256 + 45 * e2**3 / 1024) * np.sin(4 * phi)
             - 35 * e2**3 / 3072 * np.sin(6 * phi))  # fmt: skip
    east = 0.9996 * N * (A + (1 - T + C) * A**3 / 6 + (5 - 18 * T + T**2 + 72 * C - 58 * second) * A**5 / 120)
    north = 0.9996 * (M + N * np.tan(phi) * (A**2 / 2 + (5 - T + 9 * C + 4 * C**2) * A**4 / 24
                                             + (61 - 58 * T + T**2 + 600 * C - 330 * second) * A**6 / 720))  # fmt: skip
    return north, east + 500_000.0


@pytest.mark.parametrize(("zone", "heads"), [
    ("54N", ("Northing", "Easting")), ("54N", ("Northing (UTM 54N)", "Easting (UTM 54N)")),
    ("54S", ("Northing", "Easting")),
])  # fmt: skip
def test_the_grid_of_utm_becomes_places_of_the_earth(zone: str, heads: tuple[str, str], tmp_path: Path) -> None:
    latitude, longitude = 35.1 + 1e-4 * np.arange(80), 139.7 + 2e-4 * np.sin(np.arange(80) / 9.0)
    north, east = utm(latitude, longitude, 54)
    north, sign = (10_000_000.0 - north, -1.0) if zone == "54S" else (north, 1.0)
    rows = [f"{k},{n:.4f},{e:.4f}" for k, n, e in zip(range(80), north, east, strict=True)]
    lines = [f"t,{heads[0]},{heads[1]}", *rows]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    keys = f'latitude = "{heads[0]}"\nlongitude = "{heads[1]}"\nformat = "utm"\nzone = "{zone}"\n'
    (tmp_path / "m.toml").write_text(f"{HEAD}[position]\n{keys}")
    (trial,) = read(tmp_path / "log.csv", read_mapping(tmp_path / "m.toml"))
    assert trial.meta["datum"] == pytest.approx({"latitude": sign * latitude[0], "longitude": longitude[0]}, abs=2e-8)
    fixes = [f"{k},{sign * a:.12f},{o:.12f}" for k, a, o in zip(range(80), latitude, longitude, strict=True)]
    (tmp_path / "fixes.csv").write_text("\n".join(["t,a,o", *fixes]) + "\n")
    (tmp_path / "p.toml").write_text(f'{HEAD}[position]\nlatitude = "a"\nlongitude = "o"\n')
    (true,) = read(tmp_path / "fixes.csv", read_mapping(tmp_path / "p.toml"))
    for name in ("x", "y"):
        np.testing.assert_allclose(trial[name], true[name], atol=3e-3)
    # the plain grid is off by its convergence, -0.75 deg here
    assert np.abs(north - north[0] - trial["x"]).max() > 0.3


@pytest.mark.parametrize(("text", "zone", "south"), [
    ("54N", 54, False), ("54 s", 54, True), ("1C", 1, True), ("60M", 60, True), ("32V", 32, False), ("9x", 9, False),
])  # fmt: skip
def test_a_zone_is_of_the_half_that_its_letter_or_its_band_lies_in(text: str, zone: int, south: bool) -> None:
    assert zone_of(text) == (zone, south)


@pytest.mark.parametrize("text", ["0N", "61N", "54", "N54", "54I", "54O", "54A", "54Y", "", "54NN"])
def test_what_is_no_zone_is_refused(text: str) -> None:
    with pytest.raises(DataError, match="no zone of UTM"):
        zone_of(text)


@pytest.mark.parametrize(("north", "east", "said"), [
    (5e5, 4e6, "4000000 is no easting of 100000 to 900000 m; are the two columns exchanged"),
    (-5.0, 5e5, "no northing"), (1.2e7, 5e5, "no northing"),
])  # fmt: skip
def test_what_is_off_the_grid_is_refused(north: float, east: float, said: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(f"t,N,E\n0,{north},{east}\n1,{north},{east}\n")
    keys = 'latitude = "N"\nlongitude = "E"\nformat = "utm"\nzone = "32N"\n'
    (tmp_path / "m.toml").write_text(f"{HEAD}[position]\n{keys}")
    with pytest.raises(DataError, match=said):
        read(tmp_path / "log.csv", read_mapping(tmp_path / "m.toml"))


@pytest.mark.parametrize(("extra", "head", "zone"), [
    ("", " (UTM 54N)", "54N"), ("Zone", "", "54S"), ("", "", ""), ("UTM zone", "", "54S"), ("", " zone 54", ""),
])  # fmt: skip
def test_a_guess_finds_the_zone_or_doubts(extra: str, head: str, zone: str, tmp_path: Path) -> None:
    t = np.arange(100.0)
    course = np.radians(40.0 + 20.0 * np.sin(t / 15.0))
    north, east = 3_900_000.0 + np.cumsum(5.0 * np.cos(course)), 380_000.0 + np.cumsum(5.0 * np.sin(course))
    lines = [f"Time [s],Northing{head},Easting{head},Heading [deg]" + f",{extra}" * bool(extra)]
    lines += [f"{k},{n:.3f},{e:.3f},{np.degrees(c):.2f}" + f",{zone}" * bool(extra)
              for k, n, e, c in zip(range(100), north, east, course, strict=True)]  # fmt: skip
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    found = guess(tmp_path / "log.csv")
    assert (f'format = "utm"\nzone = "{zone}"' in found.text) == bool(zone)
    assert any('write [position] with format = "utm"' in one for one in found.doubts) == (not zone)


@pytest.mark.parametrize("text", ["navigation.headingTrue", "steering.rudderAngle", "North East", "NE 5", "no entry"])
def test_words_with_letters_of_sides_are_no_place(text: str) -> None:
    assert halves(text) is None
