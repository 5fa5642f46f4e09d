"""The bank of effects, one family a file; a new file here is found by itself."""
