"""The suite as whoever adds a class runs it: it passes what keeps the contract and names what does not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import pytest

from seatrial.core.parameters import Scalar, spec
from seatrial.core.symbolic import speed
from seatrial.environment import Environment
from seatrial.forces import Flow, Force
from seatrial.manoeuvres.turning import Turning
from seatrial.models import Model
from seatrial.models.common import Surroundings
from seatrial.ships.files import load
from seatrial.testing import ContractError, Part, check_force, check_manoeuvre, check_ship


@dataclass(frozen=True, kw_only=True)
class Fin:
    """Lift of a fin; `push` is a force at rest, `bias` one to starboard under way."""

    mirror_symmetric: ClassVar[bool] = True

    x: Scalar = spec("m", "position ahead of midship")
    push: Scalar = spec("N", "force at rest", default=0.0)
    bias: Scalar = spec("kg/m", "side force by u^2", default=0.0)

    def force(self, flow: Flow) -> Force:
        """Side force at x."""
        v = flow.v_m + self.x * flow.r
        Y = -0.5 * flow.rho * speed(flow.u, v) * v + self.push + self.bias * flow.u * flow.u
        return Force(0.0 * Y, Y, self.x * Y)


@dataclass(frozen=True, kw_only=True)
class Lag(Model):
    """T r' + r = K delta at a held speed; `drift` turns the ship at rest too."""

    T: Scalar = spec("s", "time constant", (1e-3, 1e4))
    drift: Scalar = spec("rad/s", "yaw rate without a rudder angle", default=0.0)

    def derivative(self, state: Any, control: Any, environment: Environment) -> Any:
        """Rates of the state."""
        around = Surroundings.of(state, environment)
        turn = 0.1 * around.u_r * control[1] + self.drift
        return around.rates((0.0 * around.u_r, 0.0 * around.v_r, (turn - around.r) / self.T))


class Branches(Turning):
    """A turn whose rudder is chosen by an `if`, which no trace can follow."""

    def command(self, t: Any, state: Any, memory: Any) -> Any:
        """Full rudder after a second."""
        return (self.n_P, self.delta if float(t) > 1.0 else 0.0), memory


class Forgetful(Turning):
    """A turn that names a memory and gives none."""

    memory: ClassVar[tuple[str, ...]] = ("psi_0",)


def tried(fin: Fin) -> Part:
    return Part(fin, rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0)


@pytest.mark.slow
def test_a_force_that_keeps_the_contract_passes() -> None:
    check_force(tried(Fin(x=-3.0)))


@pytest.mark.parametrize(("fault", "named"), [({"push": 1.0}, "at rest"), ({"bias": 1.0}, "mirror")])
def test_a_force_that_breaks_it_is_named(fault: dict[str, float], named: str) -> None:
    with pytest.raises(ContractError, match=named):
        check_force(tried(replace(Fin(x=-3.0), **fault)))


@dataclass(frozen=True, kw_only=True)
class Written:
    """A force as somebody wrote it; `law` is what was written."""

    mirror_symmetric: ClassVar[bool] = True
    law: ClassVar[Callable[[Flow], Force]]

    def force(self, flow: Flow) -> Force:
        """What the law gives."""
        return type(self).law(flow)


LAWS: tuple[tuple[Callable[[Flow], Force], str], ...] = (
    (lambda flow: Force(0.0, -flow.v_m if flow.u > 0 else flow.v_m, 0.0), "asks `if`"),
    (lambda flow: Force(-math.sqrt(flow.u**2) * flow.u, 0.0, 0.0), "functions of `math`"),
    (lambda flow: Force(-flow.u * (flow.u**2 + flow.v_m**2) ** 0.5, 0.0, 0.0), "derivative of X is nan at rest"),
    (lambda flow: Force(0.0, flow.v_m / flow.u, 0.0), "division by zero"),
    (lambda flow: Force(0.0, flow.v_m**2, 0.0), "Y is .* in the mirror, at u"),
)


@pytest.mark.parametrize(("law", "named"), LAWS)
def test_what_authors_get_wrong_is_named_with_its_place(law: Callable[[Flow], Force], named: str) -> None:
    written = type("Mine", (Written,), {"law": staticmethod(law)})
    with pytest.raises(ContractError, match=f"^Mine.*{named}"):
        check_force(Part(written(), rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0))


@pytest.mark.parametrize(("named", "said"), [("bias", "write a tuple"), (("nosuch",), "names 'nosuch'; it has x, ")])
def test_asymmetries_that_name_no_number_are_told(named: object, said: str) -> None:
    sided = type("Sided", (Fin,), {"mirror_symmetric": False, "asymmetries": named})
    with pytest.raises(ContractError, match=said):
        check_force(tried(sided(x=-3.0, bias=1.0)))


@pytest.mark.slow
def test_a_force_whose_side_is_named_passes() -> None:
    check_force(tried(type("Sided", (Fin,), {"mirror_symmetric": False, "asymmetries": ("bias",)})(x=-3.0, bias=1.0)))


def test_a_force_that_does_not_say_whether_port_mirrors_starboard_is_told_to() -> None:
    @dataclass(frozen=True)
    class Silent:
        """A force that says nothing."""

        def force(self, flow: Flow) -> Force:
            """None."""
            return Force(0.0 * flow.u, 0.0 * flow.u, 0.0 * flow.u)

    with pytest.raises(ContractError, match="Silent does not say `mirror_symmetric"):
        check_force(Part(Silent(), rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0))


@pytest.mark.slow
def test_a_family_that_keeps_the_contract_passes_and_one_that_moves_at_rest_does_not() -> None:
    ship = replace(load("mariner_nomoto"), model=Lag(T=20.0))
    check_ship(ship)
    with pytest.raises(ContractError, match="at rest"):
        check_ship(replace(ship, model=Lag(T=20.0, drift=0.01)))


def test_a_manoeuvre_that_keeps_the_contract_passes() -> None:
    check_manoeuvre(Turning, load("kvlcc2_l7"))


@pytest.mark.parametrize(("cls", "named"), [(Branches, "symbols"), (Forgetful, "memory")])
def test_a_manoeuvre_that_breaks_it_is_named(cls: type[Turning], named: str) -> None:
    with pytest.raises(ContractError, match=named):
        check_manoeuvre(cls, load("kvlcc2_l7"))
