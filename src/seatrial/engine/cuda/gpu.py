"""A CUDA device through cuda-core; code is compiled by NVRTC for the very architecture, so no driver compiles it again.

Products and sums are contracted, as the C compiler does on the processor: the two differ by rounding in any case, as
their sines do.  No fast mathematics; in single precision division and root are good to 2 and 1 units in the last place,
as sines and exponentials are in either precision.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from ..cache import DIGEST, CompilerError, kept
from . import Device, DeviceArray, DeviceError, Module, Numbers
from .source import BLOCK

NEEDED = "pip install 'seatrial[cuda]'"
ROUNDED = {"prec_div": False, "prec_sqrt": False}
"""Options in single precision."""


@cache
def _part(name: str) -> Any:
    """A module of the packages of the extra, which have no types; DeviceError: they are missing."""
    try:
        return import_module(f"cuda.{name}")
    except ImportError:
        raise DeviceError(f"CUDA needs the extra 'cuda': {NEEDED}") from None


def _done(answer: tuple[Any, ...]) -> Any:
    """What a call of the driver gives back; DeviceError: it failed."""
    if int(answer[0]):
        raise DeviceError(f"CUDA: {answer[0].name}")
    return answer[1] if len(answer) > 1 else None


def compiled(source: str, architecture: str, single: bool) -> bytes:
    """Machine code of `source` for an architecture such as "sm_90"; it takes no GPU to make.

    Raises:
        CompilerError: NVRTC is missing or refuses the source.
    """
    core = _part("core")
    try:
        version = repr(_part("bindings.nvrtc").nvrtcVersion()).encode()
    except Exception as error:
        raise CompilerError(f"NVRTC cannot be loaded ({_line(error)}): {NEEDED}") from None
    rounded = ROUNDED if single else {}

    def make(scratch: Path) -> bytes:
        options = core.ProgramOptions(arch=architecture, disable_warnings=True, **rounded)
        try:
            return bytes(core.Program(source, "c++", options).compile("cubin").code)
        except Exception as error:
            raise CompilerError(f"NVRTC failed: {_line(error)}") from error

    path = kept([source.encode(), architecture.encode(), repr(rounded).encode(), version], "cubin", make)
    return path.read_bytes()[:-DIGEST]


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:300]


class GpuArray(DeviceArray):
    """An array of a CUDA device."""

    def __init__(self, device: Any, buffer: Any, shape: Sequence[int], dtype: Any) -> None:
        self.bytes, self.buffer = math.prod(shape) * np.dtype(dtype).itemsize, buffer
        self._device, self._shape, self._dtype = device, tuple(shape), np.dtype(dtype)

    @property
    def shape(self) -> tuple[int, ...]:
        return self._shape

    @property
    def dtype(self) -> np.dtype[Any]:
        return self._dtype

    def host(self) -> Numbers:
        values = np.empty(self._shape, self._dtype)
        self._device.default_stream.sync()
        if self.bytes:
            _done(_part("bindings.driver").cuMemcpyDtoH(values.ctypes.data, int(self.buffer.handle), self.bytes))
        return values

    def fill(self, values: Numbers) -> None:
        given = np.ascontiguousarray(np.broadcast_to(values, self._shape), dtype=self._dtype)
        if self.bytes:
            _done(_part("bindings.driver").cuMemcpyHtoD(int(self.buffer.handle), given.ctypes.data, self.bytes))

    def __dlpack__(
        self, *, stream: Any = None, max_version: Any = None, dl_device: Any = None, copy: Any = None
    ) -> Any:
        return self._view().__dlpack__(stream=stream, max_version=max_version, dl_device=dl_device, copy=copy)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._view().__dlpack_device__()

    def _view(self) -> Any:
        return _part("core.utils").StridedMemoryView.from_buffer(self.buffer, self._shape, dtype=self._dtype)


def _empty(device: Any, shape: Sequence[int], dtype: Any) -> GpuArray:
    size = math.prod(shape) * np.dtype(dtype).itemsize
    device.set_current()  # of this thread
    try:
        buffer = device.allocate(max(size, 8), stream=device.default_stream)
    except Exception as error:
        wanted = "take fewer lanes, or store fewer rows"
        raise DeviceError(f"no room for {size / 1e9:.3g} GB on the device ({_line(error)}); {wanted}") from None
    return GpuArray(device, buffer, shape, dtype)


class GpuModule(Module):
    """Code loaded on a CUDA device."""

    def __init__(self, device: Any, code: bytes, single: bool) -> None:
        self._device, self._code = device, _part("core").ObjectCode.from_cubin(code)
        self._uniform = self._code.get_kernel("uniform")
        self._kernels: dict[str, Any] = {}
        dtype = np.dtype(np.float32 if single else np.float64)
        where, size = _done_two(_part("bindings.driver").cuLibraryGetGlobal(self._code.handle, b"K"))
        self._constants, self._words, self._dtype = int(where), size // dtype.itemsize, dtype
        self._fixed, self._alone = b"", Lock()

    def _fix(self, parameters: Numbers) -> None:
        given = np.ascontiguousarray(parameters if len(parameters) else np.zeros(1), dtype=self._dtype)
        if given.tobytes() == self._fixed:
            return
        rest = self._words - len(given)
        derived = _empty(self._device, (max(rest, 1),), self._dtype)
        core, driver = _part("core"), _part("bindings.driver")
        _done(driver.cuMemcpyHtoD(self._constants, given.ctypes.data, given.nbytes))
        core.launch(self._device.default_stream, core.LaunchConfig(grid=1, block=1), self._uniform, derived.buffer)
        if rest:
            _done(driver.cuMemcpyDtoD(self._constants + given.nbytes, int(derived.buffer.handle), derived.bytes))
        self._fixed = given.tobytes()

    def launch(self, name: str, threads: int, parameters: Numbers, *arguments: int | float | DeviceArray) -> None:
        core = _part("core")
        grid = core.LaunchConfig(grid=-(-threads // BLOCK), block=BLOCK)
        self._device.set_current()  # of this thread
        with self._alone:  # constant memory is one; the stream keeps it as it is until the kernel has run
            self._fix(parameters)
            if name not in self._kernels:
                self._kernels[name] = self._code.get_kernel(name)
            core.launch(self._device.default_stream, grid, self._kernels[name], *map(_argument, arguments))


def _done_two(answer: tuple[Any, ...]) -> tuple[Any, int]:
    _done(answer)
    return answer[1], int(answer[2])


def _argument(value: Any) -> Any:
    if isinstance(value, int):
        return np.int64(value)
    return np.float64(value) if isinstance(value, float) else value.buffer


class Gpu(Device):
    """A CUDA device by its number."""

    def __init__(self, number: int) -> None:
        core, self.number = _part("core"), number
        try:
            self.device = core.Device(number)
            self.device.set_current()
        except Exception as error:
            driver = type(error).__name__ == "DynamicLibNotFoundError"
            why = "the NVIDIA driver is missing" if driver else _line(error)
            raise DeviceError(f"no CUDA device {number} here: {why}; compute on the processor (cpu)") from None
        self._modules: dict[tuple[str, bool], GpuModule] = {}

    def module(self, source: str, single: bool) -> GpuModule:
        key = (source, single)
        if key not in self._modules:
            code = compiled(source, f"sm_{self.device.arch}", single)
            self._modules[key] = GpuModule(self.device, code, single)
        return self._modules[key]

    def empty(self, shape: Sequence[int], dtype: Any) -> GpuArray:
        return _empty(self.device, shape, dtype)

    def view(self, array: Any) -> GpuArray:
        core = _part("core")
        try:
            stream = int(self.device.default_stream.handle) or 1  # DLPack's number of the default stream
            view = _part("core.utils").StridedMemoryView.from_dlpack(array, stream_ptr=stream)
        except Exception as error:
            raise DeviceError(f"no array of the device that knows DLPack: {_line(error)}") from None
        shape, dtype = tuple(view.shape), np.dtype(view.dtype)
        dense = tuple(math.prod(shape[k + 1 :]) for k in range(len(shape)))
        if not view.is_device_accessible or tuple(view.strides or dense) != dense:
            raise DeviceError("an array that is not on the device, or whose rows are not side by side; copy it there")
        size = math.prod(shape) * dtype.itemsize
        return GpuArray(self.device, core.Buffer.from_handle(view.ptr, size, owner=view), shape, dtype)

    def put(self, values: Numbers) -> GpuArray:
        array = self.empty(values.shape, values.dtype)
        array.fill(values)
        return array


    def __reduce__(self) -> tuple[Any, ...]:
        return gpu, (self.number,)


@cache
def gpu(number: int) -> Gpu:
    """The device of that number; DeviceError: it, its driver or the extra is missing."""
    return Gpu(number)
