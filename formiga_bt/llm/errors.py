"""What can go wrong between us and a model. Each text says what to do."""

from formiga_bt.base.errors import FormigaError


class LlmError(FormigaError):
    """Base of all errors of language models."""


class NoKey(LlmError):  # noqa: N818 - it names what is wrong
    """A provider needs a key, and there is none in the environment or the keyring."""


class EndpointUnreachable(LlmError):  # noqa: N818
    """The endpoint does not answer, or not in time."""


class EndpointRefused(LlmError):  # noqa: N818
    """The endpoint said no: a wrong key, an unknown model, a limit reached."""


class Cancelled(LlmError):  # noqa: N818
    """The person did not want to wait any longer."""


class UnusableModel(LlmError):  # noqa: N818
    """A local model is missing, incomplete, or not the file that it claims to be."""


class TooLong(LlmError):  # noqa: N818
    """The question is longer than the model can take."""
