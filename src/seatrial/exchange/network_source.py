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
from .plant import ABOUT, one_line, unit_around
from .writing import title, write


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
    lines += ["W = dict(np.load(Path(__file__).with_suffix('.npz')))", "", "", *_inputs(network), "", ""]
    lines += [*_FIRST[network.kind].splitlines(), "", "", *_head(network), "", "", *_STEP.splitlines()]
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
    safe = [line.replace("\\", "/").replace('"', "'") for line in text]
    return [f'"""{safe[0]}', *safe[1:], '"""']


def _inputs(network: Network) -> list[str]:
    out = [
        "def to_body(north, east, psi):",
        '    """A vector in ship axes, forward and to starboard."""',
        "    c, s = np.cos(psi), np.sin(psi)",
        "    return np.array([north * c + east * s, east * c - north * s])", "", "",
        "def inputs(x, u, e=CALM):",
        '    """What the network sees."""',
        "    velocity = np.array(x[3:6], dtype=float)",
        "    velocity[:2] -= to_body(e[2], e[3], x[2])",
    ]  # fmt: skip
    if network.wind:
        out += ["    apparent = to_body(e[0], e[1], x[2]) + x[3:5]", "    seen = np.array([*velocity, *u, *apparent])"]
    else:
        out += ["    seen = np.array([*velocity, *u])"]
    clipped = "np.clip(seen, LOW, HIGH)" if network.limits else "seen"
    return [*out, "    return seen", "", "",
            "def hold(seen):", '    """What the network is shown of it."""', f"    return {clipped}"]  # fmt: skip


def _head(network: Network) -> list[str]:
    n = len(network.layers)
    out = ["def accelerations(seen, memory):", '    """Accelerations of u, v_m, r, and memory of the next sample."""',
           "    held = hold(seen)", "    z, memory = first(held, memory)"]  # fmt: skip
    out += [f'    z = np.tanh(z @ W["W_{k}"] + W["b_{k}"]) - np.tanh(W["b_{k}"])' for k in range(1, n)]
    if network.limits is None:
        return [*out, f'    return z @ W["W_{n}"], memory']
    return [*out, f'    answer = np.clip(z @ W["W_{n}"], -LARGEST, LARGEST)',
            "    return answer - RATE * (seen - held)[:3], memory"]  # fmt: skip


_DRIVE = '''\
def drive(held):
    """The inputs' part of the first layer."""
    return (held / SCALE) @ np.vstack([W[n] for n in ("W_x0", "W_u0", "W_w0") if n in W]) + W["b_0"]
'''
_NO_MEMORY = '''\
def begin(x, u, e=CALM):
    """Nothing: the network has no memory."""
    return ()


def first(held, memory):
    """Output of the first layer, and the memory of the next sample."""
    return np.tanh(drive(held)) - np.tanh(W["b_0"]), memory'''
_FORGETTING = '''\
def begin(x, u, e=CALM):
    """Inputs of the samples before the present one."""
    return (hold(inputs(x, u, e)),) * LOOK_BACK


def first(held, memory):
    """Output of the first layer at the end of a chain from zero, and the memory of the next sample."""
    z = 0.0
    for past in (*memory, held):
        recurrent = z @ W["W_r0"] if np.ndim(z) else 0.0
        z = np.tanh(drive(past) + recurrent) - np.tanh(W["b_0"])
    return z, (*memory, held)[1:]'''
_BEGIN = '''\
def begin(x, u, e=CALM):
    """The latent state after samples that held, from zero."""
    held, memory = hold(inputs(x, u, e)), np.zeros({size})
    for _ in range(LOOK_BACK):
        _, memory = first(held, memory)
    return memory


def first(held, memory):
    """Output of the first layer, and the memory of the next sample."""
'''
_RNN = _BEGIN.format(size='len(W["b_0"])') + '''\
    z = np.tanh(drive(held) + memory @ W["W_r0"]) - np.tanh(W["b_0"])
    return z, z'''
_SIGMOID = '''\
def sigmoid(x):
    return 0.5 + 0.5 * np.tanh(0.5 * x)


'''
_LSTM = _SIGMOID + _BEGIN.format(size='2 * len(W["W_hh"])') + '''\
    z, cell = np.split(memory, 2)
    gates = (held / SCALE) @ W["W_ih"] + W["b_ih"] + z @ W["W_hh"] + W["b_hh"]
    entry, forget, candidate, output = np.split(gates, 4)
    cell = sigmoid(forget) * cell + sigmoid(entry) * np.tanh(candidate)
    z = sigmoid(output) * np.tanh(cell)
    return z, np.concatenate([z, cell])'''
_GRU = _SIGMOID + _BEGIN.format(size='len(W["W_hh"])') + '''\
    from_input = np.split((held / SCALE) @ W["W_ih"] + W["b_ih"], 3)
    from_memory = np.split(memory @ W["W_hh"] + W["b_hh"], 3)
    reset, update = (sigmoid(a + b) for a, b in zip(from_input[:2], from_memory[:2]))
    candidate = np.tanh(from_input[2] + reset * from_memory[2])
    z = (1.0 - update) * candidate + update * memory
    return z, z'''
_FIRST = {"feedforward": f"{_DRIVE}\n\n{_NO_MEMORY}", "forgetting": f"{_DRIVE}\n\n{_FORGETTING}",
          "rnn": f"{_DRIVE}\n\n{_RNN}", "lstm": _LSTM, "gru": _GRU}  # fmt: skip
_STEP = '''\
def step(x, u, e=CALM, memory=None):
    """State after DT seconds by Euler's rule, u and e held, and the memory then; None begins."""
    x = np.array(x, dtype=float)
    memory = begin(x, u, e) if memory is None else memory
    rates, memory = accelerations(inputs(x, u, e), memory)
    psi, turned = x[2], x[2] + DT * x[5]
    c, s = np.cos(psi), np.sin(psi)
    after = x + DT * np.array([x[3] * c - x[4] * s, x[3] * s + x[4] * c, x[5], *rates])
    after[3:5] += to_body(e[2], e[3], turned) - to_body(e[2], e[3], psi)
    return after, memory'''
