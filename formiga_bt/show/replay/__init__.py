"""The time machine over a journal: the site at any moment, the story of a task, a case for `formiga test` made of it.

`machine.TimeMachine` opens a journal; `source.JournalSource` is a `show.source.Source`, from which every picture is drawn.
Loaded only where a journal is looked at: it brings the database library.
"""
