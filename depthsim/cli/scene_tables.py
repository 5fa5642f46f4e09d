"""A report on a scene as tables for the terminal."""

import shlex

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from depthsim.cli.flags import in_flags
from depthsim.scenefile.inspect import MeshReport, SceneReport
from depthsim.scenefile.tagging import shown


def render(report: SceneReport) -> RenderableType:
    """What ``depthsim inspect`` shows."""
    low, high = report.bounds
    size = " × ".join(f"{length:.4g}" for length in high - low)
    corners = " to ".join("(" + ", ".join(f"{x:.4g}" for x in corner) + ")" for corner in (low, high))
    lines: list[RenderableType] = [
        f"[bold]{escape(report.name)}[/]  {escape(str(report.source))}",
        f"{report.faces:,} faces, {report.vertices:,} vertices, {size} m, from {corners}",
        _materials(report),
        _surfaces(report),
    ]
    if report.trajectories:
        lines.append("trajectories: " + escape(", ".join(report.trajectories)))
    if report.unmapped:
        lines.append(
            f"[yellow]not mapped[/] to a tag: {len(report.unmapped)} of the names. A guess to copy and correct:"
        )
        lines.append(escape("  " + " \\\n  ".join(tag_options(report))))
        lines.append(f"`*` stands for all others; the tags are {escape(', '.join(report.tags))}")
    lines += [f"[yellow]hint[/] {escape(in_flags(hint))}" for hint in report.hints]
    return Group(*lines)


def tag_options(report: SceneReport) -> list[str]:
    """The guesses as options, quoted for the shell."""
    return [f"--tag {shlex.quote(f'{name}={tag}')}" for name, tag in report.tag_guesses.items()]


def _materials(report: SceneReport) -> Table:
    table = Table("mesh", "material name", "tag", box=None, padding=(0, 2, 0, 0))
    table.add_column("faces", justify="right")
    table.add_column("area [m²]", justify="right")
    for mesh in report.meshes:
        for i, name in enumerate(mesh.names):
            tag = escape(name.tag) if name.tag else "[red]not mapped[/]"
            label = escape(mesh.label) if i == 0 else ""
            table.add_row(label, escape(shown(name.name)), tag, f"{name.faces:,}", f"{name.area:.4g}")
    return table


def _surfaces(report: SceneReport) -> Table:
    table = Table("mesh", "read as", "surface", box=None, padding=(0, 2, 0, 0))
    for mesh in report.meshes:
        table.add_row(escape(mesh.label), mesh.read_as, "; ".join(_findings(mesh)))
    return table


def _findings(mesh: MeshReport) -> list[str]:
    """One phrase a finding, without those that found nothing."""
    found = mesh.topology
    phrases = [
        (found.boundary_edges, f"holes or rims: {found.boundary_loops:,} of {found.boundary_edges:,} edges"),
        (found.flipped_faces, f"[yellow]flipped faces: {found.flipped_faces:,}[/]"),
        (found.flipped_edges, f"edges between faces that look to opposite sides: {found.flipped_edges:,}"),
        (found.non_manifold_edges, f"edges of more than two faces: {found.non_manifold_edges:,}"),
        (found.duplicate_faces, f"duplicate faces: {found.duplicate_faces:,}"),
        (found.inside_out_bodies, f"closed bodies that look inwards (right for a room): {found.inside_out_bodies:,}"),
        (mesh.zero_area, f"faces without area, left out: {mesh.zero_area:,}"),
    ]
    closed = f"closed bodies: {found.closed_bodies:,} of {found.bodies:,}"
    return [closed, *(phrase for count, phrase in phrases if count)]
