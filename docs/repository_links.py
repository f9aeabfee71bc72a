"""Links that work on GitHub but not in MyST: to HTML anchors, folders and pages outside the site."""

import re
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform

ROOT = Path(__file__).parents[1]


class RepositoryLinks(SphinxTransform):
    """Makes HTML anchors targets. Makes links to folders, and from the README to other files, plain text."""

    default_priority = 800  # before MyST resolves links

    def apply(self, **_: Any) -> None:
        """Replace anchors and links."""
        for html in list(self.document.findall(nodes.raw)):
            if anchor := re.match(r'<a id="([^"]+)">', html.astext()):
                target = nodes.target(ids=[anchor[1]], names=[anchor[1]])
                self.document.note_explicit_target(target)
                html.replace_self(target)
        here = Path(self.env.doc2path(self.env.docname)).parent
        for link in list(self.document.findall(addnodes.pending_xref)):
            path = link["reftarget"]
            if notebook := re.fullmatch(r"examples/(\w+)\.ipynb", path):
                page = f"generated/notebooks/{notebook[1]}"
                link.attributes.update(refdomain="doc", reftarget=page, reftargetid=None)
            elif link["reftype"] == "myst" and (_is_outside(here, link) or (ROOT / path).is_file()):
                link.replace_self(link.children)


def _is_outside(here: Path, link: addnodes.pending_xref) -> bool:
    """Return whether a link leads to a folder, or to a Markdown file that is no page of the site."""
    path = (here / link["reftarget"]).resolve()
    is_page = link.get("refdomain") == "doc" or path.suffix == ".md"
    return path.is_dir() or (is_page and ROOT / "docs" not in path.parents)


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the rules to Sphinx."""
    app.add_transform(RepositoryLinks)
    app.connect("source-read", _shorten)
    return {"parallel_read_safe": True}


def _shorten(_app: Sphinx, _docname: str, source: list[str]) -> None:
    """Shorten links out of the folder and back, and to notebooks and reports, which the site copies."""
    text = source[0].replace("](../docs/", "](")
    # A link to a page says what the page is about; on GitHub, its text is the name of the file.
    text = re.sub(r"\[([\w-]+)\.md\](?=\([\w-]+\.md)", lambda link: f"[{link[1].replace('-', ' ')}]", text)
    text = re.sub(
        r"\]\(\.\./(?:results/(\w+)|(speed)/results)/README\.md", r"](generated/reports/\1\2.md", text
    )
    source[0] = re.sub(r"\]\(\.\./examples/(\w+\.ipynb)\)", r"](generated/notebooks/\1)", text)
