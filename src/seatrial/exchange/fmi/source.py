"""The sources of a co-simulation slave: ship.h and ship.c, which are the ship's own, and what is common to all.

A network goes into ship.c with its weights, its memory and one sample of it, so that the slave needs no Python.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from ...models.network import Network, recurrent
from ...models.network_pass import prepared
from ...models.neural import Neural
from ..c_source import C, array_function, plain
from ..writing import filled
from .layout import Layout

COMMON = Path(__file__).parents[1]
_RATES = "void ship_rates(const double x[], const double u[], const double e[], const double p[], double dx[])"
_ACTUATE = "void ship_actuate(const double a[], const double o[], const double p[], double u[], double a_next[])"
_INPUTS = "void ship_inputs(const double v[], double u[], double e[])"
_SAMPLE = ("void ship_sample(const double x[], const double u[], const double e[], const double m[], double dx[],\n"
           "                 double m_next[])")  # fmt: skip
_NETWORK, _A_LINE = "network.c.txt", 5
_LOOPS = {"feedforward": ("feedforward",), "forgetting": ("forgetting",), "rnn": ("rnn", "", "remember"),
          "lstm": ("gates", "lstm", "", "remember"), "gru": ("gates", "gru", "", "remember")}  # fmt: skip
"""Parts of the template that make the first layer of each kind."""


def sources(made: Layout, fmi: int = 2) -> tuple[dict[str, str], str]:
    """The source files by name for a version of FMI, and the guid that is a digest of them."""
    parts = ("fmi/entry.h", "fmi/slave.h", "fmi/slave.c", f"fmi{fmi}/fmi{fmi}.h", f"fmi{fmi}/fmi{fmi}.c")
    common = {Path(part).name: (COMMON / part).read_text(encoding="utf-8") for part in parts}
    own = _source(made)
    told = "\n".join([*common.values(), own, *map(repr, made.all), repr(made.step)])
    guid = f"{{{hashlib.sha256(told.encode()).hexdigest()[:32]}}}"
    return {**common, "ship.c": own, "ship.h": _header(made, guid)}, guid


def compiled(fmi: int) -> tuple[str, ...]:
    """The files that are compiled, in order."""
    return (f"fmi{fmi}.c", "slave.c", "ship.c")


def _header(made: Layout, guid: str) -> str:
    plant, servos = made.plant, made.plant.servos
    network = None if made.network is None else made.network.network
    sizes = {
        "SAMPLED": int(network is not None), "NM": 0 if network is None else memory_of(network),
        "NX": len(plant.states), "NU": len(plant.controls), "NE": len(plant.environment),
        "NA": len(servos.memory) if servos is not None else 0, "NV": len(made.all),
        "V_INPUTS": len(made.outputs), "V_NUMBERS": len(made.outputs) + len(made.inputs),
    }  # fmt: skip
    sizes["V_SERVOS"] = sizes["V_NUMBERS"] + len(made.numbers)
    sizes["V_STARTS"] = sizes["V_SERVOS"] + len(made.servos)
    lines = [
        f"/* {plain(plant.title)} */", "#ifndef SHIP_H", "#define SHIP_H", "", f'#define SHIP_GUID "{guid}"',
        f"#define STEP {made.step!r} /* [s] */", *(f"#define {name} {size}" for name, size in sizes.items()), "",
        "/* Values by value reference; of each number in the actuators' memory the control whose actual value it is,",
        "   and the one whose value it starts from, or -1. */",
        "extern const double ship_values[NV];",
        "extern const int ship_control_of[NA + 1], ship_start_of[NA + 1];", "",
        "/* Rates of the state; what acts and what is remembered next under the orders; orders or forces and the",
        "   environment by the inputs. */",
        *(f"{head};" for head in (_RATES if network is None else _SAMPLE, _ACTUATE, _INPUTS)), "", "#endif", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _source(made: Layout) -> str:
    plant, servos = made.plant, made.plant.servos
    controls = [v.name for v in plant.controls]
    memory = [v.name for v in servos.memory] if servos is not None else []
    actual = [controls.index(name) if name in controls else -1 for name in memory]
    start = [controls.index(name.partition(".")[0]) if _from_control(name) else -1 for name in memory]
    lines = [
        f"/* {plain(plant.title)} */", '#include "ship.h"', "", "#include <math.h>", "",
        "const double ship_values[NV] = {",
        *(f"    {C.constant(real.start)}, /* {k}: {plain(_told(real.name, real.unit))} */"
          for k, real in enumerate(made.all)),
        "};", _table("ship_control_of", actual), _table("ship_start_of", start), "",
        *(array_function(_RATES, plant.open, "xuep", ("dx",)) if made.network is None else _network(made.network)),
    ]  # fmt: skip
    if servos is not None:
        a, o, p = (ca.SX.sym(k, n) for k, n in zip("aop", map(len, (memory, controls, servos.numbers)), strict=True))
        baked = ca.Function("actuate", [a, o, p], [ca.densify(y) for y in servos.open(a, o, p)])
        lines += array_function(_ACTUATE, baked, "aop", ("u", "a_next"))
    else:
        unused = "".join(f"(void){letter}; " for letter in ("a", "o", "p", "u", "a_next"))
        lines += [_ACTUATE, "{", f"    {unused.rstrip()}", "}", ""]
    acting, around = made.terms
    lines += [_INPUTS, "{", *(f"    u[{k}] = {term};" for k, term in enumerate(acting)),
              *(f"    e[{k}] = {term};" for k, term in enumerate(around)), "}", ""]  # fmt: skip
    return "\n".join(lines)


def _from_control(name: str) -> bool:
    """Whether a number of the actuators' memory starts as its control stands: it, and the orders that wait."""
    _, _, rest = name.partition(".")
    return not rest or rest.startswith("order_")


def _told(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _table(name: str, values: Sequence[int]) -> str:
    return f"const int {name}[NA + 1] = {{{', '.join(map(str, [*values, -1]))}}};"


def _network(model: Neural) -> list[str]:
    """`ship_sample` and what it calls: rates that hold over one sample, and the memory of the next."""
    network, bounds = model.network, model.network.limits
    weights = prepared(network, np.float64)
    kept = ["W_x", *(n for n in ("W_r0", "W_hh", "b_0", "b_ih", "b_hh") if n in weights)]
    kept += [name for k in range(1, len(network.layers) + 1) for name in (f"W_{k}", f"b_{k}") if name in weights]
    lines = [f"/* A network of kind {network.kind}: {network.count} weights. */",
             f"enum {{ INPUTS = {network.inputs}, H = {network.layers[0]}, WIDEST = {max(network.layers)}, "
             f"LOOK_BACK = {network.look_back} }};", ""]  # fmt: skip
    for name in kept:
        lines += _doubles(f"{name}[{weights[name].size}]", weights[name].ravel().tolist())
    lines += ["", filled(_NETWORK, "help"), ""]
    if bounds is None:
        lines.append(filled(_NETWORK, "free"))
    else:
        lines += [*_doubles("LOW[INPUTS]", bounds.low), *_doubles("HIGH[INPUTS]", bounds.high),
                  *_doubles("LARGEST[3]", bounds.acceleration), "",
                  filled(_NETWORK, "bounded", rate=repr(bounds.rate))]  # fmt: skip
    gates = 4 if network.kind == "lstm" else 3
    first = (filled(_NETWORK, part, gates=gates) if part else "" for part in _LOOPS[network.kind])
    return [*lines, "", *first, "", _sample(network, repr(float(model.dt))), ""]


def _doubles(head: str, values: Iterable[float]) -> list[str]:
    told = [C.constant(float(v)) for v in values]
    rows = [", ".join(told[k : k + _A_LINE]) for k in range(0, len(told), _A_LINE)]
    return [f"static const double {head} = {{", *(f"    {row}," for row in rows), "};"]


def _sample(network: Network, dt: str) -> str:
    layers = list(network.layers)
    hidden = [filled(_NETWORK, "layer", k=k, of=layers[k - 1], to=layers[k], here="zy"[k % 2 == 0],
                     there="yz"[k % 2 == 0]) for k in range(1, len(layers))]  # fmt: skip
    return filled(
        _NETWORK, "sample", head=_SAMPLE, dt=dt, layers="".join(f"\n{layer}" for layer in hidden),
        wind=f"\n{filled(_NETWORK, 'wind')}" if network.wind else "", last="yz"[len(layers) % 2], count=len(layers),
        width=layers[-1], unused="\n    (void)m; (void)m_next;" if network.kind == "feedforward" else "",
    )  # fmt: skip


def memory_of(network: Network) -> int:
    """Numbers of the memory: whether it has begun, then the latent state or earlier inputs."""
    if network.kind == "feedforward":
        return 0
    if recurrent(network.kind):
        return 1 + network.layers[0] * (2 if network.kind == "lstm" else 1)
    return 1 + network.look_back * network.inputs
