"""Candidates fitted, validated and selected."""
