"""Entry point of `python -m hpcwhirl`."""

import sys

from hpcwhirl.cli import main

sys.exit(main())
