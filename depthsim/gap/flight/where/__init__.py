"""Where the forces differ, and what no effect explains."""
