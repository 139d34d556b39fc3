"""A network as C: its weights, its memory and one sample of it, for a co-simulation slave that needs no Python."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...models.network import Network, recurrent
from ...models.network_pass import prepared
from ...models.neural import Neural
from ..c_source import C

HEAD = ("void ship_sample(const double x[], const double u[], const double e[], const double m[], double dx[],\n"
        "                 double m_next[])")  # fmt: skip
_A_LINE = 5


def channels_of(network: Network) -> set[str]:
    """Channels of the environment that a ship with this network feels."""
    return {"current_x", "current_y", *(("wind_x", "wind_y") if network.wind else ())}


def network_c(model: Neural) -> list[str]:
    """`ship_sample` and what it calls: rates that hold over one sample, and the memory of the next."""
    network = model.network
    weights = prepared(network, np.float64)
    kept = ["W_x", *(n for n in ("W_r0", "W_hh", "b_0", "b_ih", "b_hh") if n in weights)]
    kept += [name for k in range(1, len(network.layers) + 1) for name in (f"W_{k}", f"b_{k}") if name in weights]
    lines = [f"/* A network of kind {network.kind}: {network.count} weights. */",
             f"enum {{ INPUTS = {network.inputs}, H = {network.layers[0]}, WIDEST = {max(network.layers)}, "
             f"LOOK_BACK = {network.look_back} }};", ""]  # fmt: skip
    for name in kept:
        lines += _table(f"{name}[{weights[name].size}]", weights[name].ravel().tolist())
    lines += ["", *_HELP.splitlines(), "", *_bounds(network), ""]
    lines += [*_FIRST[network.kind].splitlines(), "", *_sample(network, float(model.dt)), ""]
    return lines


def _table(head: str, values: Iterable[float]) -> list[str]:
    told = [C.constant(float(v)) for v in values]
    rows = [", ".join(told[k : k + _A_LINE]) for k in range(0, len(told), _A_LINE)]
    return [f"static const double {head} = {{", *(f"    {row}," for row in rows), "};"]


def _bounds(network: Network) -> list[str]:
    """What the network is shown of what is seen, and what is made of its answer."""
    on = network.limits
    if on is None:
        return ["static void hold(double seen[]) { (void)seen; }", "",
                "static void bound(double answer[], const double seen[], const double held[])",
                "{", "    (void)answer; (void)seen; (void)held;", "}"]  # fmt: skip
    return [
        *_table("LOW[INPUTS]", on.low), *_table("HIGH[INPUTS]", on.high), *_table("LARGEST[3]", on.acceleration), "",
        "static double within(double x, double low, double high) { return x < low ? low : x > high ? high : x; }", "",
        "static void hold(double seen[])", "{", "    int i;",
        "    for (i = 0; i < INPUTS; i++) seen[i] = within(seen[i], LOW[i], HIGH[i]);", "}", "",
        "/* What a velocity exceeds its range by decays. */",
        "static void bound(double answer[], const double seen[], const double held[])", "{", "    int i;",
        "    for (i = 0; i < 3; i++)",
        f"        answer[i] = within(answer[i], -LARGEST[i], LARGEST[i]) - {on.rate!r} * (seen[i] - held[i]);", "}",
    ]  # fmt: skip


def _sample(network: Network, dt: float) -> list[str]:
    wind = ["    seen[5] = e[0] * c + e[1] * s + x[3];", "    seen[6] = e[1] * c - e[0] * s + x[4];"]
    head: list[str] = []
    here, there = "z", "y"
    for k, (a, b) in enumerate(zip(network.layers, network.layers[1:], strict=False), 1):
        head += [f"    for (i = 0; i < {b}; i++) {there}[i] = b_{k}[i];",
                 f"    product({here}, W_{k}, {a}, {b}, {there});", f"    bend({there}, b_{k}, {b});"]  # fmt: skip
        here, there = there, here
    last = len(network.layers)
    memory = [] if network.kind != "feedforward" else ["    (void)m; (void)m_next;"]
    return [
        HEAD, "{", "    const double c = cos(x[2]), s = sin(x[2]), turned = x[2] + DT * x[5];".replace("DT", repr(dt)),
        "    const double u_C = e[2] * c + e[3] * s, v_C = e[3] * c - e[2] * s;",
        "    const double u_after = e[2] * cos(turned) + e[3] * sin(turned);",
        "    const double v_after = e[3] * cos(turned) - e[2] * sin(turned);",
        "    double seen[INPUTS], held[INPUTS], z[WIDEST], y[WIDEST], answer[3] = {0.0, 0.0, 0.0};", "    int i;",
        "    (void)y;", *memory,
        "    seen[0] = x[3] - u_C;", "    seen[1] = x[4] - v_C;", "    seen[2] = x[5];", "    seen[3] = u[0];",
        "    seen[4] = u[1];", *(wind if network.wind else ()),
        "    for (i = 0; i < INPUTS; i++) held[i] = seen[i];", "    hold(held);",
        "    first(held, m, m_next, z);", *head,
        f"    product({here}, W_{last}, {network.layers[-1]}, 3, answer);", "    bound(answer, seen, held);",
        "    dx[0] = x[3] * c - x[4] * s;", "    dx[1] = x[3] * s + x[4] * c;", "    dx[2] = x[5];",
        "    for (i = 0; i < 3; i++) dx[3 + i] = answer[i];",
        "    /* What a current seems to do as the ship turns in it. */",
        f"    dx[3] += (u_after - u_C) / {dt!r};", f"    dx[4] += (v_after - v_C) / {dt!r};", "}",
    ]  # fmt: skip


def memory_of(network: Network) -> int:
    """Numbers of the memory: whether it has begun, then the latent state or earlier inputs."""
    if network.kind == "feedforward":
        return 0
    if recurrent(network.kind):
        return 1 + network.layers[0] * (2 if network.kind == "lstm" else 1)
    return 1 + network.look_back * network.inputs


_HELP = """\
/* y += x W, a row of W per element of x. */
static void product(const double* x, const double* W, int n, int h, double* restrict y)
{
    int i, j;
    for (i = 0; i < n; i++) for (j = 0; j < h; j++) y[j] += x[i] * W[i * h + j];
}

/* y becomes tanh(y) - tanh(b): zero at the origin. */
static void bend(double y[], const double b[], int h)
{
    int j;
    for (j = 0; j < h; j++) y[j] = tanh(y[j]) - tanh(b[j]);
}"""
_PLAIN = """\
static void first(const double held[], const double m[], double m_next[], double z[])
{
    int j;
    (void)m; (void)m_next;
    for (j = 0; j < H; j++) z[j] = b_0[j];
    product(held, W_x, INPUTS, H, z);
    bend(z, b_0, H);
}"""
_CHAIN = """\
/* The end of a chain from zero over the inputs remembered, the oldest first, and these. */
static void first(const double held[], const double m[], double m_next[], double z[])
{
    double before[H], y[H];
    const double* past;
    int i, j, k;
    for (k = 0; k <= LOOK_BACK; k++) {
        past = k < LOOK_BACK && m[0] > 0.0 ? m + 1 + k * INPUTS : held;
        for (j = 0; j < H; j++) y[j] = b_0[j];
        product(past, W_x, INPUTS, H, y);
        if (k > 0) product(before, W_r0, H, H, y);
        bend(y, b_0, H);
        for (j = 0; j < H; j++) before[j] = y[j];
        if (k > 0) for (i = 0; i < INPUTS; i++) m_next[1 + (k - 1) * INPUTS + i] = past[i];
    }
    for (i = 0; i < INPUTS && LOOK_BACK > 0; i++) m_next[1 + (LOOK_BACK - 1) * INPUTS + i] = held[i];
    m_next[0] = 1.0;
    for (j = 0; j < H; j++) z[j] = before[j];
}"""
_REMEMBER = """

/* From the latent state remembered, or what samples like this one leave of zero. */
static void first(const double held[], const double m[], double m_next[], double z[])
{
    const int n = NM - 1;
    int j, k;
    for (j = 0; j < n; j++) m_next[1 + j] = m[0] > 0.0 ? m[1 + j] : 0.0;
    for (k = m[0] > 0.0 ? LOOK_BACK : 0; k <= LOOK_BACK; k++) push(held, m_next + 1);
    m_next[0] = 1.0;
    for (j = 0; j < H; j++) z[j] = m_next[1 + j];
}"""
_STANDARD = """\
static void push(const double held[], double latent[])
{
    double y[H];
    int j;
    for (j = 0; j < H; j++) y[j] = b_0[j];
    product(held, W_x, INPUTS, H, y);
    product(latent, W_r0, H, H, y);
    bend(y, b_0, H);
    for (j = 0; j < H; j++) latent[j] = y[j];
}"""
_GATES = """\
static double sigmoid(double x) { return 0.5 + 0.5 * tanh(0.5 * x); }

static void push(const double held[], double latent[])
{
    double a[GATES * H], b[GATES * H];
    int j;
    for (j = 0; j < GATES * H; j++) { a[j] = b_ih[j]; b[j] = b_hh[j]; }
    product(held, W_x, INPUTS, GATES * H, a);
    product(latent, W_hh, H, GATES * H, b);
    for (j = 0; j < H; j++) {
        const double first_gate = sigmoid(a[j] + b[j]), second_gate = sigmoid(a[H + j] + b[H + j]);
"""
_LSTM = _GATES.replace("GATES", "4") + """\
        latent[H + j] = second_gate * latent[H + j] + first_gate * tanh(a[2 * H + j] + b[2 * H + j]);
        latent[j] = sigmoid(a[3 * H + j] + b[3 * H + j]) * tanh(latent[H + j]);
    }
}"""
_GRU = _GATES.replace("GATES", "3") + """\
        latent[j] = (1.0 - second_gate) * tanh(a[2 * H + j] + first_gate * b[2 * H + j]) + second_gate * latent[j];
    }
}"""
_FIRST = {"feedforward": _PLAIN, "forgetting": _CHAIN, "rnn": _STANDARD + _REMEMBER, "lstm": _LSTM + _REMEMBER,
          "gru": _GRU + _REMEMBER}  # fmt: skip
