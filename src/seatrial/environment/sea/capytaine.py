"""Operators from a data set of Capytaine (netCDF): forces, added mass, damping, stiffness and inertia.

Its conventions are exp(-i omega t), z up and y to port, waves named by where they travel, counterclockwise; a `Rao` has
exp(+i omega t), z down and y to starboard.  So an operator is the conjugate with the signs of `_TO_SHIP`, and a
direction changes its sign.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from ...core.parameters import unknown
from ...data import Array, DataError
from ...data.table import existing, within
from .rao import MODES, Complex, Rao

_TO_SHIP = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
_NEEDS = ("added_mass", "radiation_damping", "inertia_matrix", "hydrostatic_stiffness", "excitation_force")
_LARGEST = 1_000_000_000


def read_capytaine(path: Path, roll_damping: float = 0.0) -> Rao:
    """Operators from a Capytaine data set at its forward speed, motions about midship where its axes begin.

    (-omega_e^2 (M + A) - i omega_e B + C) xi = F, solved at each frequency and direction for the degrees of freedom
    that it has; others are at rest.

    Args:
        path: the data set.
        roll_damping: damping of roll that waves do not carry away (keels, eddies, hull lift) over the critical one,
            2 sqrt(C_44 (I_44 + A_44)); some hundredths for ships.  Without it roll at resonance is several times too
            large.

    Raises:
        DataError: not netCDF, a variable or a motion that is missing, several speeds or depths, no numbers.
    """
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
    data = data.sel(radiating_dof=names)
    force = _complex(path, data, "excitation_force") if "excitation_force" in data else (
        _complex(path, data, "Froude_Krylov_force") + _complex(path, data, "diffraction_force"))  # fmt: skip
    omega = np.asarray(data["omega"].values, dtype=np.float64)
    direction = np.asarray(data["wave_direction"].values, dtype=np.float64)
    _plain(path, omega, direction)
    xi = _solved(data, omega, direction, force, (modes.index(3), roll_damping) if 3 in modes else (0, 0.0))
    R = np.zeros((omega.size, direction.size, 6), dtype=np.complex128)
    R[:, :, modes] = xi.conj() * _TO_SHIP[modes]
    order = np.argsort(omega)
    if not np.isfinite(R).all():
        raise DataError(f"{path}: forces or matrices with gaps; compute them again without frequencies 0 and infinite")
    with within(path):
        return Rao.of(omega[order], -direction, R[order], str(path))


def _opened(path: Path) -> Any:
    try:
        import xarray as xr
    except ImportError:
        raise DataError(f"{path}: netCDF needs xarray and h5netcdf; pip install 'seatrial[sea]'") from None
    here = existing(path)
    try:
        if here.stat().st_size > _LARGEST:
            raise DataError(f"{path}: {here.stat().st_size} bytes; {_LARGEST} are the most of such a file")
        with xr.open_dataset(here, engine="h5netcdf") as opened:
            return opened.load()
    except ImportError:
        raise DataError(f"{path}: netCDF needs xarray and h5netcdf; pip install 'seatrial[sea]'") from None
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        why = " ".join(str(error).split())[:120]
        raise DataError(f"{path}: not readable as netCDF 4 ({why})") from None


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
