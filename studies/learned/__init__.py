"""From training runs to docs/results.md: rows, tables, figures, the page."""
