"""Each check of the suite refuses what breaks its rule, and passes what is just within it; its inputs go everywhere."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from seatrial.core.parameters import Scalar, spec
from seatrial.core.symbolic import magnitude
from seatrial.data import DataError, Trial
from seatrial.environment import CHANNELS
from seatrial.forces import Flow, Force
from seatrial.manoeuvres import Index
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES, Model
from seatrial.models.common import Surroundings
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.testing import (
    FORCE_CHECKS,
    FORMAT_CHECKS,
    MANOEUVRE_CHECKS,
    SHIP_CHECKS,
    ContractError,
    Log,
    Part,
    discovery,
    force_modules,
    forces,
    logs,
    models,
    ships,
)


def sqrt(x: Any) -> Any:
    return x**0.5


Law = Callable[[Surroundings, float, float], tuple[Any, Any, Any]]


@dataclass(frozen=True, kw_only=True)
class Plain(Model):
    """Drag, thrust and a lag of the turn; `more` is what somebody added to surge, sway and yaw."""

    T: Scalar = spec("s", "time constant", (1e-3, 1e4), default=20.0)
    more: ClassVar[Law] = staticmethod(lambda at, n, delta: (0.0, 0.0, 0.0))

    def derivative(self, state: Any, control: Any, environment: Any) -> Any:
        """Rates of the state."""
        at = Surroundings.of(state, environment)
        n, delta = control
        X, Y, N = type(self).more(at, n, delta)
        surge = (0.5 * n - 0.1 * at.u_r) / self.T + X
        return at.rates((surge, -at.v_r / self.T + Y, (0.01 * at.u_r * delta - at.r) / self.T + N))


SHIP = load("mariner_nomoto")
U, L = SHIP.speed, SHIP.L_pp


def ship(more: Law | None = None, **own: Any) -> Ship:
    """A ship of the plain model with an addition, or with other members."""
    own = own if more is None else own | {"more": staticmethod(more)}
    return replace(SHIP, model=type("Mine", (Plain,), own)())


def refused(check: str, wrong: Ship, named: str = "") -> None:
    with pytest.raises(ContractError, match=named):
        SHIP_CHECKS[check](wrong)


@pytest.mark.parametrize("check", list(SHIP_CHECKS))
@pytest.mark.slow
def test_a_plain_model_keeps_every_rule(check: str) -> None:
    assert SHIP_CHECKS[check](ship()) is None


@pytest.mark.parametrize("more", [
    lambda at, n, delta: (0.0, 0.0, 1e-9), lambda at, n, delta: (1e-9, 0.0, 0.0), lambda at, n, delta: (0.0, 1e-9, 0.0),
    lambda at, n, delta: (0.0, 0.0, 1e-9 * delta), lambda at, n, delta: (0.0, 1e-9 * at.environment.per_depth, 0.0),
])  # fmt: skip
def test_what_moves_at_rest_is_refused(more: Law) -> None:
    refused("silent_at_rest", ship(more), "at rest under")


def test_a_model_that_is_not_valid_at_rest_says_so_and_why() -> None:
    refused("silent_at_rest", ship(valid_at_rest=False), "does not say why")
    told = ship(lambda at, n, delta: (1.0, 0.0, 0.0), valid_at_rest=False, __doc__="Nothing is known at rest.")
    for check in ("silent_at_rest", "all_but_silent_near_rest"):
        assert SHIP_CHECKS[check](told) == "the model is not valid at rest"


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rate_near_rest_is_a_twentieth_of_its_usual_size_at_most(axis: int) -> None:
    """A rate that goes with the root of the speed, 0.045 and 0.055 of its size at a thousandth of the speed."""
    usual = (U * U / L, U * U / L, (U / L) ** 2)[axis]

    def rooted(share: float, at: Surroundings) -> tuple[Any, Any, Any]:
        # of 1e-3 times the speed, which lags by T too
        own = (0.1, 1.0, 1.0)[axis] * 1e-3 * (U, U, U / L)[axis] / 20.0
        pull = (share * usual - own) * sqrt(magnitude((at.u_r, at.v_r, at.r)[axis]) / (1e-3 * (U, U, U / L)[axis]))
        return tuple(-pull if k == axis else 0.0 for k in range(3))  # type: ignore[return-value]

    def backwards(share: float) -> Ship:
        return ship(lambda at, n, delta: rooted(share, at))

    assert SHIP_CHECKS["all_but_silent_near_rest"](backwards(0.045)) is None
    refused("all_but_silent_near_rest", backwards(0.055), "all but at rest")


@pytest.mark.parametrize("more", [
    lambda at, n, delta: (0.0, 0.0, 1e-6 * at.u_r**2), lambda at, n, delta: (0.0, 1e-6 * at.u_r**2, 0.0),
    lambda at, n, delta: (0.0, 0.0, 1e-6 * at.environment.wave_y**2), lambda at, n, delta: (1e-4 * at.r, 0.0, 0.0),
    lambda at, n, delta: (0.0, 0.0, 1e-6 * delta**2), lambda at, n, delta: (1e-4 * at.environment.wind_y, 0.0, 0.0),
    lambda at, n, delta: (0.0, 0.0, 1e-4 * n), lambda at, n, delta: (1e-4 * at.environment.current_y, 0.0, 0.0),
    lambda at, n, delta: (0.0, 0.0, 1e-6 * at.v_r**2), lambda at, n, delta: (1e-4 * at.sin_psi, 0.0, 0.0),
])  # fmt: skip
def test_what_differs_to_port_and_starboard_is_refused(more: Law) -> None:
    refused("mirrored", ship(more), "in the mirror")


AGROUND: tuple[Law, ...] = (
    lambda at, n, delta: (0.0, 0.0, 1e-4 * at.v_m), lambda at, n, delta: (-0.01 * at.u, 0.0, 0.0),
    lambda at, n, delta: (0.0, -0.01 * at.v_m, 0.0), lambda at, n, delta: (1e-3 * at.environment.current_x, 0.0, 0.0),
    lambda at, n, delta: (0.0, 1e-3 * at.environment.wind_x, 0.0),
    lambda at, n, delta: (-at.r * (at.v_m - at.v_r), 0.0, 0.0), lambda at, n, delta: (0.0, at.r * (at.u - at.u_r), 0.0),
)  # fmt: skip


@pytest.mark.parametrize("more", AGROUND)
def test_what_feels_the_velocity_over_ground_is_refused(more: Law) -> None:
    refused("rates_in_a_current", ship(more), "changes more than the drift")


@pytest.mark.parametrize("more", AGROUND[:3])
@pytest.mark.slow
def test_a_run_in_a_current_shows_the_same(more: Law) -> None:
    refused("motion_in_a_current", ship(more), "otherwise than by the drift")


def test_a_rate_that_is_not_finite_or_not_one_to_symbols_is_refused() -> None:
    check = "finite_and_equal_on_symbols"
    refused(check, ship(lambda at, n, delta: (0.0, 0.0, sqrt(magnitude(at.v_r)))), "a derivative is not finite")
    refused(check, ship(lambda at, n, delta: (0.0, math.inf * at.v_r, 0.0)), "a rate is not finite")
    odd = ship(lambda at, n, delta: (0.0, 0.0, (1e-9 if isinstance(at.r, float) else 2e-9) * at.r))
    refused(check, odd, "floats and symbols differ")


def test_parameters_that_are_no_symbols_are_refused() -> None:
    def derivative(self: Any, state: Any, control: Any, environment: Any) -> Any:
        rates = Plain.derivative(self, state, control, environment)
        return (*rates[:5], rates[5] + (0.0 if isinstance(self.T, float) else 1e-6 * self.T))

    refused("parameters_may_be_symbols", ship(derivative=derivative), "symbols for parameters give other rates")


@pytest.mark.parametrize(("own", "named"), [
    ({"states": ("y", "x", *STATES[2:])}, "the first six states"), ({"sides": (1,)}, "one sign a state"),
    ({"states": (*STATES, "q"), "sides": (1, 1)}, "one sign a state"),
    ({"controls": ("n_P", "n_P")}, "without what it follows"),
    ({"controls": ("n_P", "delta", "n_bow"), "follows": (("n_P", 1.0), ("delta", 1.0))}, "without what"),
    ({"controls": ("n_P", "speed"), "follows": (("n_P", 1.0), ("delta", 1.0))}, "no unit follows from"),
    ({"follows": (("n_P", 1.0), ("delta", math.inf))}, "a factor that is not finite"),
    ({"draught": -1.0}, "draught, breadth, mass"), ({"breadth": math.nan}, "draught, breadth, mass"),
    ({"displaced": math.inf}, "draught, breadth, mass"), ({"asymmetries": ("bias",)}, "names none of the parameters"),
    ({"recall": lambda self, rows, dt: np.zeros((2, 0))}, "gives the shape"),
    ({"states": (*STATES, "p", "phi"), "sides": (-1, -1)}, "come together"),
])  # fmt: skip
def test_answers_that_do_not_fit_together_are_refused(own: dict[str, Any], named: str) -> None:
    refused("answers", ship(**own), named)


# where checks look


def test_situations_are_everywhere() -> None:
    one = load("kvlcc2_l7")
    x = models.situations(one) / discovery.flat(one)[1]
    assert np.isfinite(x).all()
    assert (models.situations(one)[:, [8 + CHANNELS.index(name) for name in ("wave_T", "per_depth")]] >= 0.0).all()
    assert x.shape == (80 + 3 + 54, 6 + 2 + len(CHANNELS))
    assert np.abs(x).max() <= 1.0 + 1e-12
    random = x[:80]
    assert (np.ptp(random[:, :12], axis=0) > 1.5).all()
    assert not x[80].any()
    assert (x[81, 6:8] == 0.5).all()
    assert not x[81, 8:].any()
    assert (x[82, 8:] == 0.5).all()
    assert not x[82, :8].any()
    ways = {(u, v, n) for u, v, n in x[83:, [3, 4, 6]].round(12).tolist()}
    assert ways == {(u, v, n) for u in (0.7, 1e-9, -0.5) for v in (0.0, 0.4, -0.4) for n in (1.0, 0.0, -1.0)}
    assert set(x[83:, 7].round(12)) == {0.0, 0.7}


def test_inputs_of_a_force_are_everywhere() -> None:
    part = next(one for name, one in force_modules().items() if name.startswith("hull:Polynomial"))
    names = [name for name in Flow._fields if name not in ("rho", "L_pp", "d")]
    x = forces.grid(part)
    assert x.shape == (3**5 * 2 * 3 * 4 + 4, len(names))
    relative = dict(zip(names, (x / part.size).T, strict=True))
    assert not x[0].any()
    for name, values in (("u", (-0.4, 0.0, 0.4)), ("v_m", (-0.2, 0.0, 0.2)), ("r", (-0.3, 0.0, 0.3)),
                         ("n_P", (-1.0, 0.0, 1.0)), ("delta", (0.0, 0.5, 1.2))):  # fmt: skip
        assert tuple(sorted(set(relative[name][:-4].round(12)))) == pytest.approx(values)
    assert max(relative["d_h"] * 0.8 if "d_h" in relative else [1.12]) == pytest.approx(1.12, rel=0.01)
    near = x[:-4, names.index("bank_u") if "bank_u" in names else 12]
    assert 0.2 < np.count_nonzero(near) / len(near) < 0.35  # two of seven are near something
    drawn = forces.samples(part)
    other = drawn[:, names.index("L_2")]
    assert 0.5 * part.L_pp <= other.min() < 0.6 * part.L_pp
    assert 0.9 * part.L_pp < other.max() <= part.L_pp
    assert (np.ptp(drawn / part.size, axis=0)[: names.index("L_2")] > 1.7).all()


LATERAL = {"v_m", "r", "delta", "v_A", "wave_v", "bank_v", "quay_v", "eta"}


def test_what_lies_across_the_ship_changes_its_sign_in_the_mirror() -> None:
    part = next(one for name, one in force_modules().items() if name.startswith("hull:Polynomial"))
    names = [name for name in Flow._fields if name not in ("rho", "L_pp", "d")]
    assert dict(zip(names, part.mirror, strict=True)) == {name: -1 if name in LATERAL else 1 for name in names}
    size = dict(zip(names, part.size, strict=True))
    assert (size["u"], size["r"]) == (part.U, pytest.approx(0.8 * part.U / part.L_pp))
    assert len(part.size) == discovery.INPUTS == len(Flow._fields) - 3


@pytest.mark.parametrize(("name", "sign"), [("n", 1), ("alpha", -1), ("delta", -1), ("Y", -1), ("N", -1), ("X", 1)])
def test_a_control_changes_its_sign_where_it_points_aside(name: str, sign: float) -> None:
    assert discovery.control_sign(name) == sign


def test_a_tunnel_thruster_pushes_the_other_way_in_the_mirror() -> None:
    tunnel, azimuth = (next(one.module for key, one in force_modules().items() if key.startswith(kind))
                       for kind in ("thruster:Tunnel", "azimuth:Azimuth"))  # fmt: skip
    assert discovery.control_sign("n", tunnel) == -1.0
    assert discovery.control_sign("n", azimuth) == 1.0


def test_rates_are_measured_by_the_time_for_a_ship_length() -> None:
    one = load("kvlcc2_l7")
    pace = 1.179 / 7.0
    np.testing.assert_allclose(discovery.rate_size(one), np.array([7, 7, 1, 1.179, 1.179, pace]) * pace)
    rolling = ships()["rolling"]
    own = dict(zip(rolling.model.states[6:], discovery.rate_size(rolling)[6:], strict=True))
    assert own["phi"] == pytest.approx(pace)
    assert own["p"] == pytest.approx(pace**2)
    usual = discovery.state_size(one)
    np.testing.assert_allclose(usual, [70, 70, 3, 1.179, 0.3 * 1.179, 0.5 * pace])
    around = dict(zip(CHANNELS, discovery.environment_size(one), strict=True))
    assert around["wind_x"] == around["wind_y"] == pytest.approx(2 * 1.179)
    assert around["current_x"] == around["current_y"] == pytest.approx(0.1 * 1.179)
    assert around["wave_x"] == around["wave_y"] == pytest.approx(0.07)
    assert around["wave_T"] == pytest.approx(math.sqrt(7.0))
    assert around["per_depth"] == pytest.approx(1 / (1.1 * 0.46))


def test_controls_of_the_mirror_image_change_places() -> None:
    boat = next(one for one in ships().values() if "throttle_port" in one.model.controls)
    given = tuple(0.1 * (k + 1) for k in range(len(boat.model.controls)))
    flipped = dict(zip(boat.model.controls, discovery.mirrored_control(boat.model, given), strict=True))
    before = dict(zip(boat.model.controls, given, strict=True))
    assert flipped["throttle_port"] == before["throttle_starboard"]
    assert flipped["throttle_starboard"] == before["throttle_port"]
    two = load("twin_virtual")
    given = tuple(0.1 * (k + 1) for k in range(len(two.model.controls)))
    flipped = dict(zip(two.model.controls, discovery.mirrored_control(two.model, given), strict=True))
    before = dict(zip(two.model.controls, given, strict=True))
    for name, value in flipped.items():
        partner = name[:-1] + {"1": "2", "2": "1"}[name[-1]]
        assert value == (-1 if name.startswith("delta") else 1) * before[partner]


def test_an_even_ship_has_one_number_for_both_sides() -> None:
    model: Any = discovery.even(load("kvlcc2_l7").model)
    assert model.rudder.gamma_Rp == model.rudder.gamma_Rn == 0.395
    assert model.propeller.C_2p == model.propeller.C_2n == 1.1
    assert model.hull == load("kvlcc2_l7").model.hull  # type: ignore[attr-defined]
    assert discovery.even(load("mariner_nomoto").model).delta_r == 0.0


# forces


@dataclass(frozen=True, kw_only=True)
class Fin:
    """A fin; `law` is what somebody wrote."""

    mirror_symmetric: ClassVar[bool] = True
    law: ClassVar[Callable[[Flow], Any]]

    def force(self, flow: Flow) -> Force:
        """What the law gives."""
        return Force(*type(self).law(flow))


def fin(law: Callable[[Flow], Any], **own: Any) -> Part:
    made = type("Mine", (Fin,), {"law": staticmethod(law), **own})
    return Part(made(), rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0)


@pytest.mark.parametrize(("check", "law", "named"), [
    ("silent_at_rest", lambda f: (1e-9, 0.0 * f.u, 0.0 * f.u), "at rest"),
    ("silent_at_rest", lambda f: (0.0, 1e-9 * f.delta, 0.0), "angle 0.4"),
    ("silent_at_rest", lambda f: (0.0, 0.0, 1e-9 * f.wave_T * f.bank_v), "at rest"),
    ("silent_at_rest", lambda f: (0.0, 0.0, 1.0 / f.u), "at rest: float division"),
    ("mirrored", lambda f: (1e-9 * f.v_m, f.v_m, 0.0), "X is .* in the mirror"),
    ("mirrored", lambda f: (0.0, f.u * f.u + f.v_m, 0.0), "Y is .* in the mirror"),
    ("mirrored", lambda f: (0.0, f.v_m, f.wave_v**2), "N is .* in the mirror"),
    ("finite", lambda f: (sqrt(magnitude(f.r)), 0.0, 0.0), "a derivative of X"),
    ("finite", lambda f: (0.0, 0.0, sqrt(magnitude(f.wave_v))), "a derivative of N"),
    ("floats_equal_symbols", lambda f: (0.0, f.u * (1.0 + 1e-9 * isinstance(f.u, float)), 0.0), "Y is .* by floats"),
])  # fmt: skip
def test_a_force_that_breaks_a_rule_is_refused_by_its_check(check: str, law: Any, named: str) -> None:
    with pytest.raises(ContractError, match=named):
        FORCE_CHECKS[check](fin(law))


def test_a_force_is_as_symmetric_as_it_says() -> None:
    even_, odd = (lambda f: (f.u, f.v_m, f.v_m)), (lambda f: (f.u, f.v_m + 0.01 * f.u, f.v_m))
    FORCE_CHECKS["mirrored"](fin(even_))
    with pytest.raises(ContractError, match="is its own mirror image"):
        FORCE_CHECKS["mirrored"](fin(even_, mirror_symmetric=False))
    with pytest.raises(ContractError, match="names no `asymmetries`"):
        FORCE_CHECKS["mirrored"](fin(odd, mirror_symmetric=False))


# manoeuvres


def manoeuvre(check: str, **own: Any) -> Callable[[], Any]:
    cls = type("Mine", (Turning,), own)
    return functools.partial(MANOEUVRE_CHECKS[check], cls, load("kvlcc2_l7"))


@pytest.mark.parametrize(("check", "own", "named"), [
    ("named", {"kind": ""}, "has no kind"), ("named", {"takes": ("speed",)}, "takes .*known: "),
    ("shapes", {"orders": ("n_P", "n_P")}, "twice"), ("shapes", {"memory": ("a",)}, "begin gives 0 numbers"),
    ("shapes", {"command": lambda self, t, state, memory: ((1.0,), memory)}, "command gives 1 orders"),
    ("shapes", {"command": lambda self, t, state, memory: ((1.0, 2.0), (0.0,))}, "command gives 1 numbers"),
    ("shapes", {"command": lambda self, t, state, memory: ((1.0, math.nan), memory)}, "command gives .*nan"),
    ("floats_equal_symbols", {"command": lambda self, t, state, memory: (
        (1.0, 0.1 if isinstance(t, float) else 0.100001), memory)}, "floats give"),
    ("runs", {"complete": lambda self, run: True,
              "indices": lambda self, run, L: {"reach": Index(math.inf, "m")}}, "reach is infinite"),
])  # fmt: skip
def test_a_manoeuvre_that_breaks_a_rule_is_refused_by_its_check(check: str, own: dict[str, Any], named: str) -> None:
    with pytest.raises(ContractError, match=named):
        manoeuvre(check, **own)()


def test_a_figure_that_is_none_is_no_fault_and_an_order_that_a_ship_lacks_is_told() -> None:
    figures: dict[str, Any] = {"complete": lambda self, run: True,
                               "indices": lambda self, run, L: {"reach": Index(math.nan, "m")}}  # fmt: skip
    assert manoeuvre("runs", **figures)() is None
    infinite: dict[str, Any] = {"complete": lambda self, run: False,
                                "indices": lambda self, run, L: {"reach": Index(math.inf, "m")}}  # fmt: skip
    assert manoeuvre("runs", **infinite)() is None
    assert manoeuvre("runs", orders=("n_P", "n_bow"))() == "kvlcc2_l7 has no n_bow"


# formats


def format_of(**channels: Any) -> Log:
    given = {name: np.full(9, float(value)) if np.isscalar(value) else value for name, value in channels.items()}
    module = SimpleNamespace(name="log", suffixes=(".log",), read=lambda file, mapping: Trial(
        file.stem, np.arange(9.0), given))  # fmt: skip
    return Log(module, "1\n2\n")


TURNING = np.arange(9.0)


@pytest.mark.parametrize(("channels", "within"), [
    ({"u": 59.0}, True), ({"u": 61.0}, False), ({"u": -61.0}, False), ({"v_m": 59.0}, True), ({"v_m": 61.0}, False),
    ({"r": 3.9}, True), ({"r": 4.1}, False), ({"delta": 1.57}, True), ({"delta": 1.58}, False), ({"n_P": 99.0}, True),
    ({"n_P": 101.0}, False), ({"U_T": 119.0}, True), ({"U_T": 121.0}, False), ({"U_A": 119.0}, True),
    ({"U_A": 121.0}, False), ({"psi": 6.28}, True), ({"psi": 6.29}, False), ({"psi": -6.29}, False),
    ({"psi": 3.9 * TURNING}, True), ({"psi": 4.1 * TURNING}, False), ({"psi": -4.1 * TURNING}, False),
    ({"psi": np.array([math.nan, *TURNING[:8]])}, True), ({"psi": np.array([math.nan, 7.0, *TURNING[:7]])}, False),
    ({"psi": np.full(9, math.nan)}, True), ({"u": np.full(9, math.nan)}, True),
])  # fmt: skip
def test_values_are_those_of_a_craft(channels: dict[str, Any], within: bool) -> None:
    if within:
        FORMAT_CHECKS["possible"](format_of(**channels))
    else:
        with pytest.raises(ContractError):
            FORMAT_CHECKS["possible"](format_of(**channels))


@pytest.mark.parametrize(("suffixes", "kept"), [((".log",), True), ((".LOG",), False), (("LOG.TXT",), True),
                                                ((), False),
                                                ([".log"], False), ((".log", ".Bin"), False)])  # fmt: skip
def test_suffixes_are_a_tuple_in_lower_case(suffixes: Any, kept: bool) -> None:
    log = format_of(u=1.0)
    log.module.suffixes = suffixes
    if kept:
        FORMAT_CHECKS["complete"](log)
    else:
        with pytest.raises(ContractError, match="suffixes"):
            FORMAT_CHECKS["complete"](log)
    log.module.name = ""
    with pytest.raises(ContractError, match="name"):
        FORMAT_CHECKS["complete"](log)


def test_a_file_is_called_after_its_format() -> None:
    log = format_of(u=1.0)
    assert log.name == "example.log"
    log.module.suffixes = ("vessel.txt", ".log")
    assert log.name == "vessel.txt"


def test_a_trial_is_named_has_rows_and_units() -> None:
    def read(**given: Any) -> Log:
        log = format_of(u=1.0)
        usual = {"name": "example", "t": np.arange(9.0), "channels": {"u": np.ones(9)}} | given
        log.module.read = lambda file, mapping: Trial(**usual)
        return log

    FORMAT_CHECKS["reads"](read())
    own = {"u": np.ones(9), "oil": np.ones(9)}
    for wrong, named in ((read(name="mine"), "called 'mine'"),
                         (read(t=np.zeros(1), channels={"u": np.ones(1)}), "strictly"),
                         (read(channels=own), "without a unit: oil")):  # fmt: skip
        with pytest.raises(ContractError, match=named):
            FORMAT_CHECKS["reads"](wrong)
    FORMAT_CHECKS["reads"](read(channels=own, units={"oil": "bar"}))
    folder = read(name="mine")
    folder.module.suffixes = ("vessel",)
    FORMAT_CHECKS["reads"](folder)


def test_damages_are_what_they_are_called() -> None:
    example = "".join(f"line {k}\n" for k in range(9))
    found = dict(logs.damages(example))
    assert found["empty"] == b""
    assert found["cut off within its last line"] == example.encode()[:-4]
    cut = found["with a byte that is no text"]
    assert cut.replace(b"\xff\xfe", b"") == example.encode()
    assert cut.index(b"\xff\xfe") == len(example) // 2
    with pytest.raises(UnicodeDecodeError):
        found["binary"].decode()
    for k in (3, 4, 8):
        lines = example.splitlines(keepends=True)
        changed = {what: content.decode().splitlines(keepends=True) for what, content in found.items()
                   if f"line {k + 1}" in what}  # fmt: skip
        assert changed[f"with letters in line {k + 1}"] == [*lines[:k], "x" + lines[k][1:], *lines[k + 1 :]]
        assert changed[f"with line {k + 1} twice"] == [*lines[:k], lines[k], *lines[k:]]
        assert changed[f"with nan in line {k + 1}"] == [*lines[:k], "nan" + lines[k], *lines[k + 1 :]]
        more = changed[f"with a field too many in line {k + 1}"]
        assert [one for one, was in zip(more, lines, strict=True) if one != was] == [f"line {k},1;2\t3 4\n"]
    assert len(found) == 5 + 3 * 4


class TwoLinesError(DataError):
    """A refusal of two lines."""

    def __str__(self) -> str:
        return "example.log\nis wrong"


@pytest.mark.parametrize(("says", "named"), [
    (TwoLinesError("x"), "several lines"), ("nothing", "does not name it"),
    (ValueError("no"), "raises ValueError"),
])  # fmt: skip
def test_a_refusal_is_one_line_that_names_the_file(says: Any, named: str) -> None:
    log = format_of(u=1.0)

    def read(file: Path, mapping: Any) -> Trial:
        raise says if isinstance(says, Exception) else DataError(says)

    log.module.read = read
    with pytest.raises(ContractError, match=named):
        FORMAT_CHECKS["refuses"](log)
    log.module.read = lambda file, mapping: Trial("example", np.zeros(3), {"u": np.zeros(3)})
    with pytest.raises(ContractError, match="time does not increase"):
        FORMAT_CHECKS["refuses"](log)
