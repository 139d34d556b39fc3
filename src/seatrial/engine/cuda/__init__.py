"""The engine on a GPU: the systems of the processor, one lane a thread, printed as CUDA C++.

`Device` is what the room needs of a machine: compile a source, keep arrays, launch a kernel.  `gpu.Gpu` is a CUDA
device (extra `cuda`); the tests have another one, which compiles the same source for the processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.errors import DeviceError as DeviceError

Numbers = NDArray[Any]


class DeviceArray(Protocol):
    """An array in the memory of a device; any library that knows DLPack takes it without a copy."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...

    def host(self) -> Numbers:
        """A copy in the memory of the processor, after all work that was given to the device."""
        ...

    def fill(self, values: Numbers) -> None:
        """Take values of the same shape from the memory of the processor."""
        ...

    def __dlpack__(
        self, *, stream: Any = None, max_version: Any = None, dl_device: Any = None, copy: Any = None
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...


class Module(Protocol):
    """A compiled source."""

    def launch(self, name: str, threads: int, parameters: Numbers, *arguments: int | float | DeviceArray) -> None:
        """Run a kernel over that many threads, which may still run on return.

        Args:
            name: the kernel.
            threads: how many.
            parameters: of all lanes; they and what follows from them are put into constant memory before.
            arguments: of the kernel.
        """


class Device(Protocol):
    """A machine that runs kernels."""

    def module(self, source: str, single: bool) -> Module:
        """Compile, or take from the cache."""
        ...

    def empty(self, shape: Sequence[int], dtype: Any) -> DeviceArray:
        """An array whose values are not set."""
        ...

    def put(self, values: Numbers) -> DeviceArray:
        """A copy of an array of the processor."""
        ...

    def view(self, array: Any) -> DeviceArray:
        """An array of another library on this device, by DLPack and without a copy; DeviceError: it is not."""
        ...
