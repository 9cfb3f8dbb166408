"""What may go wrong. Texts are those of the command line: what, why, and what to do about it."""

from __future__ import annotations

__all__ = ["CaseError", "ContactError", "GlueyError", "GlueyWarning", "Interrupted", "RunError", "StokesError"]


class GlueyError(Exception):
    """The base of all errors of gluey."""

    #: What to do about it; None where there is no advice.
    hint: str | None

    def __init__(self, text: str, hint: str | None = None) -> None:
        super().__init__(text if hint is None else f"{text}\n  hint: {hint}")
        self.hint = hint


class CaseError(GlueyError, ValueError):
    """A case that makes no sense; particles count from 1 in the text, lists from 0 in the key.

    The text tells all that is wrong, each with what would be right; ``hint`` is that of the first.
    """

    #: The first key that is wrong, such as ``particles[1].radius``; empty for the case as a whole.
    key: str = ""
    #: All that is wrong: key, text and hint of each.
    issues: list[tuple[str, str, str]]


class RunError(GlueyError, RuntimeError):
    """A run that could not begin, or did not come to its end."""


class Interrupted(KeyboardInterrupt):
    """A run that was stopped by Ctrl-C; its checkpoint is written, and ``gluey.resume(folder)`` goes on."""

    #: What to do to go on.
    hint: str | None
    #: Steps done.
    step: int = 0
    #: Steps in all.
    steps: int = 0
    #: Time reached.
    time: float = 0.0
    #: The folder of the results.
    folder: str | None = None

    def __init__(self, text: str, hint: str | None = None) -> None:
        super().__init__(text if hint is None else f"{text}\n  hint: {hint}")
        self.hint = hint


class ContactError(GlueyError, RuntimeError):
    """Velocities could not be corrected; particles and walls count from 1 in the text."""


class StokesError(GlueyError, RuntimeError):
    """A flow could not be computed; bodies count from 1 in the text."""


class GlueyWarning(UserWarning):
    """Something that is no error but should be known."""
