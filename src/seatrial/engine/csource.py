"""Printing CasADi's flat instruction lists as C, one statement an instruction, inside a lane loop.

The printed code knows lanes and nothing else: the C compiler vectorises the loop, with the vector
mathematics of the C library.  The loops around it are in kernel.h, rollout.c and sensitivity.c beside this module.
Traps that shaped it: sin and cos of one argument would be fused into sincos, which has no vector form
(-fno-builtin); fmin/fmax as calls cost five times a select; -ffast-math is not needed and would hide NaN.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

import casadi as ca

from ..core.symbolic import Function
from . import System
from .trace import Jacobian

UNIFORM = 0
"""Scope of what is the same for all lanes; those above change more often."""

LANES = 16
"""Lanes of a block: two vectors of AVX-512, four of AVX2; every array is padded to it."""

BINARY = {"OP_ADD": "+", "OP_SUB": "-", "OP_MUL": "*", "OP_DIV": "/"}
"""Operations of CasADi that C writes between its operands."""
CALLS = ("sin", "cos", "exp", "log", "tanh", "asin", "acos", "atan", "atan2", "pow")
"""Functions that the mathematical library of C has under the same name, and that the vector kernels replace."""
CALL = {f"OP_{name.upper()}": name for name in CALLS} | {"OP_FABS": "fabs", "OP_FLOOR": "floor", "OP_SQRT": "sqrt", "OP_CONSTPOW": "pow"}
"""Operations of CasADi that C calls by a function's name."""
FORM = {
    "OP_ASSIGN": "{0}", "OP_NEG": "-{0}", "OP_SQ": "{0}*{0}", "OP_TWICE": "{0}+{0}", "OP_INV": "1.0/{0}",
    "OP_LT": "({0}<{1}?1.0:0.0)", "OP_LE": "({0}<={1}?1.0:0.0)", "OP_EQ": "({0}=={1}?1.0:0.0)",
    "OP_NE": "({0}!={1}?1.0:0.0)", "OP_NOT": "({0}==0.0?1.0:0.0)",
    "OP_AND": "(({0}!=0.0)&({1}!=0.0)?1.0:0.0)", "OP_OR": "(({0}!=0.0)|({1}!=0.0)?1.0:0.0)",
    "OP_IF_ELSE_ZERO": "({0}!=0.0?{1}:0.0)", "OP_SIGN": "({0}>0.0?1.0:({0}<0.0?-1.0:0.0))",
    "OP_FMIN": "({0}<{1}?{0}:{1})", "OP_FMAX": "({0}>{1}?{0}:{1})",
}  # fmt: skip
"""Operations that are written out; comparisons give 1.0 or 0.0, as CasADi's do."""

_TRUTH = "?1.0:0.0)"
"""How a comparison ends that is a number."""

HEADER = Path(__file__).with_name("kernel.h").read_text(encoding="utf-8")
"""What stands before each kernel: vector types and the functions above for them."""


@cache
def _loop(name: str) -> str:
    return "\n" + Path(__file__).with_name(name).read_text(encoding="utf-8")


@cache
def opcodes() -> dict[int, str]:
    """Names of CasADi's operations by number."""
    return {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}


def _constant(value: float) -> str:
    if math.isnan(value):
        return "NAN_"
    if math.isinf(value):
        return "INF" if value > 0 else "(-INF)"
    return f"({value!r})"


class Statement(NamedTuple):
    """One instruction of a list: the name of its value, empty for an output, which goes to the element `to`."""

    name: str
    expression: str
    reads: tuple[str, ...]
    to: int = -1


def statements(f: Function) -> tuple[list[Statement], set[tuple[int, int]]]:
    """Instructions of `f` in C, and the (input, element) pairs they read as ``i<input>_<element>``."""
    names: dict[int, str] = {}
    made: dict[str, tuple[str, tuple[str, ...]]] = {}
    found: list[Statement] = []
    used: set[tuple[int, int]] = set()
    names_of = opcodes()
    for k in range(f.n_instructions()):
        op, to, of = names_of[f.instruction_id(k)], f.instruction_output(k), f.instruction_input(k)
        if op == "OP_INPUT":
            used.add((of[0], of[1]))
            names[to[0]] = f"i{of[0]}_{of[1]}"
        elif op == "OP_CONST":
            names[to[0]] = _constant(f.instruction_constant(k))
        elif op == "OP_OUTPUT":
            found.append(Statement("", names[of[0]], (names[of[0]],), to[1]))
        else:
            reads = tuple(names[i] for i in of)
            made[f"w{k}"] = op, reads
            selected = _selected(op, reads, made)
            text = f"({selected[0]}!=0.0?{selected[1]}:{selected[2]})" if selected else _expression(op, reads)
            found.append(Statement(f"w{k}", text, selected or reads))
            names[to[0]] = f"w{k}"
    return found, used


def scopes(found: list[Statement], inputs: Mapping[str, int]) -> dict[str, int]:
    """Scopes of inputs, values and outputs: that in which the last of what they read changes."""
    scope = dict(inputs)
    for one in found:
        scope[one.name or f"y{one.to}"] = max((scope.get(name, UNIFORM) for name in one.reads), default=UNIFORM)
    return scope


def shared_reciprocals(found: list[Statement], scope: Mapping[str, int]) -> list[Statement]:
    """Divisions by what changes less often, or by one denominator, as products: a division is some 20 instructions.

    A Jacobian of the standard MMG has 54 in every stage, by 11 denominators, 3 of them of parameters alone.  A vector
    of AVX-512 is divided in 16 cycles and multiplied in half of one, so divisions bound these kernels.
    """
    by = [one.reads[1] for one in found if one.name and one.expression == "/".join(one.reads)]
    often, out, known = Counter(by), list[Statement](), dict[str, str]()
    unused = 1 + max((int(one.name[1:]) for one in found if one.name), default=0)
    for one in found:
        below = one.reads[-1] if one.name and one.expression == "/".join(one.reads) else ""
        if not below or (often[below] == 1 and scope[one.name] == scope.get(below, UNIFORM)):
            out.append(one)
            continue
        if below not in known:
            known[below] = f"w{unused + len(known)}"
            out.append(Statement(known[below], f"1.0/{below}", (below,)))
        out.append(Statement(one.name, f"{one.reads[0]}*{known[below]}", (one.reads[0], known[below])))
    return out


def _selected(
    op: str, a: tuple[str, ...], made: Mapping[str, tuple[str, tuple[str, ...]]]
) -> tuple[str, str, str] | None:
    """Condition and both values where a sum is the two half selections of an `if_else`; None for any other sum."""
    if op != "OP_ADD":
        return None
    (yes, taken), (no, left) = (made.get(name, ("", ())) for name in a)
    if yes != "OP_IF_ELSE_ZERO" or no != "OP_IF_ELSE_ZERO" or made.get(left[0]) != ("OP_NOT", (taken[0],)):
        return None
    return taken[0], taken[1], left[1]


def _expression(op: str, a: tuple[str, ...]) -> str:
    if op in BINARY:
        return f"{a[0]}{BINARY[op]}{a[1]}"
    if op in CALL:
        return f"{CALL[op]}({','.join(a)})"
    return FORM[op].format(*a)


def _declared(one: Statement) -> str:
    """A value; of a comparison as a truth, which the compiler keeps in masks: as numbers many of them stop it."""
    truth = one.expression.removesuffix(_TRUTH)
    return f"const double {one.name}={truth};" if truth == one.expression else f"const _Bool {one.name}={truth});"


def _uniform(kind: str, j: int, lanewise: Mapping[int, int]) -> bool:
    return kind == "scalar" or (kind == "parameters" and j not in lanewise)


def lane_function(name: str, f: Function, arguments: tuple[str, ...], lanewise: dict[int, int]) -> str:
    """A C function over the lanes of one block.

    Args:
        name: its name in C.
        f: the CasADi function.
        arguments: kind of each input of `f`: "lane" (an array per lane), "scalar" (a double),
            or "parameters" (shared scalars `p`, of which some are lane-wise in `q`).
        lanewise: position in `q` of each lane-wise parameter by its index.
    """
    found, used = statements(f)
    inputs = {f"i{i}_{j}": UNIFORM if _uniform(arguments[i], j, lanewise) else UNIFORM + 1 for i, j in used}
    found = shared_reciprocals(found, scopes(found, inputs))
    lines = [_declared(s) if s.name else f"y[{s.to}*LB+b]={s.expression};" for s in found]
    shared: list[str] = []
    loads: list[str] = []
    for i, j in sorted(used):
        kind = arguments[i]
        if kind == "lane":
            loads.append(f"const double i{i}_{j}=a{i}[{j}*LB+b];")
        elif kind == "scalar":
            shared.append(f"const double i{i}_{j}=a{i};")
        elif j in lanewise:
            loads.append(f"const double i{i}_{j}=q[{lanewise[j]}*LB+b];")
        else:
            shared.append(f"const double i{i}_{j}=p[{j}];")
    inputs = [f"in a{i}" if k == "lane" else f"double a{i}" for i, k in enumerate(arguments) if k != "parameters"]
    return (
        f"static void {name}({','.join(inputs)},in q,in p,out y){{\n{''.join(shared)}\n"
        "#pragma omp simd\nfor(long b=0;b<LB;b++){" + "".join(loads) + "\n" + "\n".join(lines) + "}}\n"
    )


def staged(name: str, f: Function, lanewise: Mapping[int, int]) -> tuple[str, int]:
    """Two C functions of rates, and how many numbers a lane goes between: one once a step, the other at each stage.

    What acts and the parameters hold over a step, so what reads these alone (two of the six calls of the standard MMG,
    the sine and cosine of the rudder angle) is worked out once for the four stages: of each lane, or once for all.

    Args:
        name: in C.
        f: of the state, what acts, and the parameters.
        lanewise: position in `q` of each lane-wise parameter by its index.
    """
    found, used = statements(f)
    stage = UNIFORM + 2
    inputs = {f"i{i}_{j}": stage if i == 0 else UNIFORM if i == 2 and j not in lanewise else UNIFORM + 1
              for i, j in used}  # fmt: skip
    found = shared_reciprocals(found, scopes(found, inputs))
    scope = scopes(found, inputs)
    read = {one for s in found if not s.name or scope[s.name] == stage for one in s.reads if one.startswith("w")}
    own, fixed = ([s for s in found if s.name and scope[s.name] == at] for at in (UNIFORM + 1, UNIFORM))
    lanes = {s.name: f"h[{k}*LB+b]" for k, s in enumerate(s for s in own if s.name in read)}
    shared = {s.name: f"h[{len(lanes)}*LB+{k}]" for k, s in enumerate(s for s in fixed if s.name in read)}
    scalars = "".join(f"const double i{i}_{j}=p[{j}];" for i, j in sorted(used) if inputs[f"i{i}_{j}"] == UNIFORM)
    loads = {f"i{i}_{j}": f"const double i{i}_{j}=" + (f"q[{lanewise[j]}*LB+b];" if i == 2 else f"a{i}[{j}*LB+b];")
             for i, j in sorted(used) if inputs[f"i{i}_{j}"] != UNIFORM}  # fmt: skip
    held = "".join(f"{_declared(s)}\n" for s in fixed) + "".join(f"{to}={one};" for one, to in shared.items())
    truths = {s.name for s in own if s.expression.endswith(_TRUTH)}
    kept = "".join(f"{to}={f'({one}{_TRUTH}' if one in truths else one};" for one, to in lanes.items())
    once = "\n".join([*(load for one, load in loads.items() if inputs[one] < stage), *map(_declared, own), kept])
    known = [f"const double {one}={at};" for one, at in lanes.items()]
    lines = [_declared(s) if s.name else f"y[{s.to}*LB+b]={s.expression};" for s in found
             if not s.name or scope[s.name] == stage]  # fmt: skip
    loop = "#pragma omp simd\nfor(long b=0;b<LB;b++){"
    text = f"static void {name}_held(in a1,in q,in p,out h){{\n{scalars}\n{held}\n{f'{loop}{once}}}' if lanes else ''}}}\n"
    text += f"static void {name}(in a0,in a1,in q,in p,in h,out y){{\n{scalars}\n"
    text += "".join(f"const double {one}={at};" for one, at in shared.items())
    text += f"\n{loop}{''.join(loads.values())}{''.join(known)}\n" + "\n".join(lines) + "}}\n"
    return text, len(lanes) + -(-len(shared) // LANES)


def propagation(j: Jacobian, states: int) -> str:
    """C function `slope`: rates A s + B of one column of sensitivities, shape (states, lanes), for column `k`.

    Sensitivities are propagated outside the traced function, column by column with the structural
    non-zeros of A only, which keeps the compiled graph small.
    """
    text = ["static void slope(in y,in s,long k,out v){\n#pragma omp simd\nfor(long b=0;b<LB;b++){\n"]
    text += [f"const double s{i}=s[{i}*LB+b];" for i in range(states)]
    text += [f"double d{i}=0.0;" for i in range(states)]
    text += [f"d{i}+=y[{states + n}*LB+b]*s{k};" for n, (i, k) in enumerate(j.A)]
    first = states + len(j.A)
    if j.free:
        columns = len(j.free)
        text += ["if(k<NF){", *(f"d{i}+=y[({first + n * columns}+k)*LB+b];" for n, i in enumerate(j.rows)), "}"]
    return "".join([*text, "\n", *(f"v[{i}*LB+b]=d{i};" for i in range(states))]) + "}}\n"


def _head(sizes: Mapping[str, int]) -> str:
    return HEADER + "".join(f"#define {name} {size}L\n" for name, size in sizes.items())


def rollout_source(
    system: System, rhs: Function, before: Function | None, lanewise: dict[int, int],
    kicks: tuple[Function, Function, Function] | None = None,
) -> str:  # fmt: skip
    """C source of the kernel that integrates `system` over lanes."""
    acting = len(system.acting or system.series)
    ns, nm, nl = len(system.states), len(system.memory), len(system.logged)
    sizes = {
        "NS": ns, "NM": nm, "NM1": max(nm, 1), "NL": nl, "NA": acting, "NQ": max(len(lanewise), 1),
        "NY": max(acting + nm + nl, 1), "NO": ns + nm + nl,
    }  # fmt: skip
    rates, held = staged("rhs", rhs, lanewise)
    text = _head(sizes | {"NH": max(held, 1)}) + rates
    prepare = "const double*a=s;"
    if before is not None:
        kinds = ("scalar", "scalar", "lane", "lane", "lane", "parameters")
        text += lane_function("before", before, kinds, lanewise)
        prepare = "before(t0+t*dt,dt,z,m,s,q,P,y); const double*a=y;"
    macros = _loop_macros(system) | {"PREPARE": prepare}
    if system.field is not None:
        text = text.replace(HEADER, HEADER + _field_sizes(system)) + _loop("field.c")
    for name, f in zip(("touch", "kick_in", "kick_out"), kicks or (), strict=False):
        kinds = ("lane", "lane") if name == "touch" else ("scalar", "lane", "lane", "lane", "lane", "parameters")
        text += lane_function(name, f, kinds, lanewise)
    loop = _loop("rollout.c")
    for name, line in macros.items():
        loop = loop.replace(f"{name}\n", f"{line}\n")
    return text + loop


def _field_sizes(system: System) -> str:
    field = system.field
    sizes = {"NG": len(system.given), "NF": len(field.names), "NE": len(field.near)} if field else {}
    return "".join(f"#define {name} {size}L\n" for name, size in sizes.items())


def _loop_macros(system: System) -> dict[str, str]:
    """Lines of the loop that only some systems have: looks into a field, substeps between kicks."""
    looked, kicks = system.field is not None, system.kicks
    steps = kicks.substeps if kicks else 1
    around = "double with[(NG+NF+NE+1)*LB]={0}; long seen[LB+1]={0},close=0;"
    look = "for(long i=0;i<NG*LB;i++)with[i]=s[i]; seen[LB]=0; close=look(z,W,with+NG*LB,seen); s=with;"
    first = last = ""
    if kicks:
        around += f" double kick[(NS+1)*LB],touched[{max(kicks.touched, 1)}L*LB]; long known=0;"
        look += " if(seen[LB]||!close)known=0;"
        # What was touched at the end of a step is so at the beginning of the next, while all lanes stay in their cells.
        first = ("if(close){if(!known)touch(z,a,q,P,touched); rhs(z,a,q,P,held,k); kick_in(h,z,k,a,touched,q,P,kick);"
                 " for(long i=0;i<NS*LB;i++)z[i]=kick[i];}")  # fmt: skip
        last = ("if(close){touch(z,a,q,P,touched); known=1; kick_out(h,z,kick+NS*LB,a,touched,q,P,w);"
                " for(long i=0;i<NS*LB;i++)z[i]=w[i];} }")  # fmt: skip
    return {
        "AROUND": around if looked else "",
        "LOOK": look if looked else "",
        "SUBSTEPS": f"const double h=dt/{steps}.0; for(long sub=0;sub<{steps}L;sub++){{" if kicks else "const double h=dt;",
        "FIRST": first, "LAST": last,
    }  # fmt: skip


def sensitivity_source(system: System, j: Jacobian, lanewise: dict[int, int]) -> str:
    """C source of the kernel that integrates an open-loop `system` with its sensitivities."""
    ns, nf = len(system.states), len(j.free)
    sizes = {
        "NS": ns, "NF": nf, "NC": nf + ns, "NA": len(system.series), "NQ": max(len(lanewise), 1),
        "NJ": ns + len(j.A) + len(j.rows) * nf,
    }  # fmt: skip
    rates, held = staged("jac", j.function, lanewise)
    text = _head(sizes | {"NH": max(held, 1)}) + rates
    return text + propagation(j, ns) + _loop("sensitivity.c")
