"""What a gap costs: the figures that a robot's software sees, of the recording and of its simulations."""
