"""`Refused`: what everything behind the API raises when it cannot serve a caller."""

from collections.abc import Iterable, Sequence

from formiga_bt.base.errors import TaskError


class Refused(TaskError):  # noqa: N818 - it names what happened
    """An order or question that cannot be served: a stable code, a text, what helps, and all problems where several."""

    def __init__(
        self, code: str, text: str, help: str = "", problems: Sequence[str] = (), *, near: Iterable[str] = ()
    ) -> None:
        super().__init__(code, text, help=help, near=near)
        self.problems = tuple(problems)
