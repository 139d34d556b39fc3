"""Design of trials: manoeuvres that are most informative about chosen parameters."""
