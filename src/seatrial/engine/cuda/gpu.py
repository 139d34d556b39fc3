"""A CUDA device through cuda-core; code is compiled by NVRTC for the very architecture, so no driver compiles it again.

Products and sums are contracted, as the C compiler does on the processor: the two differ by rounding in any case, as
their sines do.  No fast mathematics; in single precision division and root are good to 2 and 1 units in the last place,
as sines and exponentials are in either precision.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..cache import DIGEST, CompilerError, kept
from . import Device, DeviceArray, DeviceError, Module, Numbers
from .source import BLOCK

NEEDED = "pip install 'seatrial[cuda]'"


@cache
def _core() -> Any:
    try:
        import cuda.core
    except ImportError:
        raise DeviceError(f"CUDA needs the extra 'cuda': {NEEDED}") from None
    return cuda.core


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
    core = _core()
    try:
        from cuda.bindings import nvrtc

        version = repr(_done(nvrtc.nvrtcVersion())).encode()
    except Exception as error:
        raise CompilerError(f"NVRTC cannot be loaded ({_line(error)}): {NEEDED}") from None
    rounded = {"prec_div": False, "prec_sqrt": False} if single else {}

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

    def __init__(self, device: Any, shape: Sequence[int], dtype: Any) -> None:
        from cuda.core.utils import StridedMemoryView

        self.bytes = max(math.prod(shape) * np.dtype(dtype).itemsize, 8)
        self.buffer = device.allocate(self.bytes, stream=device.default_stream)
        self.bytes = math.prod(shape) * np.dtype(dtype).itemsize
        self._view = StridedMemoryView.from_buffer(self.buffer, tuple(shape), dtype=np.dtype(dtype))
        self._device, self._shape, self._dtype = device, tuple(shape), np.dtype(dtype)

    @property
    def shape(self) -> tuple[int, ...]:
        return self._shape

    @property
    def dtype(self) -> np.dtype[Any]:
        return self._dtype

    def host(self) -> Numbers:
        from cuda.bindings import driver

        values = np.empty(self._shape, self._dtype)
        self._device.sync()
        if self.bytes:
            _done(driver.cuMemcpyDtoH(values.ctypes.data, int(self.buffer.handle), self.bytes))
        return values

    def fill(self, values: Numbers) -> None:
        from cuda.bindings import driver

        given = np.ascontiguousarray(np.broadcast_to(values, self._shape), dtype=self._dtype)
        if self.bytes:
            _done(driver.cuMemcpyHtoD(int(self.buffer.handle), given.ctypes.data, self.bytes))

    def __dlpack__(self, *, stream: Any = None, max_version: Any = None, dl_device: Any = None, copy: Any = None) -> Any:
        return self._view.__dlpack__(stream=stream, max_version=max_version, dl_device=dl_device, copy=copy)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._view.__dlpack_device__()


class GpuModule(Module):
    """Code loaded on a CUDA device."""

    def __init__(self, device: Any, code: bytes, single: bool) -> None:
        from cuda.bindings import driver

        self._device, self._code = device, _core().ObjectCode.from_cubin(code)
        self._uniform = self._code.get_kernel("uniform")
        self._kernels: dict[str, Any] = {}
        dtype = np.dtype(np.float32 if single else np.float64)
        where, size = _done_two(driver.cuLibraryGetGlobal(self._code.handle, b"K"))
        self._constants, self._words, self._dtype = int(where), size // dtype.itemsize, dtype
        self._fixed = b""

    def fix(self, parameters: Numbers) -> None:
        from cuda.bindings import driver

        given = np.ascontiguousarray(parameters if len(parameters) else np.zeros(1), dtype=self._dtype)
        if given.tobytes() == self._fixed:
            return
        derived, itemsize = GpuArray(self._device, (max(self._words - len(given), 1),), self._dtype), given.itemsize
        _done(driver.cuMemcpyHtoD(self._constants, given.ctypes.data, given.nbytes))
        core = _core()
        core.launch(self._device.default_stream, core.LaunchConfig(grid=1, block=1), self._uniform, derived.buffer)
        rest = (self._words - len(given)) * itemsize
        if rest:
            _done(driver.cuMemcpyDtoD(self._constants + given.nbytes, int(derived.buffer.handle), rest))
        self._fixed = given.tobytes()

    def launch(self, name: str, threads: int, *arguments: int | float | DeviceArray) -> None:
        core = _core()
        if name not in self._kernels:
            self._kernels[name] = self._code.get_kernel(name)
        grid = core.LaunchConfig(grid=-(-threads // BLOCK), block=BLOCK)
        core.launch(self._device.default_stream, grid, self._kernels[name], *map(_argument, arguments))


def _done_two(answer: tuple[Any, ...]) -> tuple[Any, int]:
    _done(answer)
    return answer[1], int(answer[2])


def _argument(value: int | float | DeviceArray) -> Any:
    if isinstance(value, GpuArray):
        return value.buffer
    return np.int64(value) if isinstance(value, int) else np.float64(value)  # pyright: ignore[reportArgumentType]


class Gpu(Device):
    """A CUDA device by its number."""

    def __init__(self, number: int) -> None:
        core = _core()
        try:
            self.device = core.Device(number)
            self.device.set_current()
        except Exception as error:
            raise DeviceError(f"no CUDA device {number} here: {_line(error)}; leave --device away") from None
        self._modules: dict[tuple[str, bool], GpuModule] = {}

    def module(self, source: str, single: bool) -> GpuModule:
        key = (source, single)
        if key not in self._modules:
            code = compiled(source, f"sm_{self.device.arch}", single)
            self._modules[key] = GpuModule(self.device, code, single)
        return self._modules[key]

    def empty(self, shape: Sequence[int], dtype: Any) -> GpuArray:
        return GpuArray(self.device, shape, dtype)

    def put(self, values: Numbers) -> GpuArray:
        array = self.empty(values.shape, values.dtype)
        array.fill(values)
        return array


@cache
def gpu(number: int) -> Gpu:
    """The device of that number; DeviceError: it, its driver or the extra is missing."""
    return Gpu(number)
