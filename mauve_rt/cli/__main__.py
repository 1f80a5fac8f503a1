"""`python -m mauve_rt.cli`."""

import sys

from mauve_rt.cli.main import main

sys.exit(main())
