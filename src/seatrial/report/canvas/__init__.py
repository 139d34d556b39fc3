"""The canvas of the pages: panels of figures, and a small frame for drawings of which a page has dozens; plain SVG.

Contract: the calls of `Axes` fill a `Figure`, and `svg` draws it; a `Frame` makes elements that its caller joins.
"""
