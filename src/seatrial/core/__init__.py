"""Foundations that every other room may import.

Contract: `parameters` has the meaning, values and freedom of a model's numbers; `symbolic` the element-wise functions
of physics, on floats and symbols; `errors` every error class, with one base; `files` writes results whole or not at
all; `version` is that of the package.  Import from these modules; the door exports nothing.
"""
