"""Sphinx configuration of the documentation site; ``make docs`` builds it in target/docs."""

import importlib.metadata
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "flockesc_env"
release = importlib.metadata.version("flockesc-env")
extensions = [
    "short_signatures",
    "environment_pages",
    "repository_links",
    "site_anchors",
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.intersphinx",
    "sphinx.ext.viewcode",
]
exclude_patterns = ["_templates"]

# Pages are the same on GitHub: anchors of headings are GitHub's, and a link to another file of the
# repository downloads a copy of the file.
myst_heading_anchors = 4
nb_execution_mode = "off"  # tests execute the notebooks

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
napoleon_use_ivar = True
python_maximum_signature_line_length = 90
python_use_unqualified_type_names = True

# Inventories of other projects are downloaded only if DOCS_ONLINE is set: a build needs no network. Without
# them, names of other projects are plain text.
ONLINE = {
    "python": "https://docs.python.org/3/",
    "numpy": "https://numpy.org/doc/stable/",
    "gymnasium": "https://gymnasium.farama.org/",
    "pettingzoo": "https://pettingzoo.farama.org/",
    "stable_baselines3": "https://stable-baselines3.readthedocs.io/en/master/",
    "polars": "https://docs.pola.rs/api/python/stable/",
}
if os.environ.get("DOCS_ONLINE"):
    intersphinx_mapping = {name: (url, None) for name, url in ONLINE.items()}
nitpicky = True
INTERNAL = "ObsType|FlockBatch|LineEpisode|Outcome|ActionOptions|OptionsDict|Estimate"
nitpick_ignore_regex = [("py:.*", r"(?!flockesc_env\b).*"), ("py:.*", rf"flockesc_env\..*({INTERNAL})")]

html_theme = "furo"
html_title = f"flockesc_env {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_copyright = False

# The address of the site, for previews of links, which need a picture with an absolute address.
if html_baseurl := os.environ.get("SITE", ""):
    myst_html_meta = {
        "property=og:title": html_title,
        "property=og:image": f"{html_baseurl.rstrip('/')}/_images/learned.gif",
    }
