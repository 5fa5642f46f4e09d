"""The controls of the page, one group a file. They hold what was chosen; what comes of it is the session's."""
