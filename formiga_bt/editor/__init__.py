"""What an editor asks while a file is written: diagnostics, completion, hover, definitions, names, symbols.

Everything but `server` is plain functions over text and a position, so that it can be tested without a client.
`where` says in which mapping or list a position is, also where the text is no YAML yet; `grammar` says what may stand
there; `project` holds the open files and what the last check saw; `server` speaks the Language Server Protocol.
"""
