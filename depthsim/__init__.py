"""depthsim: a RealSense depth sensor on triangle meshes, and the diagnosis of its sim-to-real gap."""

__version__ = "0.1.0"
