"""Foreign logs as trials: one module a format."""
