"""A step of training of the network of Wakita 2022 (Eq. 9, 122 600 weights, batch 512), folded and as printed.

All in one run: the rate of a matrix product, the equations as printed, differentiated by PyTorch, and the step of
the package.  With a GPU, its step too.

    python benchmarks/training.py                      the table of docs/benchmarks.md
    python benchmarks/training.py --ways               every kind of network, at the paper's size and a small one
    python benchmarks/training.py --ways --beside SRC  the same with the package of another checkout (its src folder)
    python benchmarks/training.py --ways --compile     the same with torch.compile, which takes minutes a kind

`--ways` writes results/training_ways.json, with --compile results/training_compiled.json.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from timing import best, control_loop, machine, publish

import seatrial
from seatrial.identify.networks.data import Batch, fold
from seatrial.identify.networks.engine import Engine, Form, literal_losses, one_thread_each
from seatrial.models.network import Network, initial

WINDOWS, ROWS, MEMORY, WIDTH = 512, 60, 10, 200
SCALE = (0.3, 0.1, 0.05, 10.0, 0.5, 1.0, 1.0)
NETWORK = initial(Network("forgetting", (WIDTH,) * 3, memory=MEMORY, scale=SCALE), 0)
# Products of a step forward: m - 1 in the memory and two behind it, for each simulated row; thrice with the way back.
WORK = 3 * (ROWS - MEMORY) * (MEMORY - 1 + 2) * 2 * WINDOWS * WIDTH**2


COMMANDS = {"training_ways": "--beside SRC (of 538fc01)", "training_compiled": "--compile"}


class Case(NamedTuple):
    """A network and its loss: kind, share of the acceleration loss, units of each layer."""

    kind: str
    acceleration: float
    layers: tuple[int, ...]

    @property
    def form(self) -> Form:
        """What the engine is given."""
        memory = {"forgetting": MEMORY, "feedforward": 1}.get(self.kind, 0)
        network = initial(Network(self.kind, self.layers, memory=memory, scale=SCALE), 0)
        return Form(network, memory or MEMORY, self.acceleration)

    @property
    def text(self) -> str:
        """For the table."""
        return f"{self.kind}, {'acceleration' if self.acceleration else 'state'} loss, {list(self.layers)}"


CASES = [
    Case(kind, acceleration, layers) for layers in ((WIDTH,) * 3, (64,) * 3, (24,) * 2)
    for kind, acceleration in (("forgetting", 0.0), ("rnn", 0.0), ("forgetting", 1.0), ("feedforward", 0.0),
                               ("lstm", 0.0), ("gru", 0.0))
] + [Case(kind, 1.0, (WIDTH,) * 3) for kind in ("rnn", "lstm", "gru")]  # fmt: skip


def windows(device: str, count: int = WINDOWS) -> Batch:
    """Windows of the length of the paper's, of noise."""
    rng = np.random.default_rng(0)

    def made(scale: float, *shape: int) -> Any:
        return torch.tensor(scale * rng.normal(size=shape), dtype=torch.float32, device=device)

    size = (ROWS, count)
    return Batch(
        made(0.2, *size, 6), made(0.5, *size, 2), made(1.0, *size, 2), made(0.01, *size, 3), made(1.0, 9).abs(), 0.1
    )


def begun(form: Form, engine: Engine) -> Any:
    """The vector of weights at the beginning."""
    return torch.tensor(engine.vector.exact(form.network.weights), dtype=torch.float32, device=engine.device)


def package(form: Form, device: str = "cpu", threads: int = 1, count: int = WINDOWS) -> Callable[[], Any]:
    """A job: loss and gradient of a batch as the package computes them."""
    engine, batch = Engine(form, device, threads), windows(device, count)
    theta = begun(form, engine)

    def job() -> Any:
        found = engine.losses(theta, batch)
        if device == "cuda":
            torch.cuda.synchronize()
        return found[1]

    return job


def differentiated(form: Form, losses: Callable[..., Any], folded: bool, count: int = WINDOWS) -> Callable[[], Any]:
    """A job: the same by a function of the weights that PyTorch differentiates, in pieces as the package has them."""
    engine, batch = Engine(form, "cpu", 1), windows("cpu", count)
    theta, pieces = begun(form, engine), [batch.part(slice(k, k + 256)) for k in range(0, count, 256)]
    network = form.network

    def job() -> Any:
        out = torch.zeros_like(theta)
        for piece in pieces:
            own = theta.detach().requires_grad_()
            weights = engine.vector.tensors(own)
            given = (fold(weights, engine.scale),) if folded else (weights, engine.scale)
            form_of = {} if folded else {"kind": network.kind}
            found = losses(
                *given, piece, memory=network.memory, known=form.known, simulate=not form.acceleration, **form_of
            )
            out += torch.autograd.grad(found.sum(), own)[0]
        return out / count

    return job


def kernel_losses(
    weights: dict[str, Any], scale: Any, batch: Batch, *, kind: str, memory: int, known: int, simulate: bool
) -> Any:
    """The acceleration loss (Eq. 16) by the kernels of nn.RNN, nn.LSTM and nn.GRU, which need all inputs beforehand."""
    from seatrial.identify.networks.data import input_matrix
    from seatrial.identify.networks.engine import _head, _inputs

    if simulate:
        raise ValueError("inputs of a simulation are not known beforehand")
    shown = torch.stack([_inputs(state, batch, i) for i, state in enumerate(batch.state[:-1])])
    if memory:  # every chain is a sequence of its own
        shown = shown.unfold(0, memory, 1).permute(3, 0, 1, 2).reshape(memory, -1, shown.shape[-1])
    if kind in ("lstm", "gru"):
        matrices = [input_matrix(weights, scale).t(), weights["W_hh"].t(), weights["b_ih"], weights["b_hh"]]
        nothing = shown.new_zeros(1, shown.shape[1], len(weights["W_hh"]))
        begun, run = ((nothing, nothing), torch.lstm) if kind == "lstm" else (nothing, torch.gru)
        out, rest = run(shown, begun, [a.contiguous() for a in matrices], True, 1, 0.0, True, False, False)[0], 0.0
    else:  # its z is tanh(b) more than ours
        rest = weights["b_0"].tanh()
        matrices = [input_matrix(weights, scale).t(), weights["W_r0"].t(), weights["b_0"], -rest @ weights["W_r0"]]
        begun = rest.expand(1, shown.shape[1], -1).contiguous()
        flat = [a.contiguous() for a in matrices]
        out = torch.rnn_tanh(shown, begun, flat, True, 1, 0.0, True, False, False)[0]
    ended = out[-1].view(-1, batch.state.shape[1], out.shape[-1]) if memory else out[known - 1 :]
    error = (_head(weights)(ended - rest) - batch.acceleration[known - 1 : -1]) * batch.weight[6:]
    return error.square().sum((0, 1)) / len(error)


def product() -> Any:
    """A job: the product of two large matrices."""
    a, out = torch.randn(2048, 2048), torch.empty(2048, 2048)
    return lambda: torch.mm(a, a, out=out)


def used(job: Callable[[], Any]) -> float:
    """Processor time of a run [s], which a busy machine lengthens little."""
    start = time.process_time()
    job()
    return time.process_time() - start


def spent(job: Callable[[], Any], times: int) -> float:
    """Least of repeated runs."""
    job()
    return min(used(job) for _ in range(times))


class Other:
    """The package of a checkout, which takes its turn in a process of its own."""

    def __init__(self, source: Path, case: int) -> None:
        environment = {**os.environ, "PYTHONPATH": str(source)}
        command = [sys.executable, __file__, "--turn", str(case)]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, bufsize=1, env=environment)

    def turn(self) -> float:
        """Processor time of one run."""
        ask: Any = self.process.stdin
        answer: Any = self.process.stdout
        ask.write("\n")
        return float(answer.readline())

    def close(self) -> None:
        """End it."""
        self.process.communicate()


def take_turns(case: int) -> None:
    """What `Other` runs: a step for every line read."""
    with one_thread_each():
        job = package(CASES[case].form)
        for _ in sys.stdin:
            print(used(job), flush=True)


def ways(beside: Path | None, cases: list[int], times: int) -> None:
    """Every case: the package, the equations as printed, another checkout; turn by turn, on one processor."""
    rows: list[dict[str, Any]] = []
    for k in cases:
        case = CASES[k]
        own, printed = package(case.form), differentiated(case.form, literal_losses, folded=False)
        others = {"package": Other(Path(seatrial.__file__).parents[1], k)}  # alone, as the memory of others slows it
        if beside is not None:
            others["beside"] = Other(beside, k)
        turns: dict[str, Callable[[], float]] = {name: other.turn for name, other in others.items()}
        turns["printed"] = lambda: used(printed)  # noqa: B023
        if case.acceleration:
            kernel = differentiated(case.form, kernel_losses, folded=False)
            turns["kernel"] = lambda: used(kernel)  # noqa: B023
        found = least(turns, times)
        for other in others.values():
            other.close()
        a, b = own(), printed()
        add(rows, {"case": case.text, **found, "difference": float((a - b).norm() / b.norm())})
        written("training_ways", rows)


def compiled(modes: list[str], cases: list[int], times: int) -> None:
    """The package's equations (LSTM, GRU: as printed) by torch.compile, cold; each in a process of its own."""
    rows: list[dict[str, Any]] = []
    for k in cases:
        for mode in modes:
            with tempfile.TemporaryDirectory() as cache:
                environment = {**os.environ, "TORCHINDUCTOR_CACHE_DIR": cache}
                command = [sys.executable, __file__, "--one", str(k), mode, str(times)]
                done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
            if done.returncode:
                last = done.stderr.strip().splitlines()[-1]
                add(rows, {"case": CASES[k].text, "mode": mode, "failed": last})
            else:
                add(rows, json.loads(done.stdout.splitlines()[-1]))
            written("training_compiled", rows)  # each takes minutes


def compiled_once(k: int, mode: str, times: int) -> None:
    """One way of `compiled`: what the first step costs, then steps beside the package."""
    from seatrial.identify.networks.engine import folded_losses

    case, folded = CASES[k], CASES[k].form.folds
    with one_thread_each():
        own = package(case.form, count=256)
        losses = torch.compile(folded_losses if folded else literal_losses, mode=mode)
        job = differentiated(case.form, losses, folded, count=256)
        start, of = time.perf_counter(), used(job)
        first = time.perf_counter() - start
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        turns = {"package": lambda: used(own), "compiled": lambda: used(job)}
        found = least(turns, times)
        a, b = job(), own()
    print(json.dumps({
        "case": case.text, "mode": mode, "windows": 256, **found, "first_step_wall_s": first,
        "first_step_processor_s": of + children.ru_utime + children.ru_stime,
        "difference": float((a - b).norm() / b.norm()),
    }))  # fmt: skip


def least(turns: dict[str, Callable[[], float]], times: int) -> dict[str, float]:
    """Least time [s] of each, turn by turn, and each over the package."""
    with one_thread_each():
        for turn in turns.values():
            turn()
        found = {name: [turn()] for name, turn in turns.items()}
        for _ in range(times - 1):
            for name, turn in turns.items():
                found[name].append(turn())
    out = {f"{name}_s": min(each) for name, each in found.items()}
    ratios = {f"{name}_over_package": out[f"{name}_s"] / out["package_s"] for name in turns if name != "package"}
    return {**out, **ratios, "control_loop_ms": control_loop()}


def add(rows: list[dict[str, Any]], row: dict[str, Any]) -> None:
    """Keep and print a row."""
    rows.append(row)
    print({name: float(f"{x:.4g}") if isinstance(x, float) else x for name, x in row.items()}, flush=True)


def written(name: str, rows: list[dict[str, Any]]) -> None:
    """Write results/<name>.json; rows of other cases in it stay."""
    path, new = Path(__file__).parent / "results" / f"{name}.json", {row["case"] for row in rows}
    kept = [row for row in json.loads(path.read_text())["rows"] if row["case"] not in new] if path.exists() else []
    order = [case.text for case in CASES]
    every = sorted(kept + rows, key=lambda row: order.index(row["case"]))
    command = f"python benchmarks/training.py --ways {COMMANDS[name]}"
    out = {"machine": machine(), "torch": torch.__version__, "command": command, "rows": every}
    path.write_text(json.dumps(out, indent=1) + "\n")


def table() -> None:
    """Measure on one processor, then the step on all, and publish."""
    form = Form(NETWORK, MEMORY, 0.0)
    jobs = {"package": package(form), "printed": differentiated(form, literal_losses, folded=False)}
    with one_thread_each():
        work = spent(product(), 10)
        found = least({name: lambda job=job: used(job) for name, job in jobs.items()}, 5)
        together = best(package(form, threads=len(os.sched_getaffinity(0))), 3.0, 5)
    rate, literal, own = 2 * 2048**3 / work, found["printed_s"], found["package_s"]
    rows = [
        {"what": "matrix product on one processor, 2048 x 2048, float32", "value": rate / 1e9, "unit": "GFLOP/s",
         "bar": ""},
        {"what": "a step of the printed equations by PyTorch, processor time on one", "value": literal, "unit": "s",
         "bar": ""},
        {"what": "a step of the package, processor time on one", "value": own, "unit": "s", "bar": "the line above"},
        {"what": "printed equations over the package", "value": literal / own, "unit": "", "bar": "1"},
        {"what": "share of the rate of a matrix product", "value": WORK / own / rate, "unit": "", "bar": "0.8"},
        {"what": "a step of the package on all processors, wall time", "value": together, "unit": "s", "bar": ""},
    ]
    if torch.cuda.is_available():
        there = best(package(form, device="cuda"), 3.0, 5)
        rows.append({"what": f"a step on {torch.cuda.get_device_name()}", "value": there, "unit": "s", "bar": ""})
        rows.append({"what": "step rate of the GPU over all processors", "value": together / there, "unit": "",
                     "bar": "20"})
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    rows.append({"what": "largest memory of the process", "value": peak, "unit": "MB", "bar": ""})
    publish("training", rows)


def main() -> None:
    """Do what the arguments ask for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ways", action="store_true")
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--compile", action="store_true")
    parser.add_argument("--modes", nargs="+", default=["default", "max-autotune-no-cudagraphs"])
    parser.add_argument("--cases", nargs="+", type=int, help="numbers in the order of the table, from 0")
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--turn", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.turn is not None:
        take_turns(asked.turn)
    elif asked.one:
        compiled_once(int(asked.one[0]), asked.one[1], int(asked.one[2]))
    elif asked.compile:
        compiled(asked.modes, asked.cases or [0, 1], asked.times)
    elif asked.ways:
        ways(asked.beside, asked.cases or list(range(len(CASES))), asked.times)
    else:
        table()


if __name__ == "__main__":
    main()
