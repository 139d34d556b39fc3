"""Training of networks and of bounded corrections (Wakita 2022)."""
