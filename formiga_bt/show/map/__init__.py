"""The site seen from above, with the ways of agents: `view` says what is seen, `text` and `figure` draw it."""
