"""The hull alone: a ship without propeller, rudder and thrusters, moved by forces from outside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ...core.parameters import Parts, Scalar, parts
from ...environment import Environment
from ...forces import Force, ForceModule
from ...forces.body import Body
from ...forces.shallow import afloat
from ...models import Model
from ...models.common import Surroundings
from ...models.fossen import Fossen, Inertia, Particulars
from ...models.mmg import Mmg
from ...models.twin import TwinMmg
from ...ships import Ship, ShipError

FORCES = ("X_outer", "Y_outer", "N_outer")
"""Sum of the forces from outside: ahead [N], to starboard [N], moment about midship to starboard [N m]."""


@dataclass(frozen=True, kw_only=True)
class MmgHull(Model):
    """Hull and body of the MMG family; `extras` are what is fixed to the hull, such as a skeg."""

    body: Body
    hull: ForceModule
    extras: Parts = parts("force")

    @property
    def controls(self) -> tuple[str, ...]:
        """The forces from outside."""
        return FORCES

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the forces from outside."""
        around = Surroundings.of(state, environment)
        flow = around.flow(self.body)
        total = self.hull.force(flow) + Force(*control)
        for module in self.extras.components:
            total = total + module.force(flow)
        body = afloat(self.body, self.hull, flow)
        return around.rates(body.acceleration(total, flow.u, flow.v_m, flow.r))


@dataclass(frozen=True, kw_only=True)
class FossenHull(Model):
    """Inertia and damping of Fossen's family."""

    body: Particulars
    inertia: Inertia
    damping: ForceModule

    @property
    def controls(self) -> tuple[str, ...]:
        """The forces from outside."""
        return FORCES

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the forces from outside."""
        around = Surroundings.of(state, environment)
        flow = around.flow(self.body)
        total = self.damping.force(flow) + Force(*control)
        return around.rates(self.inertia.acceleration(total, flow.u, flow.v_m, flow.r))


def hull_of(ship: Ship) -> Ship:
    """The ship with its hull for a model; paths of the parameters, and so their sources, stay.

    Raises:
        ShipError: a model whose hull is not a part of its own.
    """
    model: Any = ship.model
    if type(model) in (Mmg, TwinMmg):
        hull: Any = MmgHull(body=model.body, hull=model.hull, extras=model.part("extras") or Parts())
    elif type(model) is Fossen:
        hull = FossenHull(body=model.body, inertia=model.inertia, damping=model.damping)
    else:
        whole = f"{type(model).__name__} does not keep the hull apart from what drives it"
        raise ShipError(f"{ship.name}: --hull takes an Mmg, TwinMmg or Fossen model; {whole}; leave --hull out")
    title = f"{ship.notes.get('title', ship.name)}: the hull alone, forces from outside"
    return replace(ship, name=f"{ship.name}_hull", model=hull, notes={**ship.notes, "title": title})
