"""Operators from a data set of Capytaine (netCDF): forces, added mass, damping, stiffness and inertia.

Its conventions are exp(-i omega t), z up and y to port, waves named by where they travel, counterclockwise; a `Rao` has
exp(+i omega t), z down and y to starboard.  So an operator is the conjugate with the signs of `_TO_SHIP`, and a
direction changes its sign.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core import unpacking
from ...core.parameters import unknown
from ...data import Array, DataError
from ...data.table import existing, within
from .hydrodynamics import Hydrodynamics, whole_turn
from .rao import MODES, Complex, Rao

_TO_SHIP = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
_NEEDS = ("added_mass", "radiation_damping", "inertia_matrix", "hydrostatic_stiffness", "excitation_force")
_LARGEST = 1_000_000_000


def read_capytaine(path: Path, roll_damping: float = 0.0, speed: float = 0.0) -> Rao:
    """Operators from a Capytaine data set, motions about midship where its axes begin.

    (-omega_e^2 (M + A) - i omega_e B + C) xi = F, solved at each frequency and direction for the degrees of freedom
    that it has; others are at rest.  A data set of a forward speed has its own frequencies of encounter; in one at zero
    speed the coefficients are taken at those of `speed`.

    Args:
        path: the data set.
        roll_damping: damping of roll that waves do not carry away (keels, eddies, hull lift) over the critical one,
            2 sqrt(C_44 (I_44 + A_44)); some hundredths for ships.  Without it roll at resonance is several times too
            large.
        speed: of the ship ahead [m/s].

    Raises:
        DataError: not netCDF, a variable or a motion that is missing, several speeds or depths, no numbers.
    """
    data, modes = _checked(path)
    if speed and not _moving(data):
        return read_data(path).rao(speed, roll_damping)
    force, omega, direction = _forces(path, data)
    xi = _solved(data, omega, direction, force, (modes.index(3), roll_damping) if 3 in modes else (0, 0.0))
    R = np.zeros((omega.size, direction.size, 6), dtype=np.complex128)
    R[:, :, modes] = xi.conj() * _TO_SHIP[modes]
    R[...] = R @ _lever(data).T
    order = np.argsort(omega)
    if not np.isfinite(R).all():
        raise DataError(f"{path}: forces or matrices with gaps; compute them again without frequencies 0 and infinite")
    with within(path):
        return Rao.of(omega[order], -direction, R[order], str(path))


def read_data(path: Path) -> Hydrodynamics:
    """Coefficients at zero speed from a Capytaine data set, about midship in the water line.

    Raises:
        DataError, WeatherError: as `read_capytaine`; a forward speed; no centre of gravity; what `Hydrodynamics`
            refuses.
    """
    data, modes = _checked(path)
    if _moving(data):
        raise DataError(f"{path}: computed at a forward speed; the memory of waves needs a data set at zero speed")
    if not _deep(data):
        raise DataError(f"{path}: computed in a depth of {float(data.water_depth):g} m; compute it in deep water")
    omega = np.asarray(data["omega"].values, dtype=np.float64)
    finite = np.isfinite(omega) & (omega > 0.0)
    kept = np.flatnonzero(finite)[np.argsort(omega[finite])]
    far = np.flatnonzero(np.isinf(omega))

    def matrix(name: str, rows: Any = None) -> Array:
        one = data[name].transpose(..., "influenced_dof", "radiating_dof").values
        taken = np.asarray(one if rows is None else one[rows], dtype=np.float64)
        out = np.zeros((*taken.shape[:-2], 6, 6))
        out[..., np.array(modes)[:, None], modes] = taken
        return out * np.outer(_TO_SHIP, _TO_SHIP)

    for name in ("added_mass", "radiation_damping"):
        if "omega" not in data[name].dims or data[name].ndim != 3:
            raise DataError(f"{path}: {name} over {', '.join(map(str, data[name].dims))}; one over omega is wanted")
        data[name] = data[name].transpose("omega", ...)
    force, _, direction = _forces(path, data.isel(omega=kept))
    F = np.zeros((kept.size, direction.size, 6), dtype=np.complex128)
    F[..., modes] = force.conj() * _TO_SHIP[modes]
    z_G = 0.0 if "center_of_mass" not in data else -float(np.asarray(data["center_of_mass"].values)[2])
    if not math.isfinite(z_G) or "center_of_mass" not in data:
        raise DataError(f"{path}: no center_of_mass; give the body one, its stiffness needs it")
    with within(path):
        if not np.isfinite(F).all():
            raise DataError("wave forces with gaps; compute them again at each frequency and direction")
        chi, turned = whole_turn(np.mod(-direction, 2.0 * math.pi), F)
        found = Hydrodynamics(
            omega[kept], matrix("added_mass", kept), matrix("radiation_damping", kept), tuple(sorted(modes)),
            matrix("inertia_matrix"), matrix("hydrostatic_stiffness"), z_G,
            matrix("added_mass", far)[0] if far.size and np.isfinite(data["added_mass"].values[far]).all() else None,
            chi, turned, str(path),
        )  # fmt: skip
    x, y, z = _centre(data)
    return replace(found, z=z).moved(-x, -y, -z)


def _checked(path: Path) -> tuple[Any, list[int]]:
    """The data set with its degrees of freedom in one order, and their numbers."""
    data = _opened(path)
    lacking = [name for name in _NEEDS if name not in data and not (name == _NEEDS[-1] and "diffraction_force" in data)]
    if lacking:
        raise DataError(f"{path}: no {lacking[0]}; a data set of Capytaine needs it for motions (has the body a mass?)")
    for name in ("forward_speed", "water_depth", "rho", "g"):
        if name in data.coords and data[name].size > 1:
            raise DataError(f"{path}: {data[name].size} values of {name}; keep one with .sel({name}=...)")
    for name in ("omega", "wave_direction"):
        if name not in data.coords:
            raise DataError(f"{path}: no coordinate {name}; compute over omega and wave_direction")
    data = _shaped(path, data)
    names = [str(name) for name in data["influenced_dof"].values]
    modes = [_mode(path, name) for name in names]
    return data.sel(radiating_dof=names), modes


def _forces(path: Path, data: Any) -> tuple[Complex, Array, Array]:
    """Excitation in Capytaine's conventions, frequencies and directions."""
    force = _complex(path, data, "excitation_force") if "excitation_force" in data else (
        _complex(path, data, "Froude_Krylov_force") + _complex(path, data, "diffraction_force"))  # fmt: skip
    omega = np.asarray(data["omega"].values, dtype=np.float64)
    direction = np.asarray(data["wave_direction"].values, dtype=np.float64)
    _plain(path, omega, direction)
    return force, omega, direction


def _moving(data: Any) -> bool:
    return "forward_speed" in data and float(np.abs(data["forward_speed"].values).max()) > 0.0


def _deep(data: Any) -> bool:
    return "water_depth" not in data or not np.isfinite(np.asarray(data["water_depth"].values, dtype=np.float64)).all()


def _centre(data: Any) -> tuple[float, float, float]:
    """The point that the rotations are about, in ship axes from where its axes begin [m]; there where none is said."""
    if "rotation_center" not in data:
        return 0.0, 0.0, 0.0
    x, y, z = np.nan_to_num(np.asarray(data["rotation_center"].values, dtype=np.float64)).tolist()
    return x, -y, -z


def _lever(data: Any) -> Array:
    """What turns motions about the centre of rotation into those of midship in the water line, shape (6, 6)."""
    out = np.eye(6)
    x, y, z = (-one for one in _centre(data))
    out[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return out


def _opened(path: Path) -> Any:
    try:
        import xarray as xr
    except ImportError:
        raise DataError(f"{path}: netCDF needs xarray and h5netcdf; pip install 'seatrial[sea]'") from None
    here = existing(path)
    try:
        if here.stat().st_size > _LARGEST:
            raise DataError(f"{path}: {here.stat().st_size} bytes; {_LARGEST} are the most of such a file")
        # version 3 of the format begins with CDF: Capytaine writes it where netCDF4 is not installed
        with open(here, "rb") as raw:
            engine = "scipy" if raw.read(3) == b"CDF" else "h5netcdf"
        if engine == "h5netcdf":
            _hold(path, here)
        with xr.open_dataset(here, engine=engine) as opened:
            if opened.nbytes > unpacking.most(here.stat().st_size):
                raise DataError(f"{path}: {unpacking.told(opened.nbytes, here.stat().st_size)}")
            return opened.load()
    except ImportError:
        raise DataError(f"{path}: netCDF needs xarray and h5netcdf; pip install 'seatrial[sea]'") from None
    except DataError:
        raise
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        why = " ".join(str(error).split())[:120]
        raise DataError(f"{path}: not readable as netCDF ({why})") from None


def _hold(path: Path, here: Path) -> None:
    """Count what the variables hold: what was never written takes no room in the file, and all of it in memory.

    Raises:
        DataError: too much.
    """
    import h5py

    size, found = here.stat().st_size, 0.0

    def add(_: str, one: Any) -> None:
        nonlocal found
        if isinstance(one, h5py.Dataset):
            found += float(one.size or 0) * one.dtype.itemsize

    with h5py.File(here, "r") as file:
        file.visititems(add)
    if found > unpacking.most(size):
        raise DataError(f"{path}: {unpacking.told(found, size)}")


def _shaped(path: Path, data: Any) -> Any:
    """The data set without dimensions of one value, whatever its order of dimensions."""
    for name in ("forward_speed", "water_depth", "rho", "g"):
        if name in data.dims:
            data = data.squeeze(name)
    for name in ("omega", "wave_direction"):
        if name not in data.dims:
            data = data.expand_dims(name)
    for name in ("influenced_dof", "radiating_dof"):
        if name not in data.dims:
            raise DataError(f"{path}: no dimension {name}; it has {', '.join(map(str, data.dims))}")
    return data


def _mode(path: Path, name: str) -> int:
    """The number of a motion by its name, with or without that of the body: ``ship__Heave``."""
    mode = name.rpartition("__")[2].lower()
    if mode not in MODES:
        raise DataError(f"{path}: {unknown(mode, MODES, 'degree of freedom')}; rigid bodies only")
    return MODES.index(mode)


def _complex(path: Path, data: Any, name: str) -> Complex:
    """A force of shape (omega, wave_direction, influenced_dof), its parts found by their labels."""
    if name not in data:
        raise DataError(f"{path}: no {name}; keep excitation_force, or Froude_Krylov_force and diffraction_force")
    force = data[name]
    if "complex" in force.dims:
        if "complex" not in force.coords or set(map(str, force["complex"].values)) != {"re", "im"}:
            raise DataError(f"{path}: {name}: the dimension 'complex' needs the labels re and im")
        force = force.sel(complex="re") + 1j * force.sel(complex="im")
    return np.asarray(force.transpose("omega", "wave_direction", "influenced_dof").values, dtype=np.complex128)


def _plain(path: Path, omega: Array, direction: Array) -> None:
    if not (omega > 0.0).all() or not np.isfinite(omega).all():
        raise DataError(
            f"{path}: frequencies of 0 or infinity, which have no motion; leave them out with .sel(omega=...)"
        )
    if np.abs(direction).max() > 2.0 * math.pi + 1e-6:
        raise DataError(f"{path}: a wave_direction of {np.abs(direction).max():g} rad; convert degrees to radians")


def _solved(data: Any, omega: Array, direction: Array, force: Complex, roll: tuple[int, float]) -> Complex:
    """Motions of shape (omega, wave_direction, influenced_dof); Capytaine's sign of time.

    `roll` is the place of roll and its further damping.
    """

    def over(name: str) -> Array:
        one = data[name]
        for wanted, values in (("omega", omega), ("wave_direction", direction)):
            if wanted not in one.dims:
                one = one.expand_dims({wanted: values})
        order = ("omega", "wave_direction", "influenced_dof", "radiating_dof")
        return np.asarray(one.transpose(*order).values, dtype=np.float64)

    met = np.broadcast_to(omega[:, None], (omega.size, direction.size))
    if "encounter_omega" in data:
        found = data["encounter_omega"]
        if found.dims == ("omega",):
            met = np.broadcast_to(np.asarray(found.values)[:, None], met.shape)
        elif set(found.dims) == {"omega", "wave_direction"}:
            met = np.asarray(found.transpose("omega", "wave_direction").values)
    w = met[..., None, None]
    inertia = over("inertia_matrix") + over("added_mass")
    damping, stiffness = over("radiation_damping").copy(), over("hydrostatic_stiffness")
    k, further = roll
    if further:
        damping[..., k, k] += 2.0 * further * np.sqrt(np.maximum(stiffness[..., k, k] * inertia[..., k, k], 0.0))
    system = -(w**2) * inertia - 1j * w * damping + stiffness
    return np.asarray(np.linalg.solve(system, force[..., None])[..., 0], dtype=np.complex128)
