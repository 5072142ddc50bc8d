"""A progress bar on a terminal; nothing where the output goes to a file."""
import sys
import time


class Progress:
    """progress(done) or progress(done, total) draws it; the line is cleared at the end."""

    def __init__(self, what, total, stream=sys.stderr):
        self.what, self.total, self.stream = what, max(1, total), stream
        self.start = time.monotonic()

    def __call__(self, done, total=None):
        self.total = total or self.total
        if not self.stream.isatty():
            return
        share, elapsed = done / self.total, time.monotonic() - self.start
        left = elapsed * (1 - share) / share if share > 0 else 0.0
        bar = "#" * int(30 * share)
        end = "\r\x1b[K" if done >= self.total else ""
        self.stream.write(f"\r{self.what} [{bar:30}] {done} of {self.total}, {left:.0f} s left \x1b[K{end}")
        self.stream.flush()
