"""Style and script of the page that `show.tree.html` makes, put into it as they are."""
