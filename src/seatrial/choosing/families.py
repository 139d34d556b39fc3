"""The families of ship models: statements of Sawada et al. (2024) on each, and the source of its numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..actuators import Actuators
from ..core.parameters import Terms
from ..engine.rollout import simulator
from ..environment import CHANNELS
from ..models.arx import Arx, lag_of
from ..models.linear import straight
from ..models.network import Network, initial
from ..models.network_pass import prepared
from ..models.neural import Neural, features
from ..models.nomoto import Nomoto
from ..ships import Ship
from ..ships.files import load
from ..simulate.loop import open_loop, open_loop_parameters
from . import Family, Finding

TEACHER = "esso_osaka_3m"
_UNITS, _SAMPLES, _RIDGE = 300, 6000, 1e-7
_GAINS = {"W_x0": 2.0, "W_u0": 2.0, "W_w0": 0.5, "b_0": 8.0, "W_1": 1.0}
# Largest u, v_m, r, n_P, delta and true wind that it was taught at.
_RANGE = np.array([0.6, 0.3, 0.2, 18.0, 0.6, 5.0, 5.0])


def taught_network() -> Ship:
    """A feed-forward network whose last layer is fitted to the accelerations of the 3 m model, without any data.

    Its first layer is drawn: least squares suffice then, and the network answers as its teacher did at random
    motions, controls and winds.
    """
    base = load(TEACHER)
    drawn = initial(Network("feedforward", (_UNITS,), memory=1, scale=tuple(0.3 * _RANGE)), 1)
    x = np.random.default_rng(1).uniform(-1.0, 1.0, (_SAMPLES, _RANGE.size)) * _RANGE
    state = np.hstack([np.zeros((_SAMPLES, 3)), x[:, :3]])
    acting = np.hstack([x[:, 3:], np.zeros((_SAMPLES, len(CHANNELS) - 2))])
    system = open_loop(base)
    answers = simulator(system).evaluate(state, acting, open_loop_parameters(base))[:, 3:6]
    w = {name: _GAINS[name] * array for name, array in drawn.weights.items()}
    ready = prepared(drawn.having(w), np.float64)
    z = np.tanh(features(drawn, state, acting) @ ready["W_x"] + ready["b_0"]) - np.tanh(ready["b_0"])
    normal = z.T @ z + _RIDGE * _SAMPLES * np.eye(_UNITS)
    w["W_1"] = np.linalg.solve(normal, z.T @ answers).astype(np.float64)
    model = Neural(dt=0.1, network=drawn.having(w))
    return replace(base, name=f"{TEACHER}, as a network", model=model, actuators=Actuators(), entries={}, n_P=None)


PAPER = "Sawada 2024"


def _said(section: str, **answers: tuple[str, str]) -> dict[str, Finding]:
    """Declared answers from one section."""
    return {key: Finding(answer, f"{PAPER} {section}: {text}") for key, (answer, text) in answers.items()}


def _cubic(ship: Ship) -> bool:
    return not isinstance(ship.model, Nomoto) or bool(ship.model.alpha)


def _low_speed(ship: Ship) -> bool:
    """A hull of cross-flow drag: forces without a division by the speed."""
    return type(ship.model.part("hull")).__name__ == "CrossFlow"


def _equations(ship: Ship) -> int:
    model: Any = ship.model
    return len({lag_of(name).output for name in model.coefficients.names})


def vector_arx() -> Ship:
    """The Mariner about its straight run, as a map over a second: a vector ARX model without any fit."""
    base = load("mariner")
    line = straight(base.model, base.speed)
    dt, kept = 1.0, [line.states.index(n) for n in ("u", "v_m", "r")]
    A = np.eye(3) + dt * line.A[np.ix_(kept, kept)]
    b = dt * line.input("delta")[kept]
    at, delta = np.array(line.at.state[3:6]), line.at.orders["delta"]
    rest = at - A @ at - b * delta
    numbers: dict[str, float] = {}
    for i, output in enumerate(("u", "v_m", "r")):
        numbers |= {f"{output}_{of}_1": float(A[i, j]) for j, of in enumerate(("u", "v_m", "r"))}
        numbers |= {f"{output}_delta_1": float(b[i]), f"{output}_constant": float(rest[i])}
    model = Arx(dt=dt, coefficients=Terms(tuple(numbers), tuple(numbers.values())))
    return replace(base, name="mariner, linearised", model=model, actuators=Actuators(), entries={})


_RUNAWAY = _said("4.1.1", unstable_hull=("yes", "by the sign of its constants"),
                 plausible=("partly", "linear: an unstable ship turns ever faster, which Eq. 8 holds"),
                 from_particulars=("partly", "K, T are sorted by ship type, trim and rudder [51]; no chart here"))
_LINEAR = _said("4.1.2", unstable_hull=("partly", "linear: an unstable ship turns faster for ever"),
                plausible=("partly", "linear, and blind beyond the data it was fitted to"),
                large_drift=("no", "an answer about the motion it was fitted to"),
                from_particulars=("no", "coefficients come from recorded series by least squares"))
_POLYNOMIAL = {
    **_said("4.2.1", plausible=("partly", "a series about one speed; its higher terms have no clear physical meaning"),
            speed_loss=("partly", "large speed losses with large rudder angles are hard for it"),
            large_drift=("no", "small departures from a constant speed")),
    **_said("5.4", unstable_hull=("partly", "the derivatives change with the speed"),
            from_particulars=("no", "captive tests or identification")),
}  # fmt: skip
_AHEAD = {
    **_said("4.2.1", large_drift=("no", "the standard method has sway much slower than surge: no berthing"),
            reversing=("no", "the standard method is not for propellers that turn astern"),
            reversing_turns=("no", "the standard method is not for propellers that turn astern"),
            unstable_hull=("yes", "physical linear terms")),
    **_said("5.2", from_particulars=("yes", "regression formulas for hull, propeller, rudder and wind")),
}  # fmt: skip

_SIGNED = {"type ship": "5.1"}
_FITTED = {"identification": "5.4"}
_TESTED = {"captive tests": "5.3", "identification": "5.4"}
_STUDY = "seatrial identify STUDY.toml -o fit"

FAMILIES = (
    Family(
        "KT", "Nomoto, first order", ("nomoto:Nomoto",), "T r' + r = K delta", "4.1.1 (Eq. 6)", "Nomoto 1957",
        {**_SIGNED, "zigzag test": "4.1.1", **_FITTED},
        {**_RUNAWAY}, (104,), ("K", "T", "alpha", "n_1", "delta_r"), lambda ship: not _cubic(ship),
        next=("seatrial simulate mariner_nomoto zigzag",
              "seatrial design mariner_nomoto --free K --free T --budget 20"),
    ),
    Family(
        "KT2", "Nomoto, second order", ("nomoto2:Nomoto2",),
        "T1 T2 r'' + (T1 + T2) r' + r = K (delta + T3 delta')", "4.1.1 (Eq. 5)", "Nomoto 1957",
        {"linear derivatives": "4.1.1", **_FITTED}, {**_RUNAWAY}, (),
        ("K", "T_*", "alpha", "n_1", "delta_r"), next=("seatrial simulate mariner_nomoto2 zigzag",),
    ),
    Family(
        "Norrbin", "Nomoto with Norrbin's cubic term", ("nomoto:Nomoto", "nomoto:NomotoTable"),
        "T r' + r + c3 r^3 = K delta", "4.1.1 (Eq. 8)", "Norrbin 1963", {"zigzag and spiral tests": "4.1.1", **_FITTED},
        _said("4.1.1", unstable_hull=("yes", "Eq. 8 with a negative linear term"), from_particulars=("partly",
              "K and T are sorted by ship type [51]; c3 from trials, and not unique [54]")),
        (), ("K*", "T*", "alpha", "n_1", "delta_r"), _cubic, next=("seatrial simulate zeefakkel zigzag",),
    ),
    Family(
        "ARX", "AR and ARX, one output", ("arx:Arx",), "r(t) = sum a_i r(t-i) + sum b_j delta(t-j)", "4.1.2 (Eq. 9)",
        "Astrom and Kallstrom 1976", _FITTED, _LINEAR, (), ("coefficients.*",), lambda ship: _equations(ship) == 1,
        next=("seatrial simulate kvlcc2_l7_arx zigzag", _STUDY),
    ),
    Family(
        "VARX", "vector ARX of u, v_m, r", ("arx:Arx",), "x(t) = sum A_i x(t-i) + sum B_j c(t-j)", "4.1.2",
        "Ohtsu 1980", _FITTED, _LINEAR, (), ("coefficients.*",), lambda ship: _equations(ship) > 1, vector_arx,
        (_STUDY,),
    ),
    Family(
        "NN", "feed-forward and recurrent networks", ("neural:Neural",), "y = f(W x + b), in layers",
        "4.1.3 (Eq. 10)", "Moreira 2003, Wakita 2022", _FITTED,
        _said("4.1.3", plausible=("partly", "whatever its weights say where no data were"),
              large_drift=("partly", "where the data hold it"), unstable_hull=("yes", "a fit to any motion"),
              at_rest=("partly", "zero at the origin only"),
              from_particulars=("no", "training on recorded manoeuvres")),
        (65,), specimen=taught_network, next=(_STUDY,),
    ),
    Family(
        "Abkowitz", "Abkowitz, whole ship", ("abkowitz:Abkowitz",), "X, Y, N: polynomials about a straight run",
        "4.2.1 (Eqs. 15-17)", "Abkowitz 1964", {**_SIGNED, **_TESTED}, _POLYNOMIAL, (69, 106), ("derivatives.*",),
        next=("seatrial simulate mariner zigzag", _STUDY),
    ),
    Family(
        "modAbk", "modified Abkowitz", ("abkowitz_modified:ModifiedAbkowitz",),
        "hull polynomial, thrust, rudder in the race", "4.2.2 (Eqs. 21-23)", "Abkowitz 1980", _FITTED,
        {**_said("8", from_particulars=("no", "it needs training data")),
         **_said("4.2.2", unstable_hull=("yes", "linear terms of its own"), large_drift=(
                 "partly", "named for large rudder angles and reversal; its terms divide by U"))},
        (), ("derivatives.*", "race.*", "c_0"), next=("seatrial show modified_abkowitz_kvlcc2_l7 --sources", _STUDY),
    ),
    Family(
        "tanker", "tanker of van Berlekom and Goddard", ("tanker:Tanker",),
        "whole ship in the 'bis' system, with a screw", "4.2.1 (whole ship)",
        "van Berlekom and Goddard 1972", {**_SIGNED, **_TESTED},
        {**_said("4.2.1", large_drift=("no", "a whole-ship series for running ahead"),
                 unstable_hull=("yes", "depth and speed change it")),
         **_said("5.4", from_particulars=("no", "captive tests or identification"))},
        (), ("d_*", "X_*", "Y_*", "N_*", "screw.*", "body.m_*"),
        next=("seatrial simulate esso_190k_tanker turning --depth 30",),
    ),
    Family(
        "MMG", "MMG, standard method", ("mmg:Mmg",), "hull + propeller + rudder + wind + waves + thrusters",
        "4.2.2 (Eqs. 18-19)", "Yasukawa and Yoshimura 2015",
        {**_SIGNED, "regression": "5.2", **_TESTED}, _AHEAD, (105,), belongs=lambda ship: not _low_speed(ship),
        next=("seatrial estimate PARTICULARS.toml -o my_ship.toml",
              "seatrial design kvlcc2_l7 --free 'hull.*'", _STUDY),
    ),
    Family(
        "lowMMG", "MMG for low speed", ("mmg:Mmg",), "cross-flow hull, propeller in four quadrants",
        "4.2.2 and Appendix (Eqs. 36-62)", "Miyauchi 2022", {**_SIGNED, **_TESTED},
        _said("5.2", unstable_hull=("yes", "physical linear terms"),
              from_particulars=("partly", "no chart gives the parameters of low speed")),
        (73,), belongs=_low_speed,
        next=("seatrial show esso_osaka_3m --sources",
              "seatrial design esso_osaka_3m --free 'hull.*' --budget 120", _STUDY),
    ),
    Family(
        "twinMMG", "MMG, twin screws and rudders", ("twin:TwinMmg",), "MMG with a propeller and a rudder a side",
        "4.2.2", "Yasukawa and Yoshimura 2015, a pair", {**_SIGNED, **_TESTED},
        {**_AHEAD, **_said("5.2", from_particulars=("partly", "the formulas are for a single screw"))},
        next=("seatrial simulate twin_virtual turning", _STUDY),
    ),
    Family(
        "Fossen", "Fossen's matrix-vector form", ("fossen:Fossen",), "M nu' + C(nu) nu + D(nu) nu = tau",
        "4.2.2 (Eqs. 24-32)", "Fossen 2021, You 2023", {**_SIGNED, **_TESTED},
        {**_said("4.2.2", unstable_hull=("yes", "its damping matrix")),
         **_said("5.2", from_particulars=("no", "regression is named for its rudder only (Eq. 31)"))},
        (), ("inertia.*", "damping.*"),
        next=("seatrial show milliampere --sources", "seatrial simulate qiuxin5_6 zigzag", _STUDY),
    ),
)  # fmt: skip
"""All families, from the simplest to the most physical."""
