"""Anchors of the site: those that source pages link to, and a warning about links to missing ones."""

import re
from html import unescape
from itertools import accumulate
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util import logging

_WRITTEN: set[str] = set()
"""Pages of this build; the folder can have pages of earlier ones."""


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the anchors, and check those of the finished pages."""
    app.connect("doctree-read", _add_anchors)
    app.connect("html-page-context", lambda _app, page, *_: _WRITTEN.add(page))
    app.connect("build-finished", _check_anchors)
    return {"parallel_read_safe": True, "parallel_write_safe": False}


def _add_anchors(_app: Sphinx, doctree: nodes.document) -> None:
    """Add an anchor for every package above its module, and one for the policies, to every name.

    ``sphinx.ext.viewcode`` takes one prefix for all names of a source file, also where the reference has some
    as ``flockesc_env.NAME`` and others as ``flockesc_env.policies.NAME``.
    """
    for signature in doctree.findall(addnodes.desc_signature):
        above = accumulate((signature["module"] or "flockesc_env").split("."), "{}.{}".format)
        for package in (*above, "flockesc_env.policies"):
            anchor = f"{package}.{signature['fullname']}"
            if anchor not in signature["ids"]:
                signature["ids"].append(anchor)


def _check_anchors(app: Sphinx, error: Exception | None) -> None:
    if error:
        return
    folder = Path(app.outdir).resolve()
    pages = {path: path.read_text("utf-8") for path in folder.rglob("*.html")}
    anchors = {path: set(map(unescape, re.findall(r'\bid="([^"]+)"', text))) for path, text in pages.items()}
    for name in sorted(_WRITTEN):
        page = folder / f"{name}.html"
        for link, anchor in re.findall(r'href="([^":#?]*)#([^"]+)"', pages[page]):
            target = (page.parent / link).resolve() if link else page
            if unescape(anchor) not in anchors.get(target, ()):
                text = "%s: link to the missing anchor %s#%s"
                logging.getLogger(__name__).warning(text, name, link, anchor)
