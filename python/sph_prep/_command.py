"""The command-line program, as the wheel carries it."""

import signal
import sys

from ._core import main as _main


def main() -> int:
    # The program has its own answer to Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _main(sys.argv)


if __name__ == "__main__":
    sys.exit(main())
