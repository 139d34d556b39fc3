"""Fits through the simulated trajectory: windows as lanes, exact sensitivities, Gauss-Newton."""
