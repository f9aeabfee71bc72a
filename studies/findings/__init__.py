"""From training runs to docs/findings.md: rows, tables, figures, the page."""
