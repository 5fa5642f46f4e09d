"""Where the gap lies, and what no effect explains."""
