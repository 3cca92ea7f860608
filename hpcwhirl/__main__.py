"""Run the command `hpcwhirl` when Python is started as `python -m hpcwhirl`."""

import sys

from hpcwhirl.cli import main

sys.exit(main())
