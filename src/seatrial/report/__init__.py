"""Reports: what was found, as blocks that a page, a terminal, a notebook and JSON draw.

Contract: a `page.Page` is a title with `Section` values (title, a body of `blocks`), and `page.write` writes
it whole.  One module a page: report (fits and validations; its evidence and sections), tuning, series (tables of
fits), rivals (virtual studies), imo, requirements, coverage; identifiability makes sections; `figures` has the canvas
and the palette.
"""
