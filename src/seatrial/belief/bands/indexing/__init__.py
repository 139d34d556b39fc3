"""Indices of manoeuvres in closed loop: their errors on left-out trials, and the factors of their bands."""
