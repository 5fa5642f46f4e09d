"""What only the report on depth draws."""
