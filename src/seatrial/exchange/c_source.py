"""The plant as C99: one header, one source file, the C mathematics library and nothing else."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..core.symbolic import Function
from .listing import Language, listing
from .traced import Equations, Number, Variable, elements
from .writing import filled, write


def save_c(plant: Equations, folder: str | Path) -> tuple[Path, Path]:
    """Write ``<name>.h`` and ``<name>.c`` into a folder that is there.

    Raises:
        ShipError: a folder that is not there, or a file that cannot be written.
    """
    where = Path(folder)
    header, source = where / f"{plant.name}.h", where / f"{plant.name}.c"
    write({header: header_text(plant), source: source_text(plant)})
    return header, source


C = Language({
    "OP_NOT": "!{0}", "OP_AND": "{0} && {1}", "OP_OR": "{0} || {1}", "OP_IF_ELSE_ZERO": "{0} ? {1} : 0.0",
    "OP_SIGN": "({0} > 0.0) - ({0} < 0.0)", "OP_FMIN": "{0} < {1} ? {0} : {1}", "OP_FMAX": "{0} > {1} ? {0} : {1}",
}, "NAN", "INFINITY")  # fmt: skip


def plain(text: str) -> str:
    """Text that may stand in any comment: ASCII, without the marks of one."""
    ascii_ = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode("ascii")
    return ascii_.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?").replace("\\", "/")


def _numbers(title: str, numbers: Sequence[Number]) -> Iterable[str]:
    yield from ("", f"   {title}, in SI units, with their sources:")
    for n in numbers:
        yield f"     {n.path} = {n.value!r} {n.unit}  {n.about}; {n.source}"


_STEP = "const double x[], const double u[], const double e[], double dt, double x_next[]"
_ACTUATE = "const double a[], const double o[], double u[], double a_next[]"
_ORDERED = "const double x[], const double a[], const double o[], const double e[], double x_next[], double a_next[]"


def header_text(plant: Equations) -> str:
    """The header: what each element means, the sizes, the functions."""
    upper, name = plant.name.upper(), plant.name
    text = [f"   {plant.title}", "", "   State x:", *elements("x", plant.states, 5), "   Controls u, actual values:",
            *elements("u", plant.controls, 5), "   Environment e, all zero in calm deep water:",
            *elements("e", plant.environment, 5)]  # fmt: skip
    sizes = {"NX": len(plant.states), "NU": len(plant.controls), "NE": len(plant.environment)}
    if plant.servos is not None:
        sizes["NA"] = len(plant.servos.memory)
        text += ["   Memory a of the actuators:", *elements("a", plant.servos.memory, 5)]
        text += ["   Orders o: one a control, in the order of u."]
    text += _numbers("Numbers of the model", plant.numbers)
    if plant.servos is not None:
        text += _numbers("Numbers of the actuators", plant.servos.numbers)
    lines = [
        "/*", *map(plain, text), "",
        "   No allocation, no state, no side effects: every function may run in several threads.",
        "   Infinity is a number here (a rate without limit): compile without -ffast-math.", "*/",
        f"#ifndef {upper}_H", f"#define {upper}_H", "", "#ifdef __cplusplus", 'extern "C" {', "#endif", "",
        *(f"#define {upper}_{key} {size}" for key, size in sizes.items()), "",
        "/* Where each state stands in x, and each control in u. */",
        _places(upper, "X", plant.states), _places(upper, "U", plant.controls), "",
        "/* Time derivative dx of the state x, in the units of x per second. */",
        f"void {name}_rates(const double x[], const double u[], const double e[], double dx[]);", "",
        "/* x after dt seconds by the Runge-Kutta method of fourth order, u and e held; x_next may be x. */",
        f"void {name}_step({_STEP});",
    ]  # fmt: skip
    if plant.servos is not None:
        lines += [
            "", f"/* One step of {name}_ordered_step and {name}_actuate [s]. */",
            f"#define {upper}_DT {plant.servos.dt!r}", "",
            "/* The actuators under the orders o: u acts over the step, a_next (may be a) is left at its end. */",
            f"void {name}_actuate({_ACTUATE});", "",
            "/* State and actuators after one step under the orders o; x_next may be x, a_next may be a. */",
            f"void {name}_ordered_step({_ORDERED});",
        ]  # fmt: skip
    return "\n".join([*lines, "", "#ifdef __cplusplus", "}", "#endif", "", "#endif", ""])


def _places(upper: str, letter: str, variables: Sequence[Variable]) -> str:
    names = [re.sub(r"\W", "_", one.name, flags=re.ASCII) for one in variables]
    apart = (name if names.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(names))
    return f"enum {{ {', '.join(f'{upper}_{letter}_{name} = {k}' for k, name in enumerate(apart))} }};"


def array_function(head: str, f: Function, letters: str, targets: Sequence[str]) -> list[str]:
    """A C function of arrays: elements read once, then terms, then the outputs."""
    listed = listing(f, lambda i, j: f"{letters[i]}{j}", C)
    idle = [letter for i, letter in enumerate(letters) if not any(place[0] == i for place in listed.reads)]
    return [
        head, "{",
        *(f"    const double {letters[i]}{j} = {letters[i]}[{j}];" for i, j in sorted(listed.reads)),
        *(f"    const double {name} = {text};" for name, text in listed.statements),
        *(f"    (void){letter};" for letter in idle),
        *(f"    {targets[i]}[{j}] = {text};" for (i, j), text in sorted(listed.outputs.items())),
        "}", "",
    ]  # fmt: skip


def source_text(plant: Equations) -> str:
    """The source: the terms of the right-hand side one by one, then the step."""
    name, upper = plant.name, plant.name.upper()
    rates = f"void {name}_rates(const double x[], const double u[], const double e[], double dx[])"
    lines = [f"/* {plain(plant.title)}: see {name}.h */", f'#include "{name}.h"', "", "#include <math.h>", "",
             *array_function(rates, plant.rates, "xue", ("dx",)),
             filled("plant.c.txt", "step", name=name, head=_STEP, nx=f"{upper}_NX")]  # fmt: skip
    if plant.servos is not None:
        lines += ["", *array_function(f"void {name}_actuate({_ACTUATE})", plant.servos.baked, "ao", ("u", "a_next")),
                  filled("plant.c.txt", "ordered_step", name=name, head=_ORDERED, upper=upper)]  # fmt: skip
    return "\n".join([*lines, ""])
