"""Configuration of the documentation site: `make docs` builds it in build/site."""

from __future__ import annotations

import os
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent / "site"), str(Path(__file__).parents[1] / "src")]

from seatrial import __version__  # noqa: E402 -- from this checkout

project, author, release, version = "seatrial", "The seatrial authors", __version__, __version__
copyright = "The seatrial authors, MIT licence"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "sphinx_design",
              "sphinx_copybutton", "mathml", "generate"]  # fmt: skip
exclude_patterns = ["site"]

html_theme = "pydata_sphinx_theme"
html_title = f"seatrial {release}"  # with "documentation" behind it the header of a phone was wider than the phone
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_show_sphinx = False
# Other versions of the site beside this one, told by docs/site/whole.py: plain links, which work from a folder too.
html_context = {"versions": os.environ.get("SEATRIAL_DOCS", "").split()}
templates_path = ["site"]
html_theme_options = {"navigation_with_keys": False, "show_toc_level": 2, "secondary_sidebar_items": ["page-toc"],
                      "search_bar_text": "Search", "footer_end": [],
                      "navbar_end": ["theme-switcher", *["versions"] * bool(html_context["versions"])]}  # fmt: skip
myst_enable_extensions = ["colon_fence", "dollarmath", "attrs_block"]
myst_heading_anchors = 4
myst_dmath_allow_labels = False
copybutton_prompt_text = "$ "
# Notebooks are kept as they ran, and tests/test_notebooks.py runs them: a build needs no compiler.
nb_execution_mode = "off"
# A name that a room offers and `seatrial` offers too has two places; either is right.
suppress_warnings = ["ref.python"]

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True
napoleon_google_docstring, napoleon_numpy_docstring = True, False
napoleon_use_ivar = True
