"""Equations as MathML, which browsers draw themselves: no script, no font and no request from outside."""

from __future__ import annotations

from typing import Any

from latex2mathml.converter import convert


def _inline(translator: Any, node: Any) -> None:
    import docutils.nodes

    translator.body.append(convert(node.astext()))
    raise docutils.nodes.SkipNode


def _display(translator: Any, node: Any) -> None:
    import docutils.nodes

    translator.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    raise docutils.nodes.SkipNode


def setup(app: Any) -> dict[str, Any]:
    """Name the renderer `mathml`, for html_math_renderer."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
