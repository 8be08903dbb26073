"""Wide wordings, with the keys of the plain tables: see `speaker.widened`."""
