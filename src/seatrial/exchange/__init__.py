"""Exchange: a ship's plant as a file for other programs, which need no seatrial to use it.

Contract: `equations_of(ship)` traces the ship; `save_casadi`, `save_c` and `save_python` write it.  All three hold
the same right-hand side, operation for operation, with the numbers of the ship:

    rates(x, u, e) -> dx             time derivative of the state, at rest or under way
    step(x, u, e, dt) -> x_next      fourth-order Runge-Kutta, u and e held
    ordered_step(x, a, o, e) -> x_next, a_next
                                     the same behind the actuators, for one fixed length of the step

x: states, first those of `models.STATES`; u: actual controls; e: `environment.CHANNELS`; a: memory of the
actuators (actual values first of all); o: orders, one a control.  All in SI units and radians.  A ship in
discrete time has no right-hand side and is refused, but for a network: `save_network` writes its step in Python.

`save_fmu` packs the same C, its numbers made settable, as a co-simulation slave: the whole ship, or its hull alone.
"""

from __future__ import annotations

from .c_source import save_c
from .casadi_function import save_casadi
from .fmi.fmu import save_fmu
from .network_source import save_network
from .python_source import save_python
from .traced import Equations, equations_of

__all__ = ["Equations", "equations_of", "save_c", "save_casadi", "save_fmu", "save_network", "save_python"]
