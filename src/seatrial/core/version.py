"""Version of the package, as pyproject.toml has it; named in reports, and part of what marks a fit."""

__version__ = "0.3.0"
