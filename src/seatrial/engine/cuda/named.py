"""Devices by name; the packages of the extra are loaded for a GPU only."""

from __future__ import annotations

from . import Device, DeviceError


def device_of(named: str | Device, precision: str = "double") -> Device | None:
    """A device by its name, "cuda" or "cuda:1"; None for "cpu".

    Raises:
        DeviceError: no such name, a precision that it does not compute in, or what it needs is not here; names what is
            missing.
    """
    if precision not in ("double", "single"):
        raise DeviceError(f"precision '{precision}'; known: double, single")
    if named == "cpu":
        if precision == "single":
            raise DeviceError("the processor computes in double precision; single takes a device such as cuda")
        return None
    if not isinstance(named, str):
        return named
    kind, _, number = named.partition(":")
    if kind != "cuda" or not (number or "0").isdecimal():
        raise DeviceError(f"device '{named}'; known: cpu, cuda, cuda:1 for the second one, and so on")
    from .gpu import gpu

    return gpu(int(number or "0"))
