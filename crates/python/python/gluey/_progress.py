"""Where a run is, in a line of the terminal or notebook."""

from __future__ import annotations

import sys
import time
from typing import Any, TextIO

#: Seconds between lines of a log.
LOG_INTERVAL = 10.0


class Line:
    """Rewrites one line in a terminal or notebook; writes a line every ten seconds anywhere else."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.rewrites = _is_terminal(self.stream) or _in_notebook()
        self.width = 0
        self.last = time.monotonic()

    def __call__(self, state: dict[str, Any]) -> None:
        text = describe(state)
        if self.rewrites:
            self.stream.write("\r" + text.ljust(self.width))
            self.width = len(text)
        elif time.monotonic() - self.last >= LOG_INTERVAL:
            self.last = time.monotonic()
            self.stream.write(text + "\n")
        else:
            return
        self.stream.flush()

    def close(self) -> None:
        """Leaves the line."""
        if self.width:
            self.width = 0
            self.stream.write("\n")
            self.stream.flush()


def describe(state: dict[str, Any]) -> str:
    """``pair: step 12/320, t = 0.300, 45.2 steps/s, 7 s left``."""
    text = f"{state['name']}: step {state['step']}/{state['steps']}, t = {state['time']:.3f}"
    left = state["left_s"]
    if left is None:
        return f"{text}, {state['phase']}"
    rate = f", {(state['steps'] - state['step']) / left:.3g} steps/s" if left > 0.0 else ""
    return f"{text}{rate}, {duration(left)} left"


def duration(seconds: float) -> str:
    """A time one waits, in words."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02} min"


def _is_terminal(stream: TextIO) -> bool:
    try:
        return stream.isatty()
    except (AttributeError, ValueError):
        return False


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    kernel = shell and shell.get_ipython()
    return kernel is not None and type(kernel).__name__ == "ZMQInteractiveShell"
