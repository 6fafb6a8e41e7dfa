"""How the guide is built; nothing in it needs a network to be read."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import slewctl

project = "slewctl"
author = "The slewctl developers"
release = slewctl.__version__
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_nb",
    "notebooks",
    "mathml",
    "registries",
    "pictures",
]
# The first one is that of the pages that autosummary writes.
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
exclude_patterns = ["_build", "_ext", "_templates"]
html_static_path = ["_static"]
html_css_files = ["guide.css"]
templates_path = ["_templates"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 2
# The gallery is run whenever the guide is built; what fails in it fails the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True
nb_ipywidgets_js = {}  # none are shown, and their scripts would come from a network
autosummary_generate = True
autodoc_typehints = "none"
numpydoc_show_class_members = False
suppress_warnings = ["config.cache"]
html_theme = "pydata_sphinx_theme"
html_title = f"slewctl {release}"
html_show_sourcelink = False
html_copy_source = False
html_sidebars = {"**": ["guide-nav"]}
html_theme_options = {
    "navbar_center": [],  # the sidebar has all pages
    "navbar_end": ["theme-switcher"],
    "footer_end": [],
    "show_prev_next": True,
}
