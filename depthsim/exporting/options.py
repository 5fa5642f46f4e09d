"""What an exporter can be asked for."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ExportOptions:
    """points: point clouds in a ROS 2 bag, too. metric: 32FC1 depth in it. shard: frames to a WebDataset shard."""

    points: bool = False
    metric: bool = True
    shard: int = 500
