"""A scene from a recording that has none, and masks of where it may be trusted."""
