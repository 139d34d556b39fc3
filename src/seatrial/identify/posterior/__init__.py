"""What the data say after a fit: verdicts, profiles, ensembles, residual tests."""
