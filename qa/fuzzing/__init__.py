"""Broken inputs for every reader of depthsim: seeds, mutators, readers, and the worker that counts."""
