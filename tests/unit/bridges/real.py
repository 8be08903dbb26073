"""The real BehaviorTree.CPP, through the package behaviortreepy: its nodes registered from a file's TreeNodesModel.

The package can register actions, conditions and decorators, but no ports and no control nodes: ports of registered nodes
become attributes that begin with an underscore (BT.CPP ignores them), and `Finally` becomes a `Sequence`. Everything else
is BT.CPP's own.
"""

from collections.abc import Callable
from typing import Any

from formiga_bt.bridges.elements import XmlElement, parse, write

KEPT = ("name", "ID")


def stripped(xml: str) -> tuple[str, dict[str, str]]:
    """Return the XML as the package can load it, and the nodes to register (name -> category)."""
    root = parse(xml.encode())
    models = next(child for child in root.children if child.tag == "TreeNodesModel")
    nodes = {node.get("ID"): node.tag for node in models.children if node.tag != "SubTree"}
    for element in root.walk():
        if element.tag in nodes and element not in models.children:
            element.attrs = {
                key if key[0] == "_" or key in KEPT else f"_port_{key}": v for key, v in element.attrs.items()
            }
            if nodes[element.tag] == "Control":
                element.tag = "Sequence"
    root.children = [child for child in root.children if child.tag == "BehaviorTree"]
    return write(root), {name: kind for name, kind in nodes.items() if kind != "Control"}


def load(xml: str, act: Callable[[str, str], bool]) -> tuple[Any, Any]:
    """Return the tree of an exported file, loaded by BT.CPP, and its factory (which must outlive it).

    Args:
        xml: of the exported file.
        act: says whether an action or condition (its node, its name) succeeds.
    """
    import behaviortreepy as bt

    text, nodes = stripped(xml)
    factory = bt.BehaviorTreeFactory()

    def callback(tag: str) -> Callable[..., Any]:
        return lambda node: bt.NodeStatus.SUCCESS if act(tag, node.name()) else bt.NodeStatus.FAILURE

    for name, kind in nodes.items():
        register = {
            "Action": factory.register_simple_action,
            "Condition": factory.register_simple_condition,
            "Decorator": factory.register_simple_decorator,
        }[kind]
        register(name, (lambda status, *_: status) if kind == "Decorator" else callback(name))
    factory.register_behavior_tree_from_text(text)
    main: XmlElement = parse(xml.encode())
    return factory.create_tree(main.get("main_tree_to_execute")), factory
