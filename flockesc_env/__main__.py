"""Entry point of ``python -m flockesc_env``, which is the same as the command ``flockesc``."""

import sys

from flockesc_env.cli import main

sys.exit(main())
