"""``python -m sph_prep`` is the command-line program."""

import sys

from ._command import main

sys.exit(main())
