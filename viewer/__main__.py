"""`python -m viewer WHAT` is `depthsim view WHAT`."""

import sys

from depthsim.__main__ import main

sys.argv.insert(1, "view")
main()
