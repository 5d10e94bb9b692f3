"""Parts of a self-contained HTML page: text, tables, charts and a style sheet."""
