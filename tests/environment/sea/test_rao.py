"""Operators: both kinds of file, the long-wave limits, mirror and gaps, and every table that is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.errors import WeatherError
from seatrial.data import DataError
from seatrial.environment.sea import Sea
from seatrial.environment.sea.rao import MIRROR, Rao
from seatrial.environment.sea.reading import read_rao, read_sea
from seatrial.environment.sea.spectra import Ittc, Jonswap, PiersonMoskowitz

xr = pytest.importorskip("xarray")
pytest.importorskip("h5netcdf")

G = 9.80665
DOFS = ["Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"]
OMEGA = np.linspace(0.2, 2.5, 24)
WD = np.radians([0.0, 45.0, 90.0, 135.0, 180.0])


def raft(first: str = "complex", names: list[str] = DOFS) -> object:
    """A small raft in Capytaine's layout: it follows the surface, so its motions are those of the water.

    Waves exp(i (k x cos b + k y sin b) - i omega t), z up, y to port: heave is 1, surge i cos b, sway i sin b, roll (to
    starboard, about x) i k sin b and pitch (bow down, about y) -i k cos b.  Its excitation is made from these, so a
    reader that mixes the signs of time and of damping finds other coupled motions.
    """
    rng = np.random.default_rng(3)
    half = rng.normal(size=(6, 6))
    M = half @ half.T + 5.0 * np.eye(6)
    A, B, C = 0.5 * M + 0.2 * np.eye(6), 0.3 * (half @ half.T), np.diag([0.0, 0.0, 9.0, 4.0, 6.0, 0.0])
    k = (OMEGA**2 / G)[:, None]
    xi = np.zeros((OMEGA.size, WD.size, 6), dtype=complex)
    xi[..., 0], xi[..., 1], xi[..., 2] = 1j * np.cos(WD), 1j * np.sin(WD), 1.0
    xi[..., 3], xi[..., 4] = 1j * k * np.sin(WD), -1j * k * np.cos(WD)
    w = OMEGA[:, None, None, None]
    force = ((-(w**2) * (M + A) - 1j * w * B + C) @ xi[..., None])[..., 0]
    parts = np.stack([force.real, force.imag])
    dims = ("complex", "omega", "wave_direction", "influenced_dof")
    if first != "complex":
        parts, dims = np.moveaxis(parts, 0, -1), (*dims[1:], "complex")
    both = ("omega", "radiating_dof", "influenced_dof")
    each = np.ones((OMEGA.size, 1, 1))
    return xr.Dataset(
        {
            "added_mass": (both, A * each), "radiation_damping": (both, B * each),
            "inertia_matrix": (both[1:], M), "hydrostatic_stiffness": (both[1:], C), "excitation_force": (dims, parts),
        },
        {"omega": OMEGA, "wave_direction": WD, "radiating_dof": names, "influenced_dof": names,
         "complex": ["re", "im"], "rho": 1025.0, "g": G},
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("first", ["complex", "influenced_dof"])
def test_a_raft_follows_the_water(tmp_path: Path, first: str) -> None:
    """In ship axes: waves towards chi, y to starboard, z down, bow up; any order of the dimension of parts."""
    path = tmp_path / "raft.nc"
    raft(first).to_netcdf(path, engine="h5netcdf")  # type: ignore[attr-defined]
    rao = read_rao(path)
    assert np.degrees(rao.chi) == pytest.approx(np.arange(0.0, 360.0, 45.0))
    k = (rao.omega**2 / G)[:, None]
    water = np.stack(np.broadcast_arrays(
        -1j * np.cos(rao.chi), -1j * np.sin(rao.chi), -1.0 + 0.0 * k, 1j * k * np.sin(rao.chi),
        -1j * k * np.cos(rao.chi), 0.0 * k), axis=-1)  # fmt: skip
    assert pytest.approx(water, abs=1e-9) == rao.R


@pytest.mark.slow
def test_names_of_the_body_before_the_motions(tmp_path: Path) -> None:
    raft(names=[f"ship__{name}" for name in DOFS]).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")  # type: ignore[attr-defined]
    assert read_rao(tmp_path / "a.nc").R.shape == (OMEGA.size, 8, 6)


@pytest.mark.slow
def test_further_damping_is_a_share_of_the_critical_one(tmp_path: Path) -> None:
    """At its natural frequency an oscillator without damping of its own moves by F / (2 zeta C)."""
    own = ("radiating_dof", "influenced_dof")
    one = np.ones((3, 1, 1))
    data = xr.Dataset(
        {"added_mass": (("omega", *own), 2.0 * one), "radiation_damping": (("omega", *own), 0.0 * one),
         "inertia_matrix": (own, [[6.0]]), "hydrostatic_stiffness": (own, [[8.0]]),
         "excitation_force": (("complex", "omega", "wave_direction", "influenced_dof"),
                              np.stack([0.4 * np.ones((3, 5, 1)), np.zeros((3, 5, 1))]))},
        {"omega": [0.5, 1.0, 2.0], "wave_direction": WD, "radiating_dof": ["Roll"], "influenced_dof": ["Roll"],
         "complex": ["re", "im"]},
    )  # fmt: skip
    data.to_netcdf(tmp_path / "roll.nc", engine="h5netcdf")
    assert np.abs(read_rao(tmp_path / "roll.nc", 0.05).R[1, :, 3]) == pytest.approx(0.4 / (2.0 * 0.05 * 8.0))
    with pytest.raises(DataError, match="share of the critical damping"):
        read_rao(tmp_path / "roll.nc", 5.0)


SLOW = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        pytest.param(lambda d: d.drop_vars("inertia_matrix"), "no inertia_matrix", marks=SLOW),
        pytest.param(lambda d: d.drop_vars("excitation_force"), "no excitation_force", marks=SLOW),
        pytest.param(lambda d: d.assign_coords(wave_direction=np.degrees(WD)), "convert degrees", marks=SLOW),
        pytest.param(lambda d: d.isel(wave_direction=[0, 1, 2]), "no directions between 90 and 270", marks=SLOW),
        pytest.param(lambda d: d.assign(added_mass=d.added_mass.where(d.omega > 0.5)), "gaps", marks=SLOW),
        pytest.param(lambda d: d.assign_coords(omega=OMEGA - OMEGA[0]), "no motion", marks=SLOW),
        (lambda d: d.assign_coords(complex=["a", "b"]), "labels re and im"),
        pytest.param(lambda d: d.rename({"radiating_dof": "dof"}), "no dimension radiating_dof", marks=SLOW),
        pytest.param(lambda d: d.expand_dims({"water_depth": [10.0, 20.0]}), "2 values of water_depth", marks=SLOW),
    ],
)
def test_a_data_set_that_is_refused(tmp_path: Path, spoil: object, said: str) -> None:
    path = tmp_path / "bad.nc"
    spoil(raft()).to_netcdf(path, engine="h5netcdf")  # type: ignore[operator]
    with pytest.raises((DataError, WeatherError), match=said) as told:
        read_rao(path)
    assert "\n" not in str(told.value)
    assert "bad.nc" in str(told.value)


def test_no_netcdf(tmp_path: Path) -> None:
    (tmp_path / "bad.nc").write_text("omega,heave\n1,2\n")
    with pytest.raises(DataError, match="not readable as netCDF"):
        read_rao(tmp_path / "bad.nc")
    with pytest.raises(DataError, match="no such file"):
        read_rao(tmp_path / "none.nc")


HEAD = "omega [rad/s],chi [deg],heave [m/m],heave_phase [deg],roll [deg/m],roll_phase [deg]"


def table(head: str = HEAD, rows: list[str] | None = None) -> str:
    own = [f"{w},{chi},{1 / (1 + w)},{180 - 10 * w},{3 * w * math.sin(math.radians(chi)):.9f},{90 - 20 * w}"
           for chi in (0, 45, 90, 135, 180) for w in (0.3, 0.6, 0.9, 1.2)]  # fmt: skip
    return "\n".join([head, *(own if rows is None else rows), ""])


def read(tmp_path: Path, text: str) -> Rao:
    path = tmp_path / "ship.csv"
    path.write_text(text, encoding="utf-8")
    return read_rao(path)


def test_a_table_in_degrees(tmp_path: Path) -> None:
    rao = read(tmp_path, table())
    beam = int(np.argmin(np.abs(rao.chi - math.pi / 2)))
    assert np.abs(rao.R[1, beam, 3]) == pytest.approx(math.radians(1.8))
    assert np.angle(rao.R[1, beam, 2], deg=True) == pytest.approx(174.0)
    assert not rao.R[..., [0, 1, 4, 5]].any()
    other = int(np.argmin(np.abs(rao.chi - 1.5 * math.pi)))
    assert rao.R[:, other] == pytest.approx(rao.R[:, beam] * MIRROR)


def test_a_table_by_periods_or_by_frequencies_first_is_the_same(tmp_path: Path) -> None:
    plain = read(tmp_path, table())
    lines = table().splitlines()
    first = sorted(lines[1:], key=lambda row: (float(row.split(",")[0]), float(row.split(",")[1])))
    assert pytest.approx(plain.R) == read(tmp_path, table(rows=first)).R
    periods = [",".join([repr(2.0 * math.pi / float(row.split(",")[0])), *row.split(",")[1:]]) for row in lines[1:]]
    periods.sort(key=lambda row: (float(row.split(",")[1]), float(row.split(",")[0])))
    assert pytest.approx(plain.R) == read(tmp_path, table(HEAD.replace("omega [rad/s]", "T [s]"), periods)).R


ROWS = table().splitlines()[1:]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (table(rows=ROWS[:5] + ROWS[6:]), "no row for omega 0.6 rad/s at chi 45 deg"),
        (table(rows=[*ROWS[:3], "1.2,0,,180,0,90", *ROWS[4:]]), "column 'heave .m/m.', line 5: a gap"),
        (table(rows=[ROWS[1], ROWS[0], *ROWS[2:]]), "line [23]: not sorted"),
        (table(rows=[ROWS[0], *ROWS]), "line 3: frequency and direction of the row before"),
        (table(HEAD.replace("chi [deg]", "chi [rad]")), "45 rad is beyond two turns; if it is in degrees"),
        (table(HEAD.replace("heave_phase [deg]", "heave_phase [rad]")), "call it 'heave_phase .deg.'"),
        (table(HEAD.replace("roll [deg/m]", "roll [rad/m]")), "times the slope of the wave; if it is in degrees"),
        (table(HEAD.replace("roll [deg/m]", "roll")), "write its unit, 'roll .rad/m or deg/m.'"),
        (table(HEAD.replace("heave [m/m]", "heav [m/m]")), "heav"),
        (table(HEAD.replace("heave_phase [deg]", "pitch_phase [deg]")), "go together"),
        (table(rows=ROWS[:12]), "no directions between 90 and 270 deg"),
        (table(rows=ROWS[:4] + ROWS[8:12] + ROWS[16:]), "no directions between 0 and 90 deg"),
        (table(rows=["-0.3" + ROWS[0][3:], *ROWS[1:]]), "a frequency of zero or less"),
        (table(rows=[ROWS[0].replace(",0,0.", ",0,-0."), *ROWS[1:]]), "an amplitude is not"),
        (table(rows=[ROWS[0].replace("180", "x").replace("177", "x"), *ROWS[1:]]), "is not a number"),
        (table(rows=[]), "0 rows"),
        ("chi [deg],heave [m/m],heave_phase [deg]\n0,1,0\n", "one column of frequency"),
    ],
)
def test_a_table_that_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises((DataError, WeatherError), match=said) as told:
        read(tmp_path, text)
    assert "\n" not in str(told.value)
    assert "ship.csv" in str(told.value)


def test_operators_that_miss_the_sea(tmp_path: Path) -> None:
    rao = read(tmp_path, table())
    rao.covers(Sea(Jonswap(3.0, 13.0, 5.0)))
    with pytest.raises(WeatherError, match=r"of the variance of the sea lies outside 0.3 to 1.2 rad/s"):
        rao.covers(Sea(Ittc(1.0, 3.0)))


def test_between_two_directions_parts_are_interpolated_not_phases() -> None:
    """Half way between 1 at -170 deg and 1 at 170 deg is near -1; the mean of the phases would be +1."""
    chi = np.radians(np.arange(0.0, 360.0, 45.0))
    R = np.ones((2, 8, 6), dtype=np.complex128) * np.exp(1j * np.radians(np.where(np.arange(8) % 2, 170.0, -170.0)))[
        None, :, None]  # fmt: skip
    rao = Rao.of(np.array([0.2, 6.0]), chi, R)
    sea = Sea(Jonswap(2.0, 8.0), math.pi)  # travels north
    t, psi = np.zeros(1), np.array([math.radians(-22.5)])
    seen = rao.motions(sea.waves, t, t, t, psi, np.zeros((1, 2)))[0][0, 2]
    assert seen == pytest.approx(-float(sea.waves.elevation(t, t, t)[0]) * math.cos(math.radians(10.0)), rel=1e-9)


def test_seas_by_numbers_and_by_file(tmp_path: Path) -> None:
    assert read_sea("3,9,60", 4) == Sea(Jonswap(3.0, 9.0), math.radians(60.0), seed=4)
    path = tmp_path / "sea.toml"
    path.write_text(
        'schema = "seatrial-sea/1"\nspectrum = "pierson-moskowitz"\nwind = 15\ndirection = 90\nspread = 8\n'
    )
    assert read_sea(str(path), 2) == Sea(PiersonMoskowitz(15.0), math.pi / 2, 8.0, 2)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("spectrum = \"ittc\"\ndirection = 0\nH_S = 3", "no T_P"),
        ("spectrum = \"ittc\"\ndirection = 0\nH_S = 3\nT_P = 9\ngamma = 2", "gamma has no meaning for ittc"),
        ("spectrum = \"itc\"\ndirection = 0\nH_S = 3\nT_P = 9", "itc"),
        ("spectrum = \"ittc\"\ndirection = 0\nH_s = 3\nT_P = 9", "H_s"),
        ("spectrum = \"ittc\"\ndirection = 0\nH_S = -3\nT_P = 9", "height of -3 m"),
    ],
)  # fmt: skip
def test_a_sea_file_that_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "sea.toml"
    path.write_text(f'schema = "seatrial-sea/1"\n{text}\n')
    with pytest.raises(DataError, match=said) as told:
        read_sea(str(path))
    assert "sea.toml" in str(told.value)


@pytest.mark.parametrize("text", ["3,9", "3,9,x", "3,9,400", "nan,9,0"])
def test_a_sea_that_is_refused(text: str) -> None:
    with pytest.raises(WeatherError, match="write M,S,DEG"):
        read_sea(text)


def test_a_box_as_capytaine_itself_has_it(tmp_path: Path) -> None:
    """Its file and its own operators, conjugated and turned into ship axes; needs Capytaine."""
    cpt = pytest.importorskip("capytaine")
    from capytaine.io.xarray import export_dataset

    mesh = cpt.mesh_parallelepiped(size=(40.0, 10.0, 8.0), resolution=(16, 6, 6), center=(0.0, 0.0, 0.0), name="box")
    dofs = cpt.rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0))
    box = cpt.FloatingBody(mesh.immersed_part(), dofs=dofs, center_of_mass=(0.0, 0.0, -1.0), name="box")
    box.inertia_matrix = box.compute_rigid_body_inertia(rho=1025.0)
    box.hydrostatic_stiffness = box.compute_hydrostatic_stiffness(rho=1025.0)
    asked = xr.Dataset(coords={"omega": [0.2, 0.6, 1.0, 1.6], "wave_direction": WD, "radiating_dof": list(box.dofs),
                               "rho": 1025.0})  # fmt: skip
    data = cpt.BEMSolver().fill_dataset(asked, [box], hydrostatics=True)
    export_dataset(tmp_path / "box.nc", data, format="netcdf")
    own = cpt.post_pro.rao(data).transpose("omega", "wave_direction", "radiating_dof").values
    rao = read_rao(tmp_path / "box.nc")
    for k, b in enumerate(WD):
        here = int(np.argmin(np.abs(np.mod(rao.chi + b + 1.0, 2.0 * math.pi) - 1.0)))
        assert rao.R[:, here] == pytest.approx(own[:, k].conj() * [1, -1, -1, 1, -1, -1], rel=0.01, abs=1e-9)
    long, head = (0.2**2 / G), int(np.argmin(np.abs(rao.chi - math.pi)))
    assert rao.R[0, head, 2] == pytest.approx(-1.0, abs=0.01)  # long waves lift it,
    assert rao.R[0, head, 4] == pytest.approx(1j * long, rel=0.01)  # and it pitches with their slope, bow up first
