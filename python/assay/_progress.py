"""How far a campaign is: in a notebook, on a terminal, or as lines."""

from __future__ import annotations

import html
import sys
import time
from typing import Any, Callable, Optional


def _duration(seconds: float) -> str:
    seconds = max(0, round(seconds))
    if seconds < 60:
        return f"{seconds} s"
    return f"{seconds // 60} min {seconds % 60:02} s" if seconds < 3600 else f"{seconds // 3600} h {seconds % 3600 // 60:02} min"


class _Shown:
    """What the events have told so far, as one line."""

    def __init__(self) -> None:
        self.cells = self.done = 0
        self.left_s: Optional[float] = None
        self.phase = self.current = ""
        self.notes: list[str] = []

    def take(self, event: dict) -> None:
        kind = event["event"]
        for name in ("cells", "done", "left_s"):
            if name in event:
                setattr(self, name, event[name])
        if kind == "phase":
            self.phase, self.current = event["text"], ""
        elif kind == "tested":
            self.current = f"{event['tests_done']}/{event['tests']} tests; last: {event['text']}"
        elif kind in ("started", "made"):
            self.current = event["text"]
        elif kind == "message":
            self.notes.append(event["text"])

    @property
    def line(self) -> str:
        parts = []
        if self.cells:
            parts.append(f"{self.done}/{self.cells} cells")
        if self.left_s is not None and self.done < self.cells:
            parts.append(f"{_duration(self.left_s)} left")
        what = ": ".join(part for part in (self.phase, self.current) if part)
        return ", ".join(parts) + (("  " if parts else "") + what if what else "")


class Silent:
    def event(self, event: dict) -> None:
        pass

    def end(self, summary: str) -> None:
        pass


class Lines(Silent):
    """A line a phase and each ten seconds, to `stream`."""

    interval_s = 10.0

    def __init__(self, stream: Any) -> None:
        self.stream, self.shown, self.last = stream, _Shown(), 0.0

    def event(self, event: dict) -> None:
        self.shown.take(event)
        if event["event"] == "message":
            self._print(event["text"])
        elif event["event"] in ("begin", "phase") or time.monotonic() - self.last > self.interval_s:
            self._print(self.shown.line)

    def _print(self, line: str) -> None:
        self.last = time.monotonic()
        if line:
            print(line, file=self.stream, flush=True)

    def end(self, summary: str) -> None:
        print(summary, file=self.stream, end="", flush=True)


class Terminal(Lines):
    """One line that is written again."""

    interval_s = 0.2

    def event(self, event: dict) -> None:
        self.shown.take(event)
        if event["event"] == "message":
            print(f"\r\x1b[K{event['text']}", file=self.stream, flush=True)
        elif time.monotonic() - self.last > self.interval_s:
            import shutil

            self.last = time.monotonic()
            print(f"\r\x1b[K{self.shown.line[:shutil.get_terminal_size().columns - 1]}", end="", file=self.stream, flush=True)

    def end(self, summary: str) -> None:
        print("\r\x1b[K" + summary, file=self.stream, end="", flush=True)


class Notebook(Lines):
    """A bar in the cell's output."""

    interval_s = 0.3

    def __init__(self, display: Callable) -> None:
        super().__init__(sys.stdout)
        self.handle = display(self._page(""), display_id=True)

    def _page(self, below: str) -> Any:
        shown = self.shown
        share = shown.done / shown.cells if shown.cells else 0
        notes = "".join(f"<div>{html.escape(note)}</div>" for note in shown.notes)
        text = f"<progress value='{share:.4f}' max='1' style='width:20em'></progress> {html.escape(shown.line)}"
        return _Page(notes + f"<div>{text}</div>" + below, shown.line + ("\n" if below else ""))

    def event(self, event: dict) -> None:
        self.shown.take(event)
        if event["event"] in ("phase", "end", "message") or time.monotonic() - self.last > self.interval_s:
            self.last = time.monotonic()
            self.handle.update(self._page(""))

    def end(self, summary: str) -> None:
        self.shown.phase = self.shown.current = ""
        self.handle.update(self._page(f"<pre>{html.escape(summary)}</pre>"))


class _Page:
    """What IPython displays: HTML, and the same as text."""

    def __init__(self, page: str, text: str) -> None:
        self.page, self.text = page, text

    def _repr_html_(self) -> str:
        return self.page

    def __repr__(self) -> str:
        return self.text


class Called(Silent):
    """A function of the user's that gets every event."""

    def __init__(self, function: Callable[[dict], Any]) -> None:
        self.function = function

    def event(self, event: dict) -> None:
        self.function(event)


def shown_by(progress: Any) -> Silent:
    """For progress=True, False, or a function of one event."""
    if callable(progress):
        return Called(progress)
    if not progress:
        return Silent()
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is not None and getattr(shell, "kernel", None) is not None:
        from IPython.display import display

        return Notebook(display)
    return Terminal(sys.stderr) if sys.stderr.isatty() else Lines(sys.stderr)
