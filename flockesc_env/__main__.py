"""``python -m flockesc_env``: the same as ``flockesc``."""

import sys

from flockesc_env.cli import main

sys.exit(main())
