"""Runs whose cause is known: scenes, motions and sensor errors by formulas that are not those of depthsim's effects.

Nothing here imports ``depthsim.sensor``, but for the case of active stereo, which has no effects: a diagnosis that
finds the cause has found it without having seen the formula.
"""
