"""The confusion matrix as a picture."""

from pathlib import Path

import numpy as np


def draw_confusion(file: Path, rows: list[str], columns: list[str], matrix: np.ndarray) -> None:
    """Rows: what was withheld; columns: the first cause told; a cell is the share of its row, its number the cases."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    share = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
    figure, axes = plt.subplots(figsize=(3.2 + 0.32 * len(columns), 2.6 + 0.3 * len(rows)), layout="constrained")
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in zip(*np.nonzero(matrix), strict=True):
        right = rows[i] == columns[j]
        colour = "white" if share[i, j] > 0.55 else "black" if right else "firebrick"
        axes.text(j, i, str(matrix[i, j]), ha="center", va="center", fontsize=8, color=colour)
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", rotation_mode="anchor", fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color="0.92", linewidth=0.6)
    axes.tick_params(which="minor", length=0)
    axes.set_xlabel("first cause that was told")
    axes.set_ylabel("effect that was withheld")
    axes.set_title("Cases by withheld effect and first cause (red: wrong)", fontsize=10)
    figure.savefig(file, dpi=130)
    plt.close(figure)
