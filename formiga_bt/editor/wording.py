"""What a kind, an option, a field, a param or a name is, in the words of hover texts and proposals."""

from formiga_bt.base.units import LIKELY, UNITS, format_number, format_quantity
from formiga_bt.lang.expr.helpers import REQUIRED, Helper
from formiga_bt.lang.kinds import Option, StepKind
from formiga_bt.lang.model import ActionSpec, AgentType, Expr, FieldSpec, Param
from formiga_bt.lang.types import Type

_FORMS = {
    "action": "role.Action",
    "text": "text",
    "words": "a list of words",
    "flag": "true or false",
    "cond": "a condition",
    "expr": "an expression",
    "name": "a name",
    "roles": "a list of roles",
    "map": "names and values",
    "steps": "a list of steps",
}


def type_words(option: Option) -> str:
    """Return what the value of an option is: `duration`, `low or high`, `a list of steps`."""
    if option.values:
        return " or ".join(option.values)
    if option.keys and option.form == "options":
        return "{" + ", ".join(key.name for key in option.keys) + "}"
    return option.type or _FORMS.get(option.form, "")


def typed(of: Type) -> str:
    """Return a type with the units in which it is written."""
    units = [unit for unit, (name, _) in UNITS.items() if name == of.name]
    return f"{of} ({', '.join(units)})" if units else str(of).replace("$", "")


def default_of(expr: Expr | None) -> str:
    """Return a default as it is written."""
    return expr.source.removeprefix("${").removesuffix("}") if expr is not None else ""


def _bounds(of: Type, low: float | None, high: float | None) -> list[str]:
    shown = [(word, bound) for word, bound in (("min", low), ("max", high)) if bound is not None]
    known = of.name in LIKELY
    return [f"{word} {format_quantity(of.name, bound) if known else format_number(bound)}" for word, bound in shown]


def field_line(spec: FieldSpec) -> str:
    """Return the type of a field with its default and range, on one line."""
    notes = [str(spec.type), *_bounds(spec.type, spec.min, spec.max)]
    if spec.default is not None:
        notes.append(f"default {default_of(spec.default)}")
    elif spec.optional:
        notes.append("optional")
    return ", ".join(notes)


def param_line(param: Param) -> str:
    """Return the type of a param with its default and range, on one line."""
    notes = [str(param.type)]
    notes += [f"{word} {default_of(bound)}" for word, bound in (("min", param.min), ("max", param.max)) if bound]
    if param.default is not None:
        notes.append(f"default {default_of(param.default)}")
    elif param.optional:
        notes.append("optional")
    return ", ".join(notes)


def about_option(option: Option, owner: str) -> str:
    """Return the hover text of an option."""
    needs = " (required)" if option.required else ""
    shown = type_words(option)
    head = f"**{option.name}**: {shown}{needs}" if shown else f"**{option.name}**{needs}"
    keys = "".join(f"\n- `{key.name}`: {type_words(key)}. {key.doc}" for key in option.keys)
    return f"{head}\n\n{option.doc}{keys}\n\n*{owner}*"


def about_kind(kind: StepKind) -> str:
    """Return the hover text of a step kind: what it does and what it may hold."""
    options = "".join(
        f"\n- `{o.name}`: {type_words(o)}{', required' if o.required else ''}. {o.doc}" for o in kind.options
    )
    return f"**{kind.name}**: {kind.type or _FORMS.get(kind.form, '')}\n\n{kind.doc}{options}"


def about_action(spec: ActionSpec) -> str:
    """Return the hover text of an action."""
    fields = "".join(f"\n- `{f.name}`: {field_line(f)}. {f.help}".rstrip() for f in spec.fields.values())
    gives = ", ".join(f"{name}: {of}" for name, of in spec.result.items())
    lines = [f"**{spec.name}**\n\n{spec.help}{fields}"]
    if gives:
        lines.append(f"Result: {gives}.")
    if spec.requires:
        lines.append(f"Only while {spec.requires}.")
    if spec.effect:
        lines.append(f"Afterwards {spec.effect}.")
    return "\n\n".join(lines)


def about_type(of: AgentType) -> str:
    """Return the hover text of an agent type."""
    more = f", extends {', '.join(of.extends)}" if of.extends else ""
    return f"**{of.name}**: agent type{more}\n\n{of.label}\n\nActions: {', '.join(of.actions) or 'none'}."


def about_helper(helper: Helper) -> str:
    """Return the hover text of a helper."""
    args = []
    for arg in helper.args:
        default = "" if arg.default is REQUIRED else f" = {arg.default:g}"
        args.append(f"{arg.name}{'...' if arg.rest else ''}: {str(arg.type).replace('$', '')}{default}")
    return f"```\n{helper.name}({', '.join(args)}) -> {str(helper.returns).replace('$', '')}\n```\n{helper.help}"
