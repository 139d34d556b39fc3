"""Draws of the posterior of a fit, as `identify --sample` asks for them."""
