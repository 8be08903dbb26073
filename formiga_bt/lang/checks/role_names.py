"""W097: a role that is called like an agent type that it is not of."""

from formiga_bt.lang.model import Catalogue, Task
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import all_roles


def check_role_names(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report W097 for the roles of a task and of its blocks."""
    for role in all_roles(task):
        kind = catalogue.types.get(role.name)
        if kind is None or not role.types:
            continue
        of = [catalogue.types[one] for one in role.types if one in catalogue.types]
        if not any(one.name == role.name or role.name in one.extends or one.name in kind.extends for one in of):
            shown = " or ".join(role.types)
            what = f"'{role.name}' is of type {shown}, and there is a type {role.name}"
            problems.add("W097", role.mark, what, f"type: {role.name}, or another name for the role")
