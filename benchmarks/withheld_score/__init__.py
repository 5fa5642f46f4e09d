"""Diagnosing the withheld cases, and counting: plan, runner, rivals, tables and pictures."""
