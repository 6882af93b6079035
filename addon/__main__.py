"""`python3 -m beamspread`: simulate, draw and look up light transport without Blender; `--help` teaches."""

import sys

from .core.cli.commands import main

if __name__ == "__main__":
    sys.exit(main())
