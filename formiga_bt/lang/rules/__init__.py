"""Standing rules of a site (`rules:` in site.yaml, or files in `rules/` beside it), read and checked as tasks are."""
