"""Draws from the posterior: its density on the batch, Hamiltonian steps, diagnostics, and what they say."""
