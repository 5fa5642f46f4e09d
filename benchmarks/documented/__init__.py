"""Every command line of README and docs, run in order as it is written, in a copy of the checkout."""
