"""Printing CasADi's instruction lists as CUDA C++: one lane a thread, the whole run in one kernel, state in registers.

The table of operations is that of the C printer.  A value is printed in the scope in which it changes: once for all
lanes (kept in constant memory, whose words cost an instruction no register), once a lane, once a step, or at every
stage of the Runge-Kutta method.  The loops are in rollout.cu and sensitivity.cu beside this module, in C, so that a
few macros make them a program of the processor too.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

from ...core.symbolic import Function, alone
from .. import System
from ..csource import UNIFORM, Statement, scopes, shared_reciprocals, statements
from ..trace import Jacobian

BLOCK = 64
"""Threads of a block: small, so that registers go to as many warps as they hold."""

LANE, STEP, STAGE = range(UNIFORM + 1, UNIFORM + 4)
_SCOPES = ("UNIFORM_SCOPE", "LANE_SCOPE", "STEP_SCOPE", "STAGE_SCOPE")
_TOKEN = re.compile(r"(?<![\w.])(?:([wi]\d[\d_]*)|(\d+\.?\d*(?:e[-+]?\d+)?))(?![\w.])")

Given = Callable[[int, int], tuple[str, int]]
"""An input of a function by its number and element: what it is in the kernel, and its scope."""


@cache
def _file(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


class _Kernel:
    """A kernel in the making: its statements by scope, and how many uniform values the others read."""

    def __init__(self, parameters: int, lanewise: Mapping[int, int]) -> None:
        self.lines: tuple[list[str], ...] = (["U[0]=K[0];"], [], [], [])  # or constant memory without readers is gone
        self.uniform, self._parameters, self._lanewise = 1, parameters, lanewise

    def parameter(self, j: int) -> tuple[str, int]:
        """A parameter of all lanes, or of each."""
        return (f"Q[{self._lanewise[j]}*n+lane]", LANE) if j in self._lanewise else (f"K[{j}]", UNIFORM)

    def inputs(self, acting: list[tuple[str, int]]) -> Given:
        """Inputs of a right-hand side: the state at a stage, what acts over the step, parameters."""
        return lambda i, j: (f"w[{j}]", STAGE) if i == 0 else acting[j] if i == 1 else self.parameter(j)

    def add(self, f: Function, mark: str, given: Given) -> list[tuple[str, int]]:
        """Print `f`, its names beginning with `mark`; texts and scopes of its outputs."""
        found, used = statements(f)
        scope, text = dict[str, int](), dict[str, str]()
        for i, j in sorted(used):
            name = f"i{i}_{j}"
            value, scope[name] = given(i, j)
            text[name] = value if scope[name] == UNIFORM else f"{mark}{name}"
            if scope[name] != UNIFORM:
                self.lines[scope[name]].append(f"const real {mark}{name}={value};")
        found = shared_reciprocals(found, scopes(found, scope))
        scope = scopes(found, scope)
        read = {name for one in found if not one.name or scope[one.name] != UNIFORM for name in one.reads}
        outward = {one.name for one in found if one.name in read and scope[one.name] == UNIFORM}
        self._print(found, mark, scope, text, outward)
        ends = {one.to: (_written(one.expression, text), scope[f"y{one.to}"]) for one in found if not one.name}
        return [ends[k] for k in range(len(ends))]

    def _print(
        self, found: list[Statement], mark: str, scope: dict[str, int], text: dict[str, str], outward: set[str]
    ) -> None:
        """Print the statements; within the kernel a uniform value that others read is a word of constant memory."""
        inner, twins = dict(text), _twins(found)
        for one in (s for s in found if s.name):
            names, own = inner if scope[one.name] == UNIFORM else text, f"{mark}{one.name}"
            lines = self.lines[scope[one.name]]
            inner[one.name] = text[one.name] = own
            if one.name in twins:
                sine, cosine = twins[one.name]
                if one.name == min(sine, cosine, key=lambda name: int(name[1:])):
                    a, b, x = f"{mark}{sine}", f"{mark}{cosine}", _written(one.reads[0], names)
                    lines.append(f"real {a},{b}; sincos({x},&{a},&{b});")
            else:
                lines.append(f"const real {own}={_written(one.expression, names)};")
            if one.name in outward:
                lines.append(f"U[{self.uniform}]={own};")
                text[one.name] = f"K[NP+{self.uniform}]"
                self.uniform += 1

    @alone
    def source(self, template: str, sizes: Mapping[str, int], texts: Mapping[str, str], single: bool) -> str:
        """The kernel in its loops."""
        body = template
        scopes = zip(_SCOPES, map("\n".join, self.lines), strict=True)
        for name, lines in (*scopes, *texts.items()):
            body = re.sub(rf"\b{name}\b", lambda _, lines=lines: lines, body)
        sizes = {**sizes, "NP": max(self._parameters, 1), "NU": self.uniform, "BLOCK": BLOCK}
        head = "".join(f"#define {name} {size}\n" for name, size in sizes.items())
        return f"typedef {'float' if single else 'double'} real;\n{head}{_file('kernel.h')}{body}"


def _written(expression: str, names: Mapping[str, str]) -> str:
    """An expression with its names as they are in the kernel, and numbers in its precision."""
    return _TOKEN.sub(lambda m: names[m[1]] if m[1] else f"R({m[2]})", expression)


def _twins(found: list[Statement]) -> dict[str, tuple[str, str]]:
    """Sine and cosine of one argument, by either name: one call gives both."""
    calls = {one.expression: one.name for one in found if one.name}
    pairs = [
        (name, calls[f"cos{of[3:]}"]) for of, name in calls.items() if of[:4] == "sin(" and f"cos{of[3:]}" in calls
    ]
    return {name: pair for pair in pairs for name in pair}


def _ends(name: str, values: list[tuple[str, int]]) -> str:
    return "".join(f"{name}[{i}]={value};" for i, (value, _) in enumerate(values))


def rollout_source(
    system: System, rhs: Function, before: Function | None, lanewise: Mapping[int, int], single: bool
) -> str:
    """CUDA source of the kernel that integrates `system`, one lane a thread."""
    kernel, ns, nm, nl = (
        _Kernel(len(system.parameters), lanewise),
        len(system.states),
        len(system.memory),
        len(system.logged),
    )
    acting: list[tuple[str, int]] = [(f"s[{j}*sc]", STEP) for j in range(len(system.series))]
    texts = {"LOGGED": "", "MEMORY": ""}
    if before is not None:
        clock = (("(real)(t0+t*step)", STEP), ("dt", LANE))
        of = ("", "", "z", "m")

        def given(i: int, j: int) -> tuple[str, int]:
            if i == 5:
                return kernel.parameter(j)
            return clock[i] if i < 2 else (f"s[{j}*sc]", STEP) if i == 4 else (f"{of[i]}[{j}]", STEP)

        ends = kernel.add(before, "b", given)
        end = len(ends) - nl
        acting, after, logged = ends[: end - nm], ends[end - nm : end], ends[end:]
        texts["MEMORY"] = _ends("m", after)
        texts["LOGGED"] = "".join(f"Y[{ns + nm + i}*n+lane]={value};" for i, (value, _) in enumerate(logged))
    rates = kernel.add(rhs, "r", kernel.inputs(acting))
    kernel.lines[STAGE].append(f"real k[NS];{_ends('k', rates)}")
    sizes = {"NS": ns, "NM": nm, "NM1": max(nm, 1), "NO": ns + nm + nl}
    return kernel.source(_file("rollout.cu"), sizes, texts, single)


def sensitivity_source(system: System, j: Jacobian, initial: int, lanewise: Mapping[int, int], single: bool) -> str:
    """CUDA source of the kernel that integrates an open-loop `system` with some columns of its sensitivities.

    Args:
        system: the system.
        j: its Jacobian by the parameters of these columns.
        initial: number of columns by the initial state behind them.
        lanewise: position of each lane-wise parameter by its index.
        single: single precision.
    """
    kernel, ns, nf = _Kernel(len(system.parameters), lanewise), len(system.states), len(j.free)
    acting = [(f"s[{e}*sc]", STEP) for e in range(len(system.series))]
    ends = kernel.add(j.function, "j", kernel.inputs(acting))
    first = ns + len(j.A)
    kernel.lines[STAGE].append(f"real k[NS];{_ends('k', ends[:ns])}")
    column = "EACH(i,NS)v[i]=R(0.0);" + "".join(
        f"v[{i}]+={ends[ns + q][0]}*x[{k}];" for q, (i, k) in enumerate(j.A)
    ) + "".join(
        f"if(c=={c})v[{i}]+={ends[first + q * nf + c][0]};" for q, i in enumerate(j.rows) for c in range(nf)
    )  # fmt: skip
    sizes = {"NS": ns, "NF": nf, "NC": nf + initial}
    return kernel.source(_file("sensitivity.cu"), sizes, {"COLUMN": column}, single)


def lane_source(
    f: Function, template: str, into: Sequence[tuple[str, int]], sizes: Mapping[str, int], single: bool
) -> str:
    """CUDA source of a template that computes `f` of an array `u` once a lane, in LANE_SCOPE and BEGUN.

    Args:
        f: the function of one vector.
        template: the kernels.
        into: arrays of the kernel that take its outputs in turn, lanes last, and how many each takes.
        sizes: constants of the template.
        single: single precision.
    """
    kernel = _Kernel(0, {})
    ends = iter(kernel.add(f, "e", lambda i, j: (f"u[{j}]", LANE)))
    begun = "".join(f"{name}[{k}*n+lane]={next(ends)[0]};" for name, count in into for k in range(count))
    return kernel.source(template, sizes, {"BEGUN": begun}, single)
