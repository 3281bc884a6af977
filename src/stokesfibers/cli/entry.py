"""Where the command starts: nothing is imported before Ctrl-C is looked after."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line; interrupted while it is still loading, end as any other command."""
    try:
        from stokesfibers.cli.main import main as run
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        sys.exit(130)
    run()
