"""`python -m dsis` is `dsis`."""

import sys

from dsis.cli import main

sys.exit(main())
