"""formiga_bt: one task engine for teams of robots and people.

Tasks are YAML behaviour trees (`formiga_bt.lang`), compiled into py_trees behaviours (`formiga_bt.nodes`,
`formiga_bt.nodes.compile`), stepped by one deterministic engine (`formiga_bt.engine`) that reaches robots and people
through transports (`formiga_bt.transport`). Importing this package is cheap: nothing heavy is loaded here.
"""

__version__ = "0.1.0"
