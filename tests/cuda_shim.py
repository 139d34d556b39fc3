"""A device of the processor: the CUDA source behind a few macros, compiled as C, one thread after the other."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from seatrial.engine.cache import library
from seatrial.engine.cuda import Numbers

MACROS = """
#include <tgmath.h>
typedef struct { unsigned x, y, z; } place;
place threadIdx, blockIdx, blockDim;
#define KERNEL void
#define EACH(i,n) for(int i=0;i<n;i++)
#define CONSTANT
#define DEVICE static
#define sincos(x,s,c) (*(s)=sin(x),*(c)=cos(x))
"""


class HostArray:
    """An array of NumPy where a device has one of its own."""

    def __init__(self, values: Numbers) -> None:
        self.values = values
        self.shape, self.dtype = values.shape, values.dtype

    def host(self) -> Numbers:
        return self.values.copy()

    def fill(self, values: Numbers) -> None:
        self.values[...] = values

    def __dlpack__(self, **given: Any) -> Any:
        return self.values.__dlpack__(**given)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.values.__dlpack_device__()


class HostModule:
    """CUDA source as a library of the processor."""

    def __init__(self, source: str, single: bool) -> None:
        self.source, self.code = source, library(MACROS + source)
        sizes = {name: int(size) for name, size in re.findall(r"#define (NP|NU) (\d+)", source)}
        number = ctypes.c_float if single else ctypes.c_double
        self.constants = np.ctypeslib.as_array((number * (sizes["NP"] + sizes["NU"])).in_dll(self.code, "K"))
        self.given = sizes["NP"]

    def _fix(self, parameters: Numbers) -> None:
        self.constants[: len(parameters)] = parameters
        self.constants[self.given :] = np.nan  # a word that is read before it is written shows
        derived = np.empty_like(self.constants)
        self.code.uniform(ctypes.c_void_p(derived.ctypes.data))
        self.constants[self.given :] = derived[: len(derived) - self.given]

    def launch(self, name: str, threads: int, parameters: Numbers, *arguments: Any) -> None:
        self._fix(parameters)
        given = [_argument(value) for value in arguments]
        kernel, block = getattr(self.code, name), 32
        kernel.restype = None
        width, number, thread = (_place(self.code, which) for which in ("blockDim", "blockIdx", "threadIdx"))
        width[0] = block
        for k in range(-(-threads // block) * block):
            number[0], thread[0] = divmod(k, block)
            kernel(*given)


def _place(code: ctypes.CDLL, name: str) -> Any:
    return (ctypes.c_uint * 3).in_dll(code, name)


def _argument(value: Any) -> Any:
    if isinstance(value, HostArray):
        return ctypes.c_void_p(value.values.ctypes.data)
    return ctypes.c_longlong(value) if isinstance(value, int) else ctypes.c_double(value)


class Shim:
    """The device."""

    def module(self, source: str, single: bool) -> HostModule:
        return HostModule(source, single)

    def empty(self, shape: Sequence[int], dtype: Any) -> HostArray:
        return HostArray(np.full(shape, np.nan, dtype) if np.dtype(dtype).kind == "f" else np.zeros(shape, dtype))

    def view(self, array: Any) -> HostArray:
        return HostArray(np.from_dlpack(array))

    def put(self, values: Numbers) -> HostArray:
        return HostArray(np.array(values, order="C"))
