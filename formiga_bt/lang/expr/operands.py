"""Operators of expressions: signs, arithmetic, conditions, choices, lists and comparisons, typed and built.

The middle layer of the expression checker, between `parts` and `checker`.
"""

import ast
from itertools import pairwise

from formiga_bt.lang.expr.operators import SYMBOLS, all_code, any_code, arithmetic_code, compare_code
from formiga_bt.lang.expr.parts import NOW, Compared, Parts, facts, reads_of
from formiga_bt.lang.expr.typed import Mismatch, Run, Typed, closest, is_measure, mismatch, sure_of, unit_choices
from formiga_bt.lang.expr.typing_rules import QUANTITIES, arithmetic, comparable, in_words, is_truth, join, never_equal
from formiga_bt.lang.model import Dependency
from formiga_bt.lang.types import ANY, BOOL, Type, list_of


class Operands(Parts):
    """Checks every node that is an operator."""

    def unary(self, node: ast.UnaryOp) -> Typed:
        """Check `-x`, `+x`, `not x`."""
        part = self.visit(node.operand)
        run = part.run
        if isinstance(node.op, ast.Not):
            if not self._truth(part, "not"):
                return self.poison(node, part.reads)
            return self.made(node, BOOL, lambda env: not run(env), [part])
        if not is_measure(part.type) or part.type.name == "time":
            sign = "-" if isinstance(node.op, ast.USub) else "+"
            return self.bad(node, "E013", f"{in_words(part.type)} takes no sign '{sign}'", reads=part.reads)
        code: Run = (lambda env: -run(env)) if isinstance(node.op, ast.USub) else (lambda env: +run(env))
        made = self.made(node, part.type, code, [part])
        return self.part(node, made.type, made.run, made.reads, const=made.const, literal=part.literal)

    def _truth(self, part: Typed, where: str) -> bool:
        if is_truth(part.type):
            return True
        self.wrong(part, Mismatch("E013", f"'{where}' joins conditions, this is {in_words(part.type)}"))
        return False

    def binary(self, node: ast.BinOp) -> Typed:
        """Check arithmetic."""
        op = SYMBOLS[type(node.op)]
        left, right = self.visit(node.left), self.visit(node.right)
        type_ = arithmetic(op, left.type, right.type)
        if type_ is None:
            self._no_arithmetic(node, op, left, right)
            return self.poison(node, left.reads + right.reads)
        return self.made(node, type_, arithmetic_code(op, left, right), [left, right])

    def _no_arithmetic(self, node: ast.BinOp, op: str, left: Typed, right: Typed) -> None:
        for part, other in ((left, right), (right, left)):
            if op in "+-" and part.literal == "number" and other.type.name in QUANTITIES:
                return self.wrong(part, mismatch(part, other.type, self.scope))
        a, b = in_words(left.type), in_words(right.type)
        said = {
            "+": f"cannot add {a} and {b}",
            "-": f"cannot subtract {b} from {a}",
            "*": f"cannot multiply {a} by {b}",
        }.get(op, f"cannot divide {a} by {b}")
        mend = "both must be of one kind, or one of them a number" if op in "*/" else "both must be of one kind"
        if "text" in (left.type.name, right.type.name) or left.literal == "text" or right.literal == "text":
            mend = 'texts are joined by writing them in one: "${a} and ${b}"'
        if op == "+" and left.type.name == "list":
            mend = f"write {'concat' if right.type.name == 'list' else 'append'}({left.source}, {right.source})"
        self.bad(node, "E013", said, mend)
        return None

    def logic(self, node: ast.BoolOp) -> Typed:
        """Check `and` and `or`; what the left side proves holds on the right."""
        word = "and" if isinstance(node.op, ast.And) else "or"
        outer, parts, good = self.known_set, [], True
        for value in node.values:
            part = self.visit(value)
            good = self._truth(part, word) and good
            parts.append(part)
            when_true, when_false = facts(value, self.parsed)
            self.known_set |= when_true if word == "and" else when_false
        self.known_set = outer
        runs = [part.run for part in parts]
        run = all_code(runs) if word == "and" else any_code(runs)
        if not good:
            return self.poison(node, reads_of(parts))
        return self.made(node, BOOL, run, parts)

    def choice(self, node: ast.IfExp) -> Typed:
        """Check `a if c else b`."""
        outer = self.known_set
        test = self.visit(node.test)
        when_true, when_false = facts(node.test, self.parsed)
        self.known_set = outer | when_true
        then = self.visit(node.body)
        self.known_set = outer | when_false
        other = self.visit(node.orelse)
        self.known_set = outer
        parts = [test, then, other]
        reads = reads_of(parts)
        if not self._truth(test, "if"):
            return self.poison(node, reads)
        type_ = join(then.type, other.type)
        if type_ is None:
            said = f"both results must be of one type, these are {in_words(then.type)} and {in_words(other.type)}"
            return self._disagree(node, [then, other], said, reads)
        c, a, b = test.run, then.run, other.run
        return self.made(node, type_, lambda env: a(env) if c(env) else b(env), parts)

    def _disagree(self, node: ast.expr, parts: list[Typed], said: str, reads: tuple[Dependency, ...]) -> Typed:
        """Report values that should be of one type: a unit or a height is missing more often than a type is wrong."""
        first, second = parts
        for part, other in ((second, first), (first, second)):
            why = mismatch(part, other.type, self.scope)
            if why.code in ("E017", "E066"):
                self.wrong(part, why)
                return self.poison(node, reads)
        return self.bad(node, "E013", said, reads=reads)

    def items(self, node: ast.List) -> Typed:
        """Check a list in square brackets."""
        parts = [self.visit(item) for item in node.elts]
        reads = reads_of(parts)
        item: Type | None = parts[0].type if parts else ANY
        for before, part in pairwise(parts):
            item = join(item or ANY, part.type)
            if item is None:
                said = (
                    f"the items of a list are of one type, these are {in_words(before.type)} and {in_words(part.type)}"
                )
                return self._disagree(node, [before, part], said, reads)
        runs = [part.run for part in parts]
        return self.made(node, list_of(item or ANY), lambda env: tuple([run(env) for run in runs]), parts)

    def comparison(self, node: ast.Compare) -> Typed:
        """Check a comparison, chained or not."""
        sides = (node.left, *node.comparators)
        parts = [self.visit(part) for part in sides]
        runs: list[Run] = []
        good = True
        for index, operator in enumerate(node.ops):
            left, right = parts[index], parts[index + 1]
            op = SYMBOLS.get(type(operator), "==")
            good = self._compared(node, op, left, right) and good
            runs.append(compare_code(op, left, right))
            if NOW in left.reads + right.reads:
                self.compared.append(
                    Compared(op, (sides[index], sides[index + 1]), left, right, runs[-1], self.of_items)
                )
        if not good:
            return self.poison(node, reads_of(parts))
        return self.made(node, BOOL, runs[0] if len(runs) == 1 else all_code(runs), parts)

    def _compared(self, node: ast.Compare, op: str, left: Typed, right: Typed) -> bool:
        if "any" in (left.type.name, right.type.name):
            return True
        if op in ("in", "not in"):
            return self._member(node, left, right)
        if not comparable(left.type, right.type, ordered=op not in ("==", "!=")):
            self._not_comparable(node, op, left, right)
            return False
        if never_equal(left.type, right.type):
            self._never(left, right)
            return False
        for part, other in ((left, right), (right, left)):
            is_charge = part.type.name == "percent" and part.source.endswith(".battery")
            if is_charge and other.literal == "quantity" and not 0 <= other.const <= 100:
                self.wrong(other, Mismatch("E062", f"a battery holds 0 % to 100 %, never {other.source}"))
                return False
        return True

    def _member(self, node: ast.Compare, left: Typed, right: Typed) -> bool:
        if right.type.name != "list":
            mend = f"write inside({left.source}, {right.source})" if right.type.name == "region" else "in [a, b]"
            self.bad(node, "E013", f"'in' looks into a list, this is {in_words(right.type)}", mend)
            return False
        item = right.type.item or ANY
        if not comparable(left.type, item, ordered=False):
            self.bad(node, "E013", f"cannot find {in_words(left.type)} in {in_words(right.type)}")
            return False
        if left.type.name == "enum" and item.name == "literal":
            wrong = [value for value in item.values if value not in left.type.values]
            if wrong:
                start = right.start + right.source.find(wrong[0])
                self._impossible(wrong[0], left.type, start - 1, start + len(wrong[0]) + 1)
                return False
        if never_equal(left.type, item):
            self._never(left, right)
            return False
        return True

    def _not_comparable(self, node: ast.Compare, op: str, left: Typed, right: Typed) -> None:
        for part, other in ((right, left), (left, right)):
            if part.literal == "number" and other.type.name in QUANTITIES:
                choices = unit_choices(other.type.name, part.source)
                first = choices.split(" or ")[0]
                said = f"'{other.source}' is {in_words(other.type)}: {choices}?"
                return self.wrong(part, Mismatch("E017", said, f"write {choices}", first))
            if part.literal == "quantity" and other.type.name in QUANTITIES:
                return self.wrong(part, mismatch(part, other.type, self.scope, f"'{other.source}'"))
        verb = "compare" if op in ("==", "!=") else "order"
        a, b = in_words(left.type), in_words(right.type)
        agents = [part for part in (left, right) if part.type.name == "agent"]
        mend = f"compare {agents[0].source}.id" if len(agents) == 1 else ""
        kinds = {left.type.name, right.type.name}
        if "time" in kinds and kinds & {"text", "literal"}:
            mend = "a text is no time: write today('06:30'), or make it a parameter of type time"
        records = [part for part in (left, right) if part.type.name == "record" and part.type.fields]
        if not mend and len(records) == 1:
            mend = (
                f"compare a field of it: {', '.join(f'{records[0].source}.{name}' for name in records[0].type.fields)}"
            )
        self.bad(node, "E013", f"cannot {verb} {a} and {b}", mend)
        return None

    def _never(self, left: Typed, right: Typed) -> None:
        for part, other in ((right, left), (left, right)):
            if part.literal == "text" and other.type.name == "enum":
                return self._impossible(str(part.const), other.type, part.start, part.end)
        said = f"'{left.source}' and '{right.source}' are never equal"
        self.problems.report("E014", left.start, right.end, said, f"{in_words(left.type)}; {in_words(right.type)}")
        return None

    def _impossible(self, word: str, of: Type, start: int, end: int) -> None:
        near = closest(word, of.values)
        said = f"'{word}' is never possible here" + (f"; did you mean '{near}'?" if near else "")
        sure = sure_of(word, of.values)
        mended = f"'{sure}'" if sure else None
        self.problems.report("E014", start, end, said, "one of " + ", ".join(of.values), mended=mended)
