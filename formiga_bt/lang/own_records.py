"""Records that a file declares under `records`: names that are types like any other.

A record is known by its fields, not by its name: two files may each declare it, and hand values to one another.
"""

from collections.abc import Mapping

from formiga_bt.lang.actions import check_readable, read_optional_mapping
from formiga_bt.lang.files import Unit
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import RECORD_FIELD
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.params import SIMPLE, read_type
from formiga_bt.lang.text.document import Entry, Mapping_, Node
from formiga_bt.lang.text.reading import Problems, quoted_list, read_mapping, read_name
from formiga_bt.lang.types import ANY, Type, record_of


def read_records(node: Node, problems: Problems, known: Mapping[str, Type]) -> dict[str, Type]:
    """Return the records of one file by name; each may have those above it, and those of `known`, as fields."""
    found: dict[str, Type] = {}
    mapping = read_mapping(node, problems, "records")
    for entry in mapping.entries if mapping is not None else ():
        at = read_name(entry.key, problems, "records")
        if at is None:
            continue
        if at.text in (*SIMPLE, "enum", "list", "record"):
            problems.add("E018", at.mark, f"'{at.text}' is a type of the language", "choose another name")
            continue
        before = len(problems.found)
        fields = _read_fields(entry, problems, {**known, **found})
        if at.text in known and known[at.text] != fields:
            what = f"a record '{at.text}' with other fields is known here already: {quoted_list(known[at.text].fields)}"
            problems.add("E018", at.mark, what, "choose another name, or take it away and use that one")
        found[at.text] = ANY if problems.has_errors(before) else fields
    return found


def _read_fields(entry: Entry, problems: Problems, records: Mapping[str, Type]) -> Type:
    fields: dict[str, Type] = {}
    mapping = read_optional_mapping(entry.value, problems, entry.key.text)
    for one in mapping.entries if mapping is not None else ():
        if read_name(one.key, problems, entry.key.text) is None:
            continue
        check_readable(one.key, problems)
        fields[one.key.text] = _read_field(one, problems, records)
    if mapping is not None and not mapping.entries:
        problems.add("E044", entry.key.mark, f"record '{entry.key.text}' has no fields", "such as: {spot: place}")
    return record_of(**fields)


def _read_field(entry: Entry, problems: Problems, records: Mapping[str, Type]) -> Type:
    node = entry.value
    if not isinstance(node, Mapping_) or node.get("list") is not None:
        of = read_type(node, problems, records)
    else:
        keys = read_keys(node, RECORD_FIELD, problems, f"field '{entry.key.text}'")
        of = read_type(keys["type"].value, problems, records) if "type" in keys else ANY
        if of.name == "enum" and "values" in keys:
            of = Type("enum", values=tuple(keys.words("values")))
    if of.name == "enum" and not of.values:
        problems.add("E008", node.mark, "an enum needs 'values'", "{type: enum, values: [a, b]}")
        return ANY
    if of.name == "agent":
        problems.add("E008", node.mark, "a record holds no agents", "keep its id (text), or what is known of it")
        return ANY
    return of


def records_of(unit: Unit, catalogue: Catalogue, problems: Problems) -> dict[str, Type]:
    """Return the records that a file may use: its own, those of the libraries that it imports, and the catalogue's."""
    known = dict(catalogue.records)
    for _, imported in unit.imports:
        known.update(records_of(imported, catalogue, Problems()))
    entry = unit.keys.get("records")
    return {**known, **(read_records(entry.value, problems, known) if entry is not None else {})}
