"""Foundations: parameters, element-wise functions, errors.  Everything else may import from here."""
