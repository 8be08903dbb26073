"""The front door for assistants: what `formiga mcp` offers over the Model Context Protocol.

An assistant may look, check, fly in virtual time and propose; a person approves and runs. `tools` is the table of what is
offered, `judge` does what takes long in a process of its own (`worker`), `live` asks a running engine, `server` speaks the
protocol and is the only module that imports `mcp`.
"""
