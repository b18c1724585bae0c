"""Brings the environment and the workspace up to date; does nothing where they are. Called by ./rig.

Standard library only, because it runs before anything is installed.
"""

import sys

from preparation.main import main

sys.exit(main(sys.argv[1:]))
