"""Active stereo: a sensor without a list of effects. Two infrared imagers and a dot projector, and a matcher."""
