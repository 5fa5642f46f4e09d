"""Flights: vehicles and their drag, logs, and fits of one to the other."""
