"""From recorded depth to the noise of a material: the m of std = floor·exp(m·d) (section 2 of the paper).

Measure first, then fit, which :func:`fit_material` does in one call. :func:`measure_wall` takes captures of a flat wall
at known distances, :func:`measure_run` a run with its scene, both give std against distance as a :class:`Curve`;
:func:`fit_curve` finds m from one.

Which std is fitted: the plain standard deviation of what lies within six robust deviations of the middle. For Gaussian
noise the cut takes nothing away, while flying pixels and wrong matches, which are no material's noise, are left out.
The robust deviation itself (1.4826 · MAD) stands beside it; where it is much smaller, the noise has heavy tails.
"""

from depthsim.material_fit.curve import Curve, Point
from depthsim.material_fit.fit import MaterialFit, fit_curve, fit_points
from depthsim.material_fit.material import fit_material
from depthsim.material_fit.run import measure_run
from depthsim.material_fit.wall import measure_wall

__all__ = ["Curve", "MaterialFit", "Point", "fit_curve", "fit_material", "fit_points", "measure_run", "measure_wall"]
