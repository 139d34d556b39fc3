"""The plant as one readable Python file that needs the standard library only."""

from __future__ import annotations

import json
import keyword
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .listing import Language, Place, listing
from .traced import Equations, Number, Variable, docstring, elements, one_line
from .writing import filled, write

PYTHON = Language({
    "OP_NOT": "not {0}", "OP_AND": "{0} and {1}", "OP_OR": "{0} or {1}", "OP_IF_ELSE_ZERO": "{1} if {0} else 0.0",
    "OP_SIGN": "(1.0 if {0} > 0.0 else -1.0 if {0} < 0.0 else 0.0)", "OP_FMIN": "{0} if {0} < {1} else {1}",
    "OP_FMAX": "{0} if {0} > {1} else {1}",
}, "nan", "inf")  # fmt: skip
"""Operations of CasADi as Python writes them."""
_TEMPLATE = "plant.py.txt"
_MATH = ("sin", "cos", "exp", "log", "tanh", "asin", "acos", "atan", "atan2", "pow", "fabs", "floor", "sqrt", "inf",
         "nan")
_TAKEN = {*_MATH, *keyword.kwlist, "p", "dt", "rates", "step", "actuate", "ordered_step", "zip", "tuple",
          "map", "float"}  # fmt: skip


def save_python(plant: Equations, path: str | Path) -> Path:
    """Write the plant as a module with `rates(x, u, e)` and `step(x, u, e, dt)`.

    Raises:
        ShipError: a folder that is not there, or a file that cannot be written.
    """
    target = Path(path)
    write({target: module_text(plant)})
    return target


def module_text(plant: Equations) -> str:
    """The whole module: what each element means, the numbers, the right-hand side, the step."""
    body = [*_numbers("NUMBERS", "Numbers of the model, in SI units; a change here changes the ship.", plant.numbers)]
    if plant.servos is not None:
        about = "Numbers of the actuators; lags of 0 and dead times are part of the formulas."
        body += ["", *_numbers("ACTUATORS", about, plant.servos.numbers), f"DT = {plant.servos.dt!r}  # step [s]"]
    body += ["", "", *_rates(plant), filled(_TEMPLATE, "step")]
    if plant.servos is not None:
        body += ["", "", *_actuate(plant), filled(_TEMPLATE, "ordered_step")]
    used = [name for name in _MATH if re.search(rf"(?<![\w.\"]){name}\b", "\n".join(body))]
    wide = ["", "", filled(_TEMPLATE, "exp")] if "exp" in used else []
    imports = [f"from math import {', '.join(n for n in used if n != 'exp')}"] if set(used) - {"exp"} else []
    head = [*_docstring(plant), "", *(["import math"] if wide else []), *imports, ""]
    names = [f"{what} = {_group([json.dumps(one.name) for one in group])}" for what, group in (
        ("STATES", plant.states), ("CONTROLS", plant.controls), ("ENVIRONMENT", plant.environment))]  # fmt: skip
    return "\n".join([*head, *names, "CALM = (0.0,) * len(ENVIRONMENT)", "", *body, *wide, ""])


def _docstring(plant: Equations) -> list[str]:
    text = [
        plant.title, "",
        "rates(x, u, e) is the time derivative of the state, step(x, u, e, dt) the state after dt seconds.",
        "x, u and e are sequences of numbers: lists, tuples or one-dimensional arrays; what comes back are floats.",
        "", "State x:", *elements("x", plant.states), "Controls u, actual values:", *elements("u", plant.controls),
        "Environment e, all zero in calm deep water:", *elements("e", plant.environment),
    ]  # fmt: skip
    if plant.servos is not None:
        text += ["Memory a of the actuators:", *elements("a", plant.servos.memory),
                 "Orders o: one a control, in the order of u."]  # fmt: skip
    return docstring(text)


def _numbers(name: str, about: str, numbers: Sequence[Number]) -> list[str]:
    rows = ((PYTHON.constant(n.value).strip("()"), one_line(f"{n.unit or '-'}, {n.about}"), n) for n in numbers)
    listed = (f"    {json.dumps(n.path)}: {value},  # {meaning}; {n.source}" for value, meaning, n in rows)
    return [f"# {about}", f"{name} = {{", *listed, "}"]


def _locals(*groups: Sequence[Variable]) -> list[list[str]]:
    """A name of its own for each element, the variable's where that is free."""
    taken, found = set(_TAKEN), list[list[str]]()
    for group in groups:
        found.append([])
        for one in group:
            name = re.sub(r"\W", "_", one.name, flags=re.ASCII)
            while name in taken or re.fullmatch(r"w\d+", name):
                name += "_"
            taken.add(name)
            found[-1].append(name)
    return found


def _body(
    f: Any, names: Sequence[Sequence[str]], numbers: Sequence[Number]
) -> tuple[list[str], list[list[str]], set[Place]]:
    """Statements, the expressions of each output, and which elements they read."""

    def leaf(i: int, j: int) -> str:
        return names[i][j] if i < len(names) else f"p[{json.dumps(numbers[j].path)}]"

    listed = listing(f, leaf, PYTHON)
    outputs = [[listed.outputs[i, j] for j in range(f.size1_out(i))] for i in range(f.n_out())]
    return [f"    {name} = {text}" for name, text in listed.statements], outputs, listed.reads


def _group(names: Sequence[str]) -> str:
    return f"({', '.join(names)}{',' if len(names) == 1 else ''})"


def _rates(plant: Equations) -> list[str]:
    names = _locals(plant.states, plant.controls, plant.environment)
    statements, (rates,), reads = _body(plant.open, names, plant.numbers)
    return [
        "def rates(x, u, e=CALM, p=NUMBERS):",
        '    """Time derivative of the state x under the controls u in the environment e."""',
        *(f"    {names[2][j]} = float(e[{j}])" for i, j in sorted(reads) if i == 2),
        f"    {_group(names[0])}, {_group(names[1])} = map(float, x), map(float, u)", *statements, "    return (",
        *(f"        {text},  # {one.name} [{one.unit}/s]" for text, one in zip(rates, plant.states, strict=True)),
        "    )", "", "",
    ]  # fmt: skip


def _actuate(plant: Equations) -> list[str]:
    servos: Any = plant.servos
    names = [[f"a{k}" for k in range(len(servos.memory))], [f"o{k}" for k in range(len(plant.controls))]]
    statements, (acting, after), _ = _body(servos.open, names, servos.numbers)
    return [
        "def actuate(a, o, p=ACTUATORS):",
        '    """What acts on the ship over the next DT seconds under the orders o, and the memory at their end."""',
        f"    {_group(names[0])}, {_group(names[1])} = map(float, a), map(float, o)", *statements, "    u = (",
        *(f"        {text},  # {one.name}" for text, one in zip(acting, plant.controls, strict=True)),
        "    )", "    a_next = (",
        *(f"        {text},  # {one.name}" for text, one in zip(after, servos.memory, strict=True)),
        "    )", "    return u, a_next", "", "",
    ]  # fmt: skip
