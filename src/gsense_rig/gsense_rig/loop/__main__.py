"""`python -m gsense_rig.loop COMMANDS TELEMETRY`: the loop process, started by `client.LoopProcess`."""

import sys

from gsense_rig.loop.process import main

sys.exit(main())
