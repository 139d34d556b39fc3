"""Which manoeuvres tell most about the parameters that are wanted."""
