"""Frames, units and files that a guess took in silence: mirrored maps, nautical miles, ECEF, files that it left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from columns import signal

from seatrial.data import DataError, Trial
from seatrial.data.formats import csv
from seatrial.data.guess import guess
from seatrial.data.guess.helm import rudder_sense, with_rudder
from seatrial.data.guess.motion import with_units
from seatrial.data.guess.roles import STRANGE, pointed, strangers

pytestmark = pytest.mark.slow
KNOT, MILE = 1852.0 / 3600.0, 1852.0


def weaving(rows: int = 400) -> dict[str, np.ndarray]:
    """A ship of 6 m/s that weaves, with a rudder a little ahead of its rate of turn; SI, north and east."""
    t = 0.5 * np.arange(float(rows))
    psi = 0.7 + 0.6 * np.sin(t / 15.0) + 0.3 * np.sin(t / 31.0)
    r = 0.04 * np.cos(t / 15.0) + 0.3 / 31.0 * np.cos(t / 31.0)
    u, v = 6.0 + 0.5 * np.cos(t / 40.0), -20.0 * r
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    x, y = (np.concatenate([[0.0], np.cumsum(0.25 * (one[1:] + one[:-1]))]) for one in (north, east))
    delta = 0.2 * np.cos((t + 1.5) / 15.0) + 0.05 * np.cos((t + 1.5) / 31.0)
    noise = np.random.default_rng(2).normal(0.0, 1.0, (3, rows))
    return {"t": t, "x": x + 0.03 * noise[0], "y": y + 0.03 * noise[1],
            "hdg": np.degrees(psi) % 360.0 + 0.02 * noise[2],
            "U": np.hypot(u, v), "cog": np.degrees(np.arctan2(east, north)) % 360.0, "rud": np.degrees(delta),
            "n": 180.0 + t % 3.0}  # fmt: skip


def trial(path: Path, **columns: np.ndarray) -> tuple[Trial, str, tuple[str, ...]]:
    """What the guess makes of a table, its mapping, and its doubts."""
    rows = zip(*(one.tolist() for one in columns.values()), strict=True)
    lines = [",".join(f"{one:.7f}" if isinstance(one, float) else one for one in row) for row in (columns, *rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = guess(path)
    mapping = path.with_suffix(".toml")
    mapping.write_text(found.text, encoding="utf-8")
    return csv.read(path, csv.read_mapping(mapping)), found.text, found.doubts


def test_a_compass_keeps_its_sense_where_a_map_is_mirrored(tmp_path: Path) -> None:
    """y to the west, beside a heading that counts clockwise as compasses do: the map is turned, and both are told."""
    s = weaving()
    made, text, doubts = trial(tmp_path / "a.csv", t=s["t"], x=s["x"], y=-s["y"], heading=s["hdg"], rudder=s["rud"])
    np.testing.assert_allclose(made["y"], s["y"], atol=1e-6)
    np.testing.assert_allclose(np.cos(made["psi"] - np.radians(s["hdg"])), 1.0, atol=1e-9)
    np.testing.assert_allclose(made["delta"], np.radians(s["rud"]), atol=1e-6)
    assert "y counts to the west" in " ".join(doubts)
    assert 'column = "y"\nunit = "m"\nsign = -1' in text


def test_a_yaw_that_counts_anticlockwise_is_turned_and_the_map_is_not(tmp_path: Path) -> None:
    s = weaving()
    yaw = np.degrees(np.unwrap(np.radians(-s["hdg"])))
    made, _, doubts = trial(tmp_path / "a.csv", t=s["t"], x=s["x"], y=s["y"], yaw=yaw)
    np.testing.assert_allclose(made["y"], s["y"], atol=1e-6)
    np.testing.assert_allclose(np.cos(made["psi"] - np.radians(s["hdg"])), 1.0, atol=1e-9)
    assert not any("west" in one for one in doubts)


def test_axes_of_robots_look_like_those_of_ships_and_are_a_doubt(tmp_path: Path) -> None:
    """x east, y north, yaw anticlockwise from east is the mirror image of x north, y east, yaw clockwise from north."""
    s = weaving()
    yaw = np.unwrap(np.radians(90.0 - s["hdg"]))
    _, _, doubts = trial(tmp_path / "a.csv", t=s["t"], x=s["y"], y=s["x"], yaw=yaw)
    assert any("those of robots" in one for one in doubts)
    for names in (("x", "y", "psi"), ("north", "east", "yaw"), ("x", "y", "heading")):
        columns = dict(zip(names, (s["x"], s["y"], s["hdg"]), strict=True))
        _, _, doubts = trial(tmp_path / "b.csv", t=s["t"], **columns)
        assert not any("robots" in one for one in doubts), names


@pytest.mark.parametrize(("unit", "size", "speed", "as_fast"), [
    ("NM", MILE, KNOT, "NM"), ("km", 1000.0, 1.0, "km"), ("ft", 0.3048, 1.0, "ft"), ("NM", MILE, 1.0, "NM"),
])  # fmt: skip
def test_a_track_has_the_unit_in_which_it_is_as_fast_as_the_speed(
    unit: str, size: float, speed: float, as_fast: str, tmp_path: Path
) -> None:
    s = weaving()
    made, text, doubts = trial(tmp_path / "a.csv", t=s["t"], north=s["x"] / size, east=s["y"] / size, hdg=s["hdg"],
                               sog=s["U"] / speed)  # fmt: skip
    np.testing.assert_allclose(made["x"], s["x"], atol=1e-3)
    np.testing.assert_allclose(made["y"], s["y"], atol=1e-3)
    np.testing.assert_allclose(made["U_G"], s["U"], atol=1e-5)
    assert f'unit = "{unit}"' in text
    assert any(f"in {as_fast} its track is as fast" in one for one in doubts)


@pytest.mark.parametrize("clock", [1.0, 1000.0])
@pytest.mark.parametrize("speed", [1.0, KNOT, 1.0 / 3.6])
def test_a_track_in_metres_stays_in_metres(speed: float, clock: float, tmp_path: Path) -> None:
    s = weaving()
    made, _, doubts = trial(tmp_path / "a.csv", t=clock * s["t"], north=s["x"], east=s["y"], hdg=s["hdg"],
                            sog=s["U"] / speed)  # fmt: skip
    np.testing.assert_allclose(made["x"], s["x"], atol=1e-6)
    assert not any("as fast as" in one for one in doubts)


def test_a_speed_over_ground_alone_is_read(tmp_path: Path) -> None:
    s = weaving()
    made, text, _ = trial(tmp_path / "a.csv", t=s["t"], x=s["x"], y=s["y"], hdg=s["hdg"], sog=s["U"] / KNOT)
    np.testing.assert_allclose(made["U_G"], s["U"], atol=1e-5)
    assert 'column = "sog"\nunit = "kn"' in text
    made, _, _ = trial(tmp_path / "a.csv", t=s["t"], x=s["x"], y=s["y"], hdg=s["hdg"], sog=s["U"] / KNOT, cog=s["cog"])
    assert "u" in made.channels, "with a course it is a velocity"


def test_columns_that_look_like_a_position_are_not_left_out_in_silence(tmp_path: Path) -> None:
    s = weaving()
    place = {"ECEF-X": 3.6e6 - 0.8 * s["x"], "ECEF-Y": 0.7e6 + s["y"], "ECEF-Z": 5.2e6 + 0.5 * s["x"]}
    _, _, doubts = trial(tmp_path / "a.csv", t=s["t"], hdg=s["hdg"], **place)
    assert any("'ECEF-X', 'ECEF-Y', 'ECEF-Z' look like one; by their size" in one for one in doubts)
    other = {"place coord a": s["x"], "place coord b": s["y"]}
    _, _, doubts = trial(tmp_path / "a.csv", t=s["t"], hdg=s["hdg"], **other)
    assert any("no position is read" in one and "[channels.x]" in one for one in doubts)
    _, _, doubts = trial(tmp_path / "a.csv", t=s["t"], hdg=s["hdg"], x=s["x"], y=s["y"], **place)
    assert not any("no position" in one for one in doubts)


@pytest.mark.parametrize(
    ("name", "told"), [("ME1 RPM", True), ("Engine rpm", True), ("Shaft rpm", False), ("n", False)]
)
def test_revolutions_of_an_engine_are_a_doubt(name: str, told: bool, tmp_path: Path) -> None:
    s = weaving()
    _, _, doubts = trial(tmp_path / "a.csv", t=s["t"], x=s["x"], y=s["y"], hdg=s["hdg"], **{name: s["n"]})
    assert any("of the engine by its name" in one for one in doubts) == told


def test_columns_of_a_matrix_are_told_apart_by_their_number(tmp_path: Path) -> None:
    s = weaving()
    matrix = np.column_stack([s["x"], s["y"], 0.0 * s["x"]])
    np.savez(tmp_path / "a.npz", t=s["t"], pos_ned=matrix, heading_deg=s["hdg"])
    text = guess(tmp_path / "a.npz").text
    assert '[channels.x]\ncolumn = "pos_ned(:,1)"' in text
    assert '[channels.y]\ncolumn = "pos_ned(:,2)"' in text


def test_stamps_with_the_name_of_a_month_are_a_clock(tmp_path: Path) -> None:
    s = weaving()
    stamps = [f"14-May-2026 09:{int(41 + k // 60):02d}:{k % 60:06.3f}" for k in s["t"].tolist()]
    made, text, _ = trial(tmp_path / "a.csv", Time=np.array(stamps, dtype=object), N_m=s["x"], E_m=s["y"],
                          psi_deg=s["hdg"])  # fmt: skip
    assert 'format = "%d-%b-%Y %H:%M:%S.%f"' in text
    np.testing.assert_allclose(made.t, s["t"], atol=1e-6)


def test_weeks_and_seconds_of_gps_by_names_that_run_together(tmp_path: Path) -> None:
    s = weaving()
    path = _csv(tmp_path, GPSWeek=0.0 * s["t"] + 2418, GPSTOW=380485.0 + s["t"], x=s["x"], y=s["y"], hdg=s["hdg"])
    text = guess(path).text
    assert 'time = { week = "GPSWeek", column = "GPSTOW", format = "gps" }' in text


def _csv(folder: Path, **columns: np.ndarray) -> Path:
    rows = zip(*(one.tolist() for one in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(f"{one:.7f}" for one in row) for row in rows)]
    (folder / "a.csv").write_text("\n".join(lines) + "\n")
    return folder / "a.csv"


def test_names_of_two_columns_are_joined_where_one_alone_is_of_no_quantity(tmp_path: Path) -> None:
    """Each field is told by its name, and a rudder's is called angle: the measurement makes it one."""
    s = weaving()
    of = (("gyro", "heading", s["hdg"]), ("rudder", "angle", s["rud"]), ("shaft", "rpm", s["n"]), ("gnss", "x", s["x"]),
          ("gnss", "y", s["y"]))  # fmt: skip
    lines = ["_time,_value,_field,_measurement"]
    lines += [f"{1778751667 + t:.1f},{values[k]:.4f},{field},{name}" for k, t in enumerate(s["t"].tolist())
              for name, field, values in of]  # fmt: skip
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    found = guess(tmp_path / "a.csv")
    assert 'name = ["_field", "_measurement"]' in found.text or 'name = ["_measurement", "_field"]' in found.text
    assert "[channels.delta]" in found.text
    assert "angle" in found.text.partition("[channels.delta]")[2].partition("unit")[0]
    assert not any("_measurement" in one for one in found.doubts)


def test_controls_in_a_file_of_which_nothing_is_read_are_a_doubt(tmp_path: Path) -> None:
    s = weaving()
    files = {"log_position_0.csv": {"x": s["x"], "y": s["y"], "heading": s["hdg"]},
             "log_motors_0.csv": {"control[0]": np.sin(s["t"]), "control[1]": np.cos(s["t"])}}  # fmt: skip
    for name, columns in files.items():
        _csv(tmp_path, timestamp=s["t"], **columns).rename(tmp_path / name)
    found = guess(tmp_path)
    assert sum("'control[" in one and "left out" in one for one in found.doubts) == 2
    assert "columns left out of log_motors_0.csv" in found.text


@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_a_heading_of_no_known_name_is_found_by_where_the_ship_goes(turned: float, tmp_path: Path) -> None:
    """Beside the course itself, a bearing of something else, and a column of small numbers."""
    s = weaving()
    made, _, doubts = trial(
        tmp_path / "a.csv", t=s["t"], x=s["x"], y=s["y"], puntamento=turned * s["hdg"], cog=s["cog"],
        ziel=(s["hdg"] * 1.7 + 80.0) % 360.0, kanal=3.0 + np.sin(s["t"]))  # fmt: skip
    if turned < 0.0:
        assert "psi" not in made.channels, "a compass that counts anticlockwise has to say so"
        return
    np.testing.assert_allclose(np.cos(made["psi"] - np.radians(s["hdg"])), 1.0, atol=1e-9)
    assert any("its name is none that is known" in one for one in doubts)
    made, _, doubts = trial(tmp_path / "b.csv", t=s["t"], x=s["x"], y=s["y"], hdg=s["hdg"], puntamento=s["hdg"])
    assert not any("none that is known" in one for one in doubts)


def test_a_course_under_a_strange_name_is_no_heading(tmp_path: Path) -> None:
    """What lies on the course to a hundredth of a radian is that course."""
    s = weaving(1200)
    far = 12
    went = np.arctan2(s["y"][2 * far :] - s["y"][: -2 * far], s["x"][2 * far :] - s["x"][: -2 * far])
    course = np.degrees(np.interp(s["t"], s["t"][far:-far], np.unwrap(went))) % 360.0
    made, _, _ = trial(tmp_path / "a.csv", t=s["t"], x=s["x"], y=s["y"], puntamento=course)
    assert "psi" not in made.channels


def test_a_single_column_of_dates_is_the_date_under_any_name(tmp_path: Path) -> None:
    s = weaving(60)
    day = np.array(["14/05/2026"] * 60, dtype=object)
    clock = np.array([f"09:41:{k:04.1f}" for k in s["t"].tolist()], dtype=object)
    _, text, _ = trial(tmp_path / "a.csv", Giorno=day, Ora=clock, x=s["x"], y=s["y"], hdg=s["hdg"])
    assert 'date = "Giorno"' in text


@pytest.mark.parametrize(("step", "told"), [(0.5, True), (0.04, True), (1.0, False)])
def test_even_steps_are_a_clock_where_no_name_is(step: float, told: bool, tmp_path: Path) -> None:
    """Of 1 they may as well count the rows."""
    s = weaving()
    columns = {"X_Value": s["t"] * 2.0 * step, "x": s["x"], "y": s["y"], "hdg": s["hdg"]}
    found = guess(_csv(tmp_path, **columns))
    assert ('time = { column = "X_Value", unit = "s" }' in found.text) == told
    assert any("by its even steps" in one for one in found.doubts) == told
    uneven = guess(_csv(tmp_path, **{**columns, "X_Value": s["t"] + 0.1 * np.sin(s["t"])}))
    assert "even steps" not in uneven.text


def test_fields_of_messages_are_known_by_their_last_name_but_those_of_others(tmp_path: Path) -> None:
    s = weaving()
    names = {"GLOBAL_POSITION_INT.lat": 57.0 + s["x"] / 1.11e5, "GLOBAL_POSITION_INT.lon": 11.0 + s["y"] / 6.1e4,
             "GLOBAL_POSITION_INT.hdg": s["hdg"]}  # fmt: skip
    text = guess(_csv(tmp_path, time=s["t"], **names)).text
    assert 'latitude = "GLOBAL_POSITION_INT.lat"' in text
    assert '[channels.psi]\ncolumn = "GLOBAL_POSITION_INT.hdg"' in text
    others = {name.replace("GLOBAL_POSITION", "TARGET"): one for name, one in names.items()}
    text = guess(_csv(tmp_path, time=s["t"], x=s["x"], y=s["y"], **others)).text
    assert "TARGET" not in text.partition("schema")[2]


def test_a_log_of_expedition_in_a_folder_is_named(tmp_path: Path) -> None:
    rows = "".join(f"0,{46156.4 + k / 86400:.7f},1,{6.2 + k % 3},13,{k}\n" for k in range(50))
    (tmp_path / "log.csv").write_text("!Boat,Utc,BSP,HDG\n!boat,0,1,13\n!v11.10.3\n" + rows)
    with pytest.raises(DataError, match="is a log of Expedition, which is not read"):
        guess(tmp_path)


def test_what_is_known_is_not_looked_for_again() -> None:
    s = rolling()
    place = {role: signal(role, s[role]) for role in ("x", "y")}
    strange = [signal("", s["rud"], "blatt").column, signal("", s["hdg"], "zeiger").column]
    assert strangers({**place, "delta": signal("delta", s["rud"])}, strange) == {}
    assert [one.column.head for one in strangers(place, strange).values()] == ["blatt"]  # the other goes beyond 90
    assert [*strangers(place, [signal("", 1e3 * s["rud"], "blatt").column])] == []
    assert pointed(s["t"], {**place, "yaw": signal("yaw", s["hdg"])}, strange).keys() == {"x", "y", "yaw"}
    assert pointed(s["t"], {}, strange) == {}
    drifts = weaving()
    place = {role: signal(role, drifts[role]) for role in ("x", "y")}
    strange = [signal("", drifts[name], name).column for name in ("rud", "hdg")]
    assert pointed(drifts["t"], place, strange)["heading"].column.head == "hdg"
    east = drifts["y"] / 1.11e5 / np.cos(np.radians(70.0))
    north = {"latitude": 70.0 + drifts["x"] / 1.11e5, "longitude": 11.0 + east}
    place = {role: signal(role, values) for role, values in north.items()}
    assert pointed(drifts["t"], place, strange)["heading"].column.head == "hdg"
    found = {f"{STRANGE}0": signal(f"{STRANGE}0", s["rud"])}
    assert with_rudder(found, s["t"], s["r"]).keys() == {"delta"}
    assert with_rudder(found, s["t"], None) == {}
    # a rate of turn in deg/min beside one of noise, which goes back to it as to a rudder
    noisy = s["r"] + np.random.default_rng(6).normal(0.0, 0.004, s["r"].size)
    rate = {f"{STRANGE}0": signal(f"{STRANGE}0", np.degrees(s["r"]) * 60.0)}
    assert rudder_sense(s["t"], noisy, rate[f"{STRANGE}0"].values)[1] > 8.0
    assert with_rudder(rate, s["t"], noisy) == {}
    place = {role: signal(role, s[role]) for role in ("x", "y")}
    sped = {**place, "sog": signal("sog", np.full(s["t"].size, 6.0))}
    assert with_units(s["t"], {**sped, "x": signal("x", s["x"] / 1852.0), "y": signal("y", s["y"] / 1852.0)})["x"].unit
    assert with_units(s["t"], sped) is sped


def test_places_of_no_known_name_are_a_doubt_by_their_digits(tmp_path: Path) -> None:
    s = weaving()
    place = {"szer": 57.0 + s["x"] / 1.11e5, "dl": 11.0 + s["y"] / 6.1e4}
    _, _, doubts = trial(tmp_path / "a.csv", t=s["t"], hdg=s["hdg"], **place)
    assert any("no position is read, and 'szer', 'dl' look like one" in one for one in doubts)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rudder_of_no_known_name_is_what_the_bow_follows(sign: float, tmp_path: Path) -> None:
    """Beside what swings as well: a heel that follows the rate of turn, the rate itself, and a voltage."""
    s = rolling()
    columns = {"t": s["t"], "x": s["x"], "y": s["y"], "hdg": s["hdg"]}
    others = {"spannung": 24.0 + np.sin(s["t"] / 7.0), "kraengwinkelchen": -30.0 * s["r"], "q17": 57.3 * s["r"]}
    made, text, doubts = trial(tmp_path / "a.csv", **columns, **others, blatt=sign * s["rud"])
    np.testing.assert_allclose(made["delta"], np.radians(s["rud"]), atol=1e-6)
    assert any("the bow follows it; its name is none that is known" in one for one in doubts)
    made, text, doubts = trial(tmp_path / "b.csv", **columns, **others)
    assert "delta" not in made.channels
    made, text, doubts = trial(tmp_path / "c.csv", **columns, rudder=s["rud"], blatt=0.9 * s["rud"])
    assert 'column = "rudder"' in text
    assert not any("none that is known" in one for one in doubts)


def rolling() -> dict[str, np.ndarray]:
    """A zigzag of Nomoto's first order, 10 s and 0.06 1/s, at 6 m/s; rows of half a second."""
    dt, psi, r, d, side, rows = 0.1, 0.5, 0.0, 0.0, 1.0, list[tuple[float, ...]]()
    x = y = 0.0
    for k in range(4000):
        side = -side if (psi - 0.5) * side > 0.35 else side
        d += float(np.clip(0.3 * side - d, -0.05 * dt, 0.05 * dt))
        r += dt * (0.06 * d - r) / 10.0
        psi += dt * r
        x, y = x + dt * 6.0 * np.cos(psi + 0.0), y + dt * 6.0 * np.sin(psi)
        if k % 5 == 0:
            rows.append((k * dt, x, y, np.degrees(psi) % 360.0, r, np.degrees(d)))
    table = dict(zip(("t", "x", "y", "hdg", "r", "rud"), np.array(rows).T, strict=True))
    noise = np.random.default_rng(5).normal(0.0, 1.0, (3, len(rows)))
    return {**table, "hdg": table["hdg"] + 0.02 * noise[0], "x": table["x"] + 0.03 * noise[1],
            "y": table["y"] + 0.03 * noise[2]}  # fmt: skip
