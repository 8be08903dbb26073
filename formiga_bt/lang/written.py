"""What stands in the nodes of steps before they are read: all scalars, and the names that they save or set."""

from collections.abc import Iterator

from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar


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
            elif entry.key.text not in ("with", "track", "set", "retry", "clears", "form"):
                yield from saves(entry.value)


def writes(node: Node) -> frozenset[str]:
    """Return the names that the steps of a node may write: saved ones and vars."""
    return frozenset(at.text for at in saves(node)) | frozenset(at.text for at in sets(node))


def sets(node: Node) -> list[Scalar]:
    """Return the names of vars that the steps of a node assign, in file order."""
    return [entry.key for entry in _assigned(node)]


def empties(node: Node) -> frozenset[str]:
    """Return the names of vars whose value the steps of a node take: `set: {best: null}`."""
    return frozenset(entry.key.text for entry in _assigned(node) if is_null(entry.value))


def is_null(node: Node) -> bool:
    """Return whether a node is YAML's `null`."""
    return isinstance(node, Scalar) and not node.quoted and node.text in ("~", "null")


def _assigned(node: Node) -> Iterator[Entry]:
    if isinstance(node, Listing):
        for item in node.items:
            yield from _assigned(item)
    elif isinstance(node, Mapping_):
        for entry in node.entries:
            if entry.key.text == "set" and isinstance(entry.value, Mapping_):
                yield from entry.value.entries
            elif entry.key.text == "cases" and isinstance(entry.value, Mapping_):  # its keys are values, not words
                for case in entry.value.entries:
                    yield from _assigned(case.value)
            elif entry.key.text not in ("with", "track", "retry", "clears", "form"):
                yield from _assigned(entry.value)
