"""Benchmarks: each prints what it measured, on what machine, beside what it should reach."""
