"""A task as a picture: terminal, SVG, HTML, Mermaid; and the difference of two."""
