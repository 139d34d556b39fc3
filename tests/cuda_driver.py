"""A plugin of pytest under which `cuda` tests run without a GPU: cuda-core over a stand-in for the driver.

Memory, copies, constants and launches go the way they go on a GPU, down to the functions of the driver (cuda_driver.c);
kernels are the source behind the macros of `cuda_shim`.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from cuda_shim import MACROS
from seatrial.engine import cache
from seatrial.engine.cuda import gpu

SOURCE = Path(__file__).with_name("cuda_driver.c")


def compiled(source: str, architecture: str, single: bool) -> bytes:
    """In place of machine code the path of a library of the processor, with a function for each kernel."""
    text = f"{MACROS}{source}\nunsigned long size_of_K = sizeof K;\n"
    for name, parameters in re.findall(r"KERNEL (\w+)\((.*?)\)\{", source):
        kinds = ["long long" if one.startswith("whole") else "double" if one.startswith("double ") else "void*"
                 for one in parameters.split(",")]  # fmt: skip
        given = ",".join(f"*({kind}*)p[{k}]" for k, kind in enumerate(kinds))
        text += f"void call_{name}(void **p) {{ {name}({given}); }}\n"
    return cache.library(text)._name.encode() + b"\0"


def pytest_configure(config: Any) -> None:
    gpu.compiled = compiled
