"""Checks of the attitude that a log holds."""
