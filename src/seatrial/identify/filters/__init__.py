"""Kalman filters and smoothers on a ship's own model."""
