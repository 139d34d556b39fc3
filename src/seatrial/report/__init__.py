"""Reports: self-contained pages, and the same numbers as JSON.

Contract: a `Page` is a title with `Section` values (title, body, numbers), and `write` writes it whole.  One module a
page: report (fits and validations; its evidence and sections), tuning, series (tables of fits), rivals (virtual
studies), imo, requirements, coverage; identifiability makes sections; `figures` has the canvas and the palette.
"""

from .page import Page, ReportError, Section, write

__all__ = ["Page", "ReportError", "Section", "write"]
