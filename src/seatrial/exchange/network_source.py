"""A network as one readable Python file with its weights beside it; it needs NumPy only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..environment import CHANNELS
from ..models import STATES, unit
from ..models.network import INPUTS, Network
from ..models.neural import Neural
from ..ships import Ship, ShipError
from .traced import ABOUT, docstring, one_line, unit_around
from .writing import filled, title, write

_TEMPLATE = "network.py.txt"


def save_network(ship: Ship, path: str | Path) -> tuple[Path, ...]:
    """Write a ship that moves by a network as a module with `begin(x, u, e)` and `step(x, u, e, memory)`.

    The weights go beside it, under the same name with the suffix .npz.

    Raises:
        ShipError: a network without weights, or a file that cannot be written.
    """
    target, weights = Path(path), dict(trained(ship).network.weights)

    def save(name: str) -> None:
        with Path(name).open("wb") as stream:
            np.savez(stream, **weights)  # type: ignore[arg-type]

    return write({target.with_suffix(".npz"): save, target: network_text(ship)})


def trained(ship: Ship) -> Neural:
    """The network that a ship moves by.

    Raises:
        ShipError: one without weights.
    """
    if not isinstance(ship.model, Neural) or not ship.model.network.trained:
        raise ShipError(f"{ship.name}: has no weights to export; train it with seatrial identify")
    return ship.model


def network_text(ship: Ship) -> str:
    """The whole module: what each element means, the equations, the step."""
    model: Any = ship.model
    network: Network = model.network
    lines = [*_docstring(ship, network), "", "from pathlib import Path", "", "import numpy as np", ""]
    lines += [f"STATES = {STATES!r}", f"CONTROLS = {model.controls!r}", f"ENVIRONMENT = {CHANNELS!r}",
              "CALM = (0.0,) * len(ENVIRONMENT)"]  # fmt: skip
    lines += [f"DT = {float(model.dt)!r}  # step [s]", f"SCALE = np.array({list(network.scale)!r})"]
    if network.limits is not None:
        on = network.limits
        lines += [f"LOW = np.array({list(on.low)!r})  # what the network sees is held within LOW and HIGH",
                  f"HIGH = np.array({list(on.high)!r})",
                  f"LARGEST = np.array({list(on.acceleration)!r})  # acceleration that the network may ask for",
                  f"RATE = {on.rate!r}  # what a velocity exceeds its range by decays at this rate [1/s]"]  # fmt: skip
    if network.look_back:
        lines.append(f"LOOK_BACK = {network.look_back}  # samples before the present one")
    lines += ["W = dict(np.load(Path(__file__).with_suffix('.npz')))", "", "", _functions(network)]
    return "\n".join(lines) + "\n"


def _docstring(ship: Ship, network: Network) -> list[str]:
    about = [f"    {letter}[{k}]  {name} [{unit(name) if letter != 'e' else unit_around(name)}]  {ABOUT.get(name, '')}"
             for letter, names in (("x", STATES), ("u", ship.model.controls), ("e", CHANNELS))
             for k, name in enumerate(names)]  # fmt: skip
    text = [
        one_line(title(ship)), "",
        f"A network of kind {network.kind} with {network.count} weights; its inputs are",
        f"{', '.join(INPUTS[: network.inputs])} in SI units, velocities through the water and apparent wind.",
        "step(x, u, e, memory) is the state after DT seconds and the memory then; begin(x, u, e) is the memory of",
        "a ship that has been in the state x, under the controls u in the environment e, for ever.",
        "", "State x, controls u (actual values), environment e (all zero in calm):",
        *(line.rstrip() for line in about),
    ]  # fmt: skip
    return docstring(text)


_SIZES = {"rnn": 'len(W["b_0"])', "lstm": '2 * len(W["W_hh"])', "gru": 'len(W["W_hh"])'}
"""Length of the latent state of the kinds that have one."""


def _functions(network: Network) -> str:
    """The functions of the module, two blank lines between them."""
    kind, last, bounded = network.kind, len(network.layers), network.limits is not None
    seen = "    seen = np.array([*velocity, *u])"
    if network.wind:
        seen = "    apparent = to_body(e[0], e[1], x[2]) + x[3:5]\n    seen = np.array([*velocity, *u, *apparent])"
    first = filled(_TEMPLATE, kind)
    if kind in _SIZES:
        first = f"{filled(_TEMPLATE, 'begin', size=_SIZES[kind])}\n{first}"
    layers = (f'\n    z = np.tanh(z @ W["W_{k}"] + W["b_{k}"]) - np.tanh(W["b_{k}"])' for k in range(1, last))
    answer = f'    return z @ W["W_{last}"], memory'
    if bounded:
        answer = (f'    answer = np.clip(z @ W["W_{last}"], -LARGEST, LARGEST)\n'
                  "    return answer - RATE * (seen - held)[:3], memory")  # fmt: skip
    functions = (
        filled(_TEMPLATE, "inputs", seen=seen, held="np.clip(seen, LOW, HIGH)" if bounded else "seen"),
        filled(_TEMPLATE, "sigmoid" if kind in ("lstm", "gru") else "drive"), first,
        filled(_TEMPLATE, "accelerations", layers="".join(layers), answer=answer), filled(_TEMPLATE, "step"),
    )  # fmt: skip
    return "\n\n\n".join(functions)
