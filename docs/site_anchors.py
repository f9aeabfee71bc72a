"""Anchors of the site: those that source pages link to, and a warning about links to missing ones."""

import re
from html import unescape
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util import logging


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the anchors, and check those of the finished pages."""
    app.connect("doctree-read", _add_anchors)
    app.connect("build-finished", _check_anchors)
    return {"parallel_read_safe": True}


def _add_anchors(_app: Sphinx, doctree: nodes.document) -> None:
    """Add ``flockesc_env.NAME`` to the anchors of every name.

    ``sphinx.ext.viewcode`` takes one prefix for all names of a source file, also where the reference has some
    as ``flockesc_env.NAME`` and others as ``flockesc_env.policies.NAME``.
    """
    for signature in doctree.findall(addnodes.desc_signature):
        anchor = f"flockesc_env.{signature['fullname']}"
        if anchor not in signature["ids"]:
            signature["ids"].append(anchor)


def _check_anchors(app: Sphinx, error: Exception | None) -> None:
    if error:
        return
    pages = {path.resolve(): path.read_text("utf-8") for path in Path(app.outdir).rglob("*.html")}
    anchors = {path: set(map(unescape, re.findall(r'\bid="([^"]+)"', text))) for path, text in pages.items()}
    for page, text in pages.items():
        for name, anchor in re.findall(r'href="([^":#?]*)#([^"]+)"', text):
            target = (page.parent / name).resolve() if name else page
            if unescape(anchor) not in anchors.get(target, ()):
                where = page.relative_to(Path(app.outdir).resolve())
                logging.getLogger(__name__).warning(
                    "%s: link to the missing anchor %s#%s", where, name, anchor
                )
