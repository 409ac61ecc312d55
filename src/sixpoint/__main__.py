"""``python -m sixpoint``: the command line."""

import sys

from sixpoint.cli import main

if __name__ == "__main__":
    sys.exit(main())
