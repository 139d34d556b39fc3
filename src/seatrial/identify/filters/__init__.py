"""Kalman filters and smoothers on a ship's own model."""

MODEL, STAYING, CONSTANT_VELOCITY = "model", "staying put", "constant velocity"
"""Who predicts, by name: the model from the filtered state, one that stays where it was, and one that goes on so."""
