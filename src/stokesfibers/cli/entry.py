"""Where the command starts and ends: Ctrl-C is looked after before anything is imported, and after.

What Python does at its very end takes a while and knows no handlers: a signal would then end a
command by itself, whose result is there and whose last line is printed.
"""

from __future__ import annotations

import signal
import sys


def main() -> None:
    """Run the command line; interrupted while it is still loading, end as any other command."""
    try:
        from stokesfibers.cli.main import main as run

        run()
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        sys.exit(130)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
