"""`python -m depthsim` is `depthsim`."""

from depthsim.cli import main

main()
