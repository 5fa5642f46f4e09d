"""Reports: the folder, the page, figures, text, terminal."""
