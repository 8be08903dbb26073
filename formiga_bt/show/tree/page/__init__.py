"""Style and script of the page that `show.html` makes, put into it as they are."""
