"""The page of the study: an overview, and a section per part."""

from __future__ import annotations

from pathlib import Path

from studies.pages import path_from, render, signed
from studies.validation.results import ValidationResults, part


def markdown_page(results: ValidationResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the pictures in the folder ``figures``."""
    sections = []
    for name, measured in results.parts.items():
        module, found = part(name), measured.results
        section = render(
            f"validation/{name}.md",
            part=module,
            results=found,
            picture=path_from(page, figures / f"{name}.png"),
            signed=signed,
        )
        sections.append((module, module.here(found), module.verdict(found), measured, section.strip()))
    return render("validation/validation.md", sections=sections)
