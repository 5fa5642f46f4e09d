"""What all flights have in common."""

GRAVITY = 9.80665
"""[m/s²] standard gravity."""

AIR_DENSITY = 1.225
"""[kg/m³] at sea level, 15 °C (ISO 2533)."""
