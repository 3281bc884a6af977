"""Settings of the documentation: ``sphinx-build -W docs docs/_build/html``."""

from __future__ import annotations

import re
from importlib.util import find_spec

from stokesfibers.core.version import __version__

project = "stokesfibers"
author = "The stokesfibers developers"
project_copyright = "The stokesfibers developers, BSD-3-Clause"
release = version = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "myst_nb",
    "sphinx_click",
    "sphinx_gallery.gen_gallery",
]
if find_spec("sphinx-mathjax-offline"):  # formulas without a network, if it is installed
    extensions.append("sphinx-mathjax-offline")

exclude_patterns = ["_build", "gallery/*.ipynb", "gallery/*.py"]
default_role = "literal"  # single backticks in docstrings name code
smartquotes = False  # "--out" stays as it is

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 4
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 600

autodoc_typehints = "none"  # the docstrings say shapes and units, which types do not
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_attr_annotations = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "capture_repr": (),
    "download_all_examples": False,
    "min_reported_time": 1e9,  # a busy machine would change the pages
    "plot_gallery": "True",
    "reference_url": {},
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
}

html_theme = "furo"
html_title = f"stokesfibers {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#08589e", "color-brand-content": "#08589e"},
    "dark_css_variables": {"color-brand-primary": "#7db8e8", "color-brand-content": "#7db8e8"},
    "navigation_with_keys": True,
}

_LITERAL = re.compile(r"(``.*?``|`[^`]*`|:\w+:`[^`]*`)")


def _keep_bars_and_stars(_app, _what, _name, _obj, _options, lines):
    """Escape what docstrings write as formulas, |x_s| and x*, and docutils reads as markup."""
    for k, line in enumerate(lines):
        parts = _LITERAL.split(line)
        for i in range(0, len(parts), 2):
            text = re.sub(r"(?<!\\)\|", r"\\|", parts[i])
            text = re.sub(r"(?<![\\*])\*(?!\*)(?=\w|\])", r"\\*", text)
            parts[i] = re.sub(r"(\w)_(?=[\s,.;)\]'^]|$)", r"\1\\_", text)
        lines[k] = "".join(parts)


def setup(app):
    """Connect the hook that runs before the docstrings are parsed (napoleon runs at 500)."""
    app.connect("autodoc-process-docstring", _keep_bars_and_stars, priority=400)
