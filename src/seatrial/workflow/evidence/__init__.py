"""Workflows about what a fitted model is worth: bands of its manoeuvres, and its card."""
