"""Simulation: a ship and a policy in, a trial out."""
