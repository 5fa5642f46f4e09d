"""What only the report on flights draws."""
