"""Tasks as JSON without free maps, for models that write with a schema at hand."""
