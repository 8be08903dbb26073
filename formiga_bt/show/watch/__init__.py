"""The terminal dashboard of `formiga watch`: what a site does now, and the orders of a person who watches it.

What is shown comes from a `show.source.Source`, orders leave through an `orders.Actor`; neither an engine nor a wire is known
here. `text`, `top`, `needs`, `tables` and `picture` make lines of facts, `guards` decides what an order must be asked first,
and `pane`, `app` put it on a screen with textual.
"""
