"""Why the work could not be done."""

from __future__ import annotations


class Error(ValueError):
    """Why the work could not be done, in the sentences of the commands, and what to try."""

    def __init__(self, reason: str, advice: str = "") -> None:
        super().__init__(reason, advice)

    @property
    def reason(self) -> str:
        """What is wrong, and where."""
        return str(self.args[0])

    @property
    def advice(self) -> str:
        """What to try; empty where nothing is known to help."""
        return str(self.args[1])

    def __str__(self) -> str:
        return f"{self.reason}\n  try: {self.advice}" if self.advice else self.reason
