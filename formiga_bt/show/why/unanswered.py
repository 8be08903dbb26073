"""What comes of a question that nobody answers in time: told by `why`, by `formiga inbox` and by the watch."""


def then(kind: str, if_no_answer: str) -> str:
    """Return what follows when a question lapses, to stand behind `lapses in 51 s`.

    Without an answer the step that asked fails; the author's text says what that means, and changes nothing of it. The
    engine's own question, whether people stand clear of a machine, says itself what the machine does not do then.

    Args:
        kind: `ask` or `clearance`.
        if_no_answer: the text of whoever asks, or empty.
    """
    if kind == "clearance":
        return f", then: {if_no_answer}" if if_no_answer else ""
    return ", then its step fails" + (f": {if_no_answer}" if if_no_answer else "")
