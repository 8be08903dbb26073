"""What stands in the nodes of steps before they are read: all scalars, and the names that they save or set."""

from collections.abc import Iterator

from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar


def scalars(node: Node) -> Iterator[Scalar]:
    """Iterate over all scalars of a node, keys left out."""
    if isinstance(node, Scalar):
        yield node
    elif isinstance(node, Listing):
        for item in node.items:
            yield from scalars(item)
    else:
        for entry in node.entries:
            yield from scalars(entry.value)


def saves(node: Node) -> Iterator[Scalar]:
    """Iterate over the names that the steps of a node save, in file order."""
    if isinstance(node, Listing):
        for item in node.items:
            yield from saves(item)
    elif isinstance(node, Mapping_):
        for entry in node.entries:
            if entry.key.text in ("save_as", "collect", "first") and isinstance(entry.value, Scalar):
                yield entry.value
            elif entry.key.text == "cases" and isinstance(entry.value, Mapping_):  # its keys are values, not words
                for case in entry.value.entries:
                    yield from saves(case.value)
            elif entry.key.text not in ("with", "set", "retry", "clears", "form"):
                yield from saves(entry.value)


def writes(node: Node) -> frozenset[str]:
    """Return the names that the steps of a node may write: saved ones and vars."""
    return frozenset(at.text for at in saves(node)) | frozenset(at.text for at in sets(node))


def sets(node: Node) -> list[Scalar]:
    """Return the names of vars that the steps of a node assign, in file order."""
    if isinstance(node, Listing):
        return [at for item in node.items for at in sets(item)]
    if not isinstance(node, Mapping_):
        return []
    found: list[Scalar] = []
    for entry in node.entries:
        if entry.key.text == "set" and isinstance(entry.value, Mapping_):
            found += [one.key for one in entry.value.entries]
        elif entry.key.text == "cases" and isinstance(entry.value, Mapping_):  # its keys are values, not words
            found += [at for case in entry.value.entries for at in sets(case.value)]
        elif entry.key.text not in ("with", "retry", "clears", "form"):
            found += sets(entry.value)
    return found
