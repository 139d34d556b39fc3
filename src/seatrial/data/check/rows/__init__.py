"""Checks of rows: those that no instrument measured."""
