"""The typed Python client of a running engine; the commands use nothing else.

    from formiga_bt.client import connect

    engine = connect()                      # of this folder; or connect(url="http://10.0.0.5:8420")
    task = engine.request("PickUp", {"camp": "north"}, by="eve")
    print(engine.detail(task).task.status)

Answers are the facts of `formiga_bt.show.facts`. What a newer engine adds to them is passed over.
"""

from formiga_bt.client.calls import ApiError, NoEngine, UnknownId, segment
from formiga_bt.client.client import Client, PastClient
from formiga_bt.client.finding import connect

__all__ = ["ApiError", "Client", "NoEngine", "PastClient", "UnknownId", "connect", "segment"]
