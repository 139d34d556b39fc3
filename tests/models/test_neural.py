"""Networks: Wakita 2022 Eqs. 6, 7, 9 and 20-22, their passes, their simulation, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from network_ships import KINDS, LIMITS, SCALE, inputs, network, sailing
from seatrial.core.parameters import ParameterError
from seatrial.data import DataError, Trial
from seatrial.engine.rollout import sensitivity, simulator
from seatrial.environment import CALM, CHANNELS, Environment, Uniform
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES, Sampled, Stepped
from seatrial.models.linear import straight
from seatrial.models.network import Limits, Network, initial
from seatrial.models.network_pass import Pass, accelerations
from seatrial.models.neural import features
from seatrial.ships import ShipError
from seatrial.simulate.loop import closed_loop, loop_memory, loop_values, open_loop, open_loop_parameters
from seatrial.simulate.replay import replay
from seatrial.simulate.run import campaign, simulate
from tiers import slow_but

PAPER: dict[str, Any] = {"layers": (200, 200, 200), "memory": 10}
every_kind = pytest.mark.parametrize("kind", KINDS)
WIND = Uniform(U_T=1.5, gamma_T=0.7)
ZIGZAG = Zigzag(n_P=10.0, delta=0.3, psi=0.3)


def passed(net: Network, x: Any) -> Any:
    """Every answer of the staggered pass, the first sample having held before."""
    through = Pass(net, len(x))
    through.run_in(np.repeat(x[:, :1], net.look_back, axis=1))
    return np.stack([through.step(x[:, k]) for k in range(x.shape[1])], axis=1)


def test_the_papers_network_has_122_600_parameters() -> None:
    """Sawada 2024 Table 1: 7 x 200 + 3 x 200 x 200 + 3 x 200 + 200 x 3."""
    assert network("forgetting", **PAPER).count == 122_600
    assert Network("rnn", (200, 200, 200)).count == 122_600
    drawn = network("forgetting", **PAPER)
    assert sum(array.size for array in drawn.weights.values()) == 122_600
    assert Network("feedforward", (200, 200, 200), wind=False, memory=1).count == 5 * 200 + 2 * 200**2 + 6 * 200


@every_kind
@pytest.mark.parametrize("wind", [True, False])
def test_silent_at_the_origin(kind: str, wind: bool) -> None:
    net = network(kind, wind=wind)
    x = np.zeros((2, 30, net.inputs))
    assert np.abs(accelerations(net, x)).max() == 0
    assert np.abs(passed(net, x)).max() == 0
    assert np.abs(passed(network(kind, (200, 200, 200)), np.zeros((1, 30, 7)))).max() <= 1e-9


@every_kind
def test_the_staggered_pass_is_that_of_the_equations(kind: str) -> None:
    x = inputs(3, 40)
    for form, bar in (((14, 9), 1e-13), ((200, 200, 200), 1e-6)):
        net = network(kind, form, memory=10 if kind == "forgetting" else network(kind).memory)
        said = accelerations(net, x)
        assert np.abs(said).max() > 0
        assert np.abs(passed(net, x) - said).max() <= bar * np.abs(said).max()


@pytest.mark.parametrize("memory", [1, 2, 10])
def test_a_chain_forgets_what_is_older_than_its_memory(memory: int) -> None:
    net, x = network(memory=memory), inputs(1, 40)
    other = x.copy()
    other[:, :20] = 0.0
    a, b = passed(net, x)[0], passed(net, other)[0]
    assert (a[20 + memory - 1 :] == b[20 + memory - 1 :]).all()
    assert (a[20 + memory - 2] != b[20 + memory - 2]).any()


def test_an_unlimited_memory_does_not_forget() -> None:
    net, x = network("rnn"), inputs(1, 40)
    other = x.copy()
    other[:, :20] = 0.0
    assert np.abs(accelerations(net, x)[0, 25] - accelerations(net, other)[0, 25]).max() > 0


@pytest.mark.long
def test_equal_to_eq_9_and_eq_7_in_pytorch() -> None:
    """Chain by chain as printed, at the paper's size, in the precision in which a network is trained: 1e-6."""
    torch = pytest.importorskip("torch")
    torch.set_num_threads(1)
    x = inputs(1, 60)
    for kind, memory in (("forgetting", 10), ("rnn", 0)):
        net = network(kind, (200, 200, 200), gain=1.0, memory=memory)
        w = {name: torch.tensor(np.array(array), dtype=torch.float32) for name, array in net.weights.items()}
        seen = torch.tensor(x[0] / np.array(SCALE), dtype=torch.float32)

        def first(at: int, z: Any, w: Any = w, seen: Any = seen) -> Any:
            v, u, wind = seen[at, :3], seen[at, 3:5], seen[at, 5:]
            z = v @ w["W_x0"] + u @ w["W_u0"] + wind @ w["W_w0"] + z @ w["W_r0"] + w["b_0"]
            return torch.tanh(z) - torch.tanh(w["b_0"])

        said, rest = [], torch.zeros(200)
        for _ in range(9):
            rest = first(0, rest)  # unlimited memory: the first sample held for 1 s
        for i in range(60):
            z = torch.zeros(200)
            for at in range(i - 9, i + 1):
                z = first(max(at, 0), z)
            if kind == "rnn":
                z = rest = first(i, rest)
            for k in (1, 2):
                z = torch.tanh(z @ w[f"W_{k}"] + w[f"b_{k}"]) - torch.tanh(w[f"b_{k}"])
            said.append((z @ w["W_3"]).numpy())
        assert np.abs(passed(net, x)[0] - np.array(said)).max() <= 1e-6


@pytest.mark.long
@pytest.mark.parametrize("kind", ["lstm", "gru"])
def test_gated_networks_are_those_of_pytorch(kind: str) -> None:
    torch = pytest.importorskip("torch")
    torch.set_num_threads(1)
    net, x = network(kind), inputs(2, 30)
    cell = getattr(torch.nn, kind.upper())(7, 14, batch_first=True, dtype=torch.float64)
    pairs = {"weight_ih_l0": "W_ih", "weight_hh_l0": "W_hh", "bias_ih_l0": "b_ih", "bias_hh_l0": "b_hh"}
    cell.load_state_dict({theirs: torch.tensor(net.weights[ours].T.copy()) for theirs, ours in pairs.items()})
    held = np.concatenate([np.repeat(x[:, :1], net.look_back, axis=1), x], axis=1) / np.array(SCALE)
    with torch.no_grad():
        z = cell(torch.tensor(held))[0].numpy()[:, net.look_back :]
    w = net.weights
    said = (np.tanh(z @ w["W_1"] + w["b_1"]) - np.tanh(w["b_1"])) @ w["W_2"]
    assert np.abs(passed(net, x) - said).max() <= 1e-13


def test_what_it_sees() -> None:
    """Wakita 2022 Eq. 6: the apparent wind of the velocities over ground; all else through the water."""
    net = network()
    state = np.array([[3.0, -2.0, 0.4, 0.5, -0.1, 0.02]])
    U_T, gamma_T, current = 2.0, 1.1, (0.05, -0.03)
    around = Environment(U_T * math.cos(gamma_T), U_T * math.sin(gamma_T), *current)
    seen = features(net, state, np.array([[8.0, 0.3, *around]]))[0]
    u_A = U_T * math.cos(gamma_T - 0.4) + 0.5
    v_A = U_T * math.sin(gamma_T - 0.4) - 0.1
    u_C = current[0] * math.cos(0.4) + current[1] * math.sin(0.4)
    v_C = current[1] * math.cos(0.4) - current[0] * math.sin(0.4)
    assert seen == pytest.approx([0.5 - u_C, -0.1 - v_C, 0.02, 8.0, 0.3, u_A, v_A], abs=1e-14)


@every_kind
def test_simulated_by_eulers_rule_and_alike_on_scalars(kind: str) -> None:
    """The engine on arrays against `advance` on floats and Wakita 2022 Eqs. 20-22, sample by sample."""
    ship = sailing(network(kind))
    model: Any = ship.model
    assert isinstance(model, Sampled)
    assert isinstance(model, Stepped)
    steps, around = 40, WIND.now()
    series = np.array([[[10 + k % 7, 0.3 * math.sin(0.2 * k), *around] for k in range(steps)]])
    start = (1.0, 2.0, 0.3, 0.4, 0.02, -0.01)
    memory = np.array([model.begin(start, (10.0, 0.0))])
    assert memory.shape == (1, len(model.memory))
    run = simulator(open_loop(ship)).run(
        np.array([start]), series, open_loop_parameters(ship), memory0=memory, dt=0.1, steps=steps)  # fmt: skip
    state, remembered = np.array(start), tuple(memory[0])
    for k in range(steps):
        assert run.values[0, k] == pytest.approx(state, abs=1e-13)
        control = tuple(series[0, k, :2])
        rates, remembered = model.advance(tuple(state), control, around, remembered)
        _, _, psi, u, v, r = state
        c, s = math.cos(psi), math.sin(psi)
        state = state + 0.1 * np.array([u * c - v * s, u * s + v * c, r, *rates])
    assert np.abs(state[3:] - start[3:]).max() > 1e-3


@pytest.mark.parametrize("kind", slow_but(KINDS, "feedforward", "rnn"))
def test_a_restart_remembers_what_was_measured_before_it(kind: str) -> None:
    """A run that the network made itself is predicted to rounding from any of its rows, unlimited memory aside."""
    ship = sailing(network(kind))
    trial = simulate(ship, ZIGZAG, speed=0.4, duration=30.0, environment=WIND)
    again = replay(ship, trial, restart=7.0)
    error = max(np.abs(again[name] - trial[name]).max() for name in STATES)
    assert error <= (1e-12 if kind in ("feedforward", "forgetting") else 1e-2)
    assert replay(ship, trial)["r"] == pytest.approx(trial["r"], abs=1e-12)


def test_a_start_with_less_than_its_memory_before_it() -> None:
    """Rows that are missing are as the first that is known; a gap before a start is the end of what is known."""
    ship = sailing(network(memory=8))
    trial = simulate(ship, ZIGZAG, speed=0.4, duration=20.0, environment=WIND)
    u = trial["u"].copy()
    u[95] = np.nan
    model: Any = ship.model
    found = replay(ship, trial.having(u=u), restart=10.0)
    acting = np.array([[trial["n_P"][k], trial["delta"][k], *WIND.now()] for k in range(96, 100)])
    known = model.recall_memory(trial.stack(*STATES)[96:100], acting)
    one = simulator(open_loop(ship)).run(
        trial.stack(*STATES)[100:101], np.array([[trial["n_P"][100], trial["delta"][100], *WIND.now()]])[:, None],
        open_loop_parameters(ship), memory0=np.array([known]), dt=0.1, steps=2)  # fmt: skip
    assert found["r"][101] == pytest.approx(one.values[0, 1, 5], abs=1e-14)
    assert len(known) == 1 + 7 * 7
    assert known[1:8] == known[8:15] == known[22:29]


@pytest.mark.slow
def test_lanes_do_not_know_of_each_other() -> None:
    ship = sailing(network())
    trial = simulate(ship, ZIGZAG, speed=0.4, duration=40.0)
    for restart in (3.0, 9.0):
        many = replay(ship, trial, restart=restart)
        k = round(restart / 0.1)
        alone = replay(ship, Trial("a", trial.t[:k], {n: c[:k] for n, c in trial.channels.items()}, meta=trial.meta))
        assert many["r"][:k] == pytest.approx(alone["r"], abs=1e-13)


@pytest.mark.slow
def test_a_campaign_in_a_closed_loop() -> None:
    """What the policy remembers is handed through lane by lane, beside what the network remembers."""
    ship = sailing(network())
    angles = np.array([0.1, 0.2, 0.3])
    run = campaign(ship, ZIGZAG, {"policy.delta": angles}, speed=0.4, duration=20.0, environment=WIND)
    for lane, angle in enumerate(angles):
        alone = simulate(ship, replace(ZIGZAG, delta=angle), speed=0.4, duration=20.0, environment=WIND)
        assert run.values[lane, :, 5] == pytest.approx(alone["r"], abs=1e-12)
    system = closed_loop(ship, ZIGZAG, 0.1)
    values = loop_values(ship, ZIGZAG)
    assert len(loop_memory(ship, ZIGZAG, 0.1, values, (0.0,) * 6)) == len(system.memory) + len(system.hidden)


def random_runs(net: Network, lanes: int, seconds: float) -> Any:
    """Velocities after random controls from random states."""
    ship, rng = sailing(net), np.random.default_rng(0)
    steps = round(seconds / 0.1)
    holds = rng.uniform(-1, 1, (lanes, steps // 50 + 1, 2 + len(CHANNELS))) * [20, 0.7, 4, 4, *([0] * 6)]
    start = rng.uniform(-1, 1, (lanes, 6)) * [5, 5, 3, 0.6, 0.3, 0.15]
    memory = np.zeros((lanes, len(ship.model.memory)))  # type: ignore[attr-defined]
    run = simulator(open_loop(ship)).run(
        start, np.repeat(holds, 50, axis=1), open_loop_parameters(ship), memory0=memory, dt=0.1, steps=steps, every=10
    )
    return run.values[:, :, 3:]


@pytest.mark.parametrize("kind", slow_but(["forgetting", "rnn"], "rnn"))
@pytest.mark.parametrize(("lanes", "seconds"), [(30, 60.0), pytest.param(1000, 300.0, marks=pytest.mark.long)])
def test_bounded_under_any_control(kind: str, lanes: int, seconds: float) -> None:
    """However wild the weights: no velocity leaves its range by more than acceleration / rate."""
    bound = np.array(LIMITS.high[:3]) + np.array(LIMITS.acceleration) / LIMITS.rate
    wild = random_runs(network(kind, gain=20.0, limits=LIMITS), lanes, seconds)
    assert (np.abs(wild) <= bound + 1e-12).all()
    assert np.abs(wild).max() > 0.5
    free = random_runs(network(kind, gain=20.0), 5, 60.0)
    assert not np.isfinite(free).all() or np.abs(free).max() > 10  # without limits, nothing holds it


@pytest.mark.slow
def test_at_rest_it_stays_at_rest() -> None:
    for net in (network(limits=LIMITS), network("lstm"), network("forgetting", **PAPER)):
        ship = sailing(net)
        run = simulator(open_loop(ship)).run(
            np.zeros((1, 6)), np.zeros((1, 1, 10)), open_loop_parameters(ship), dt=0.1, steps=600,
            memory0=np.zeros((1, len(ship.model.memory))))  # type: ignore[attr-defined]  # fmt: skip
        assert np.abs(run.values).max() <= 1e-9


def test_limits_change_nothing_within_them() -> None:
    """In the range of usual inputs a bounded network answers as the free one."""
    x = 0.1 * inputs(2, 30)
    assert (passed(network(limits=LIMITS), x) == passed(network(), x)).all()


@pytest.mark.slow
def test_a_network_refuses_symbols() -> None:
    ship = sailing(network())
    count = ship.model.network.count  # type: ignore[attr-defined]
    with pytest.raises(ParameterError, match=f"{count} weights"):
        straight(ship.model, 0.4)
    with pytest.raises(ParameterError, match="no symbolic right-hand side"):
        sensitivity(open_loop(ship), ())


@pytest.mark.slow
def test_trials_that_it_cannot_predict() -> None:
    ship = sailing(network(memory=8))
    trial = simulate(ship, ZIGZAG, speed=0.4, duration=20.0, environment=WIND)
    bare = Trial("bare", trial.t, {n: trial[n] for n in (*STATES, "n_P", "delta")}, meta={})
    with pytest.raises(DataError, match=r"^bare: .*U_T, gamma_T"):
        replay(ship, bare)
    assert len(replay(sailing(network(wind=False)), bare)) == len(bare)
    every = Trial("slow", 2 * trial.t, trial.channels, meta=trial.meta)
    with pytest.raises(DataError, match=r"0.2 s; net\b.*--dt 0.1"):
        replay(ship, every)
    short = Trial("short", trial.t[:8], {n: c[:8] for n, c in trial.channels.items()}, meta=trial.meta)
    with pytest.raises(DataError, match=r"^short: 8 rows\b.*\bneeds 9"):
        replay(ship, short)


@pytest.mark.slow
def test_a_calm_run_of_the_simulator_is_known_to_be_calm() -> None:
    ship = sailing(network())
    trial = simulate(ship, ZIGZAG, speed=0.4, duration=20.0)
    assert "U_T" not in trial
    assert replay(ship, trial)["u"] == pytest.approx(trial["u"], abs=1e-12)


def test_without_weights_it_says_so() -> None:
    ship = sailing(Network("forgetting", (8,), memory=3))
    with pytest.raises(ParameterError, match="untrained; train it"):
        ship.model.advance((0.0,) * 6, (0.0, 0.0), CALM, (0.0,) * 15)  # type: ignore[attr-defined]
    with pytest.raises(ShipError, match=r"its own step of 0\.1 s only"):
        simulate(ship, ZIGZAG, duration=10.0, dt=0.05)


@pytest.mark.parametrize(
    ("form", "text"),
    [
        ({"kind": "transformer"}, "no kind of network 'transformer'; known: feedforward, rnn"),
        ({"layers": ()}, "layers are"),
        ({"memory": 0}, "memory is 0 samples; a network of kind 'forgetting' takes 1 or more"),
        ({"kind": "rnn", "memory": 3}, "kind 'rnn' takes 0"),
        ({"scale": (1.0, 1.0)}, "scale has 2 values; 7 inputs"),
        ({"wind": False, "limits": LIMITS, "scale": ()}, "limits are of 7 inputs; the network has 5"),
        ({"weights": {"W_x0": np.zeros((3, 14))}}, "the weights lack W_u0"),
    ],
)
def test_forms_that_cannot_be(form: dict[str, Any], text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        Network(**({"kind": "forgetting", "layers": (14, 9), "memory": 5} | form))


def test_weights_that_do_not_fit() -> None:
    net = network()
    for change, text in (
        ({"W_r0": np.zeros((3, 3))}, r"W_r0 has shape \(3, 3\); \[14, 9\] layers need \(14, 14\)"),
        ({"b_0": np.full(14, np.nan)}, "b_0 holds a value that is not finite"),
        ({"W_9": np.zeros(3)}, "the weights have an array W_9"),
    ):
        with pytest.raises(ParameterError, match=text):
            net.having({**net.weights, **change})
    gated = network("gru")
    with pytest.raises(ParameterError, match="b_ih: the candidate has a bias"):
        gated.having({**gated.weights, "b_ih": np.ones(42)})
    with pytest.raises(ParameterError, match="low < 0 < high"):
        Limits((0.1,) * 7, (1.0,) * 7, (1.0,) * 3)
    with pytest.raises(ParameterError, match="three values above zero"):
        Limits((-1.0,) * 7, (1.0,) * 7, (1.0,))


def test_the_draw_and_the_digest_depend_on_what_they_are_of() -> None:
    form = Network("forgetting", (14, 9), memory=5)
    assert initial(form, 3) == initial(form, 3)
    assert initial(form, 3) != initial(form, 4)
    assert initial(form, 3).digest != initial(form, 4).digest
    assert hash(initial(form, 3)) == hash(initial(form, 3))
    with pytest.raises(ValueError, match="read-only"):
        initial(form, 3).weights["b_0"][0] = 1.0
