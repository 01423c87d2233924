"""How Sphinx builds the documentation; nothing here reaches for the network."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "hdcal"
author = "the hdcal developers"
copyright = "2026, the hdcal developers"
version = release = installed_version("hdcal")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.doctest",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "mathml",
    "ranges",
    "schemas",
    "stiffness_pictures",
]
exclude_patterns = ["_build"]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "description"
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Class attributes", "params_style")]

# The browser draws the formulas itself, so that the pages read offline too.
html_math_renderer = "mathml"
html_theme = "pydata_sphinx_theme"
html_title = "hdcal"
html_static_path = ["_static"]
html_css_files = ["hdcal.css"]
html_show_sourcelink = False
# So few pages: all of them beside the text, none in the bar above it.
html_sidebars = {"**": ["globaltoc.html"]}
html_theme_options = {
    "navbar_center": [],
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_toc_level": 2,
}
