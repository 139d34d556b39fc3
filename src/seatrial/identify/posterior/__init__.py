"""Uncertainty of a fit: posterior and verdicts, profile likelihoods, ensembles, residual tests."""
