"""Extra agents for a block: `with_agents`. Its roles are names of the block only.

They are read like those of a task, but when the block is entered: what they are near to may read loop names too.
"""

from msgspec.structs import replace

from formiga_bt.lang.body import Body
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.naming import a_type
from formiga_bt.lang.steps.blocks import Readers
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.steps.roles import read_roles
from formiga_bt.lang.text.reading import read_mapping


def read_with_agents(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read the roles, then the steps that may use them."""
    node, mark = keys["with_agents"].value, keys["with_agents"].key.mark
    mapping = read_mapping(node, body.problems, "with_agents")
    if mapping is None:
        return None
    if not mapping.entries:
        body.problems.add(
            "E044",
            mapping.mark,
            "'with_agents' asks for nobody",
            f"such as: with_agents: {{relief: {{type: {a_type(body.world.catalogue)}}}}}",
        )
    before = frozenset(body.agents)
    outside = {
        name: body.gone.pop(entry.key.text) for entry in mapping.entries if (name := entry.key.text) in body.gone
    }
    roles = read_roles(body, mapping, block=True)
    entry = body.flow.copy()
    steps = read.steps(body, keys["steps"].value, "steps", "steps") if "steps" in keys else ()
    found = {}
    for name, role in roles.items():
        found[name] = replace(role, actions=tuple(body.needs.pop(name, ())))
        if name not in body.used:
            body.problems.unused(role.mark, "role", name)
    body.gone.update(outside)
    for name in [name for name in body.agents if name not in before]:
        del body.agents[name], body.names[name]
        body.lists.pop(name, None)
        body.flow.released.pop(name, None)
        what = f"'{name}' is only held inside with_agents ({mark.said})"
        body.gone[name] = ("E023", what, "move the step into its steps")
    return {"roles": found, "steps": steps, "fresh": body.flow.first_saved(entry)}
