"""Simulation: from a ship and a policy, or a ship and a measured trial, to a trial.

Contract: `simulate` runs a `Ship` under a `Policy` and returns the `Trial` that a logger would record; `campaign` runs
many lanes at once and returns a `Rollout`.  `replay.replay` predicts a measured trial from its own controls and wind.
`approach` has the steady run before a manoeuvre and the time step, `loop` the systems that the engine integrates.  A
run that blows up or leaves the ship's validity raises `SimulationError`.
"""

from .run import SimulationError, campaign, simulate

__all__ = ["SimulationError", "campaign", "simulate"]
