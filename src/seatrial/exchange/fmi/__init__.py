"""Co-simulation slaves by FMI 2.0 and 3.0."""
