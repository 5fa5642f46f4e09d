"""One browser: its controls, its sensor and its 3D view. Browsers share the scene and the recording, and no setting."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import viser

from depthsim.errors import InputError
from depthsim.sensor import Profile
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory
from viewer.controls.effects import EffectControls
from viewer.controls.fly import Air, FlyControls, camera_pose
from viewer.controls.gap import GapControls
from viewer.controls.handles import put
from viewer.controls.look import LookControls, Side
from viewer.controls.playback import Playback
from viewer.controls.save import SaveControls
from viewer.controls.sensor import SensorControls
from viewer.drawing import View
from viewer.measure import LiveSensor, Moment, recorded, without_sensor
from viewer.pace import FASTEST, Echo, Pace
from viewer.scenery import ORANGE
from viewer.screen import Screen
from viewer.shot import Shot
from viewer.software import draws_by_software
from viewer.stage import Stage
from viewer.status import Status
from viewer.worker import Worker

_DRAWN = 0.5
"""[s] A browser that takes longer to draw a frame is not waited for."""
_SETTLED = 0.3
"""[s] After the last frame of a play the whole cloud is sent."""


@dataclass(frozen=True)
class Shown:
    """What a browser was sent last.

    points: in the clouds; one_in: 1 point in so many was sent. pictured: as a picture of the view.
    """

    shots: tuple[Shot, ...]
    sides: tuple[Side, ...]
    index: int
    points: int
    one_in: int
    pictured: bool

    @property
    def whole(self) -> bool:
        """Whether the browser has every point."""
        return self.one_in == 1 and not self.pictured


class Session:
    """Builds the page of one browser and keeps it. All heavy work is on the worker's thread, the latest wish first."""

    def __init__(self, client: viser.ClientHandle, server: viser.ViserServer, stage: Stage, folder: Path) -> None:
        self.client, self.stage = client, stage
        self.shown: Shown | None = None
        self._pace, self._echo = Pace(), Echo(client)
        self._live = {"sensor": LiveSensor(stage), "second sensor": LiveSensor(stage)}
        self._path: Trajectory = stage.trajectory
        self._poses, self._motion = stage.trajectory.matrices(), stage.motion
        self.screen = Screen(client, stage)
        self._by_software, self._sent = False, 0.0
        self.status = Status(client.gui, server.get_event_loop())
        self.worker = Worker(self.status.busy, self.status.ended)
        with client.atomic():
            self._build(folder)
        self._start()

    def _build(self, folder: Path) -> None:
        gui, stage = self.client.gui, self.stage
        self._dress(dark=True)
        gui.main_panel.dock_right()
        self.playback = Playback(gui, stage.trajectory.stamps, self.refresh)
        tabs = gui.add_tab_group()
        if stage.report is not None:
            with tabs.add_tab("Gap"):
                self.gap = GapControls(gui, stage.report, self._causes_changed)
        with tabs.add_tab("View"):
            self.look = LookControls(gui, stage, self.refresh)
        if stage.scene is not None:
            self._build_sensor(tabs)
        with tabs.add_tab("Save"):
            self.save = SaveControls(gui, folder, self._save, profile=stage.scene is not None)
        self.look.dark.on_update(lambda _: self._dress(dark=self.look.dark.value))

    def _dress(self, *, dark: bool) -> None:
        self.client.gui.configure_theme(
            dark_mode=dark, control_width="large", show_logo=False, show_share_button=False, brand_color=ORANGE
        )

    def _build_sensor(self, tabs: viser.GuiTabGroupHandle) -> None:
        gui, stage = self.client.gui, self.stage
        with tabs.add_tab("Sensor"):
            self.sensor = SensorControls(gui, stage.profile, stage.camera, self._sensor_changed, self._take_profile)
            self.effects = EffectControls(gui, stage.tags, stage.materials, self._sensor_changed)
            self.effects.fill(stage.profile.effects)
        self._stereo = stage.profile.stereo
        with tabs.add_tab("Fly"):
            self.fly = FlyControls(gui, stage, self._keys_changed, lambda: self.worker.ask("fly", self._fly))
        self.fly.landed = lambda: self._follow(stage.trajectory)

    def _start(self) -> None:
        self.screen.scenery.show_path(self._path.positions)
        self.worker.ask("frame", self._first_frame)
        self.look.places.on_click(lambda event: self._go_to(event.target.value))

        @self.client.camera.on_update
        def _(_: viser.CameraHandle) -> None:
            if self._by_keys:
                self.refresh()

    def close(self) -> None:
        """The browser has gone."""
        self.worker.close()
        self._echo.close()

    def refresh(self) -> None:
        """Show what is chosen now, as soon as it can be."""
        self.worker.ask("frame", self._frame)

    # What the controls ask for

    def _sensor_changed(self) -> None:
        self.look.show_sensor()
        self.refresh()

    def _take_profile(self, profile: Profile) -> None:
        self._stereo = profile.stereo
        self.effects.fill(profile.effects)
        self._sensor_changed()

    def _causes_changed(self) -> None:
        """Put the causes that are switched on into the live sensor, and show it beside the recording."""
        assert self.stage.report is not None
        self.effects.fill(self.stage.report.effects(self.gap.chosen()))
        if "sensor" not in self.look.sides():
            put(self.look.beside, "sensor")
        self.refresh()

    def profile(self) -> Profile:
        """The sensor as its controls are set. Raises :class:`~depthsim.errors.InputError`."""
        return Profile(name="live", camera=self.sensor.camera(), effects=self.effects.effects(), stereo=self._stereo)

    def _save(self, what: str) -> None:
        jobs: dict[str, Callable[[], object]] = {
            "profile": lambda: self.save.save_profile(self.profile()),
            "frame": self._save_frame,
            "picture": lambda: self.save.save_picture(self.client),
        }
        self.worker.ask("save frame" if what == "frame" else what, lambda: (jobs[what](), None)[1])

    def _save_frame(self) -> None:
        if self.shown is not None:
            self.save.save_frame(self.shown.shots[0], float(self._path.stamps[self.shown.index]), self.stage.tags)

    def _go_to(self, place: str) -> None:
        pose, depth = self._moment().pose, self.screen.middle_depth
        if place == "from outside":
            self.screen.scenery.look_from_outside(len(self.look.sides()) > 1)
        elif place == "through it":
            self.screen.scenery.look_through(pose, depth)
        else:
            self.screen.scenery.look_from_behind(pose, depth)

    # Flying

    def _keys_changed(self) -> None:
        if self._by_keys:
            self.look.show_sensor()
        self.refresh()

    @property
    def _by_keys(self) -> bool:
        return self.stage.scene is not None and bool(self.fly.keys.value)

    def _fly(self) -> None:
        self._follow(self.fly.take_off(self.stage, self.stage.camera.rate))
        self.look.show_sensor()

    def _follow(self, path: Trajectory) -> None:
        """Go along another path from now on."""
        self._path, self._poses = path, path.matrices()
        self._motion = self.stage.motion if path is self.stage.trajectory else Motion.along(path)
        self.screen.scenery.show_path(path.positions)
        self.playback.set_stamps(path.stamps)
        self.refresh()

    def _moment(self) -> Moment:
        index = self.playback.index
        if self._by_keys:
            return Moment(index, float(self._path.stamps[index]), camera_pose(self.client.camera), None)
        return Moment(index, float(self._path.stamps[index]), self._poses[index], self._motion)

    def _air(self, moment: Moment) -> Air | None:
        if self.stage.scene is None:
            return None
        return self.fly.by_keys(moment.pose[:3, 3]) if self._by_keys else self.fly.along(moment.stamp)

    # Frames; on the worker's thread

    def _first_frame(self) -> None:
        self._frame()
        self._go_to("over its shoulder")
        self._by_software = draws_by_software(self.client)

    def _frame(self) -> None:
        """Show the chosen frame; while it plays, ask for the next."""
        if self._by_keys and self._echo.back(0.0, 0) and time.monotonic() - self._sent > _SETTLED:
            self._pace.rest()  # the keys rested, not the browser
        if not self._echo.back(0.25):
            self.worker.ask("frame", self._frame)  # the browser is still busy with the one before
            return
        began, playing = time.monotonic(), self.playback.playing and not self._by_keys
        moving = playing or self._by_keys
        self.status.moving(moving)
        if moving:
            self._pace.taken(FASTEST if self._by_keys else self.playback.rate)
        else:
            self._pace.rest()
        if playing:
            self.playback.advance()
        try:
            self._show(moving=moving)
            self._echo.ask()
        finally:  # one broken frame does not stop the play
            self._sent = time.monotonic()
            if playing:
                self.worker.ask("frame", self._frame, max(1 / FASTEST - (self._sent - began), 0.0))
            elif self._by_keys:
                self.worker.ask("settle", self._settle, _SETTLED)

    def _settle(self) -> None:
        """Send the whole cloud once the keys rest."""
        if self._by_keys and self._echo.back(0.0, 0) and self.shown is not None and not self.shown.whole:
            self._show(moving=False)
            self._echo.ask()

    def _shot(self, side: Side, moment: Moment, done: dict[str, Shot]) -> Shot:
        if side == "recording":
            if self._by_keys or self._path is not self.stage.trajectory:
                raise InputError("recording", "", "was not made on this path", "show the sensor, or go back")
            return recorded(self.stage, self.playback.index)
        if side == "clean":
            known = done.get("sensor") or done.get("recording")
            if known is None or known.clean is None:
                perfect = Profile(name="clean", camera=self.sensor.camera())
                known = self._live["second sensor"].measure(perfect, self.sensor.camera(), 0, moment)
            return without_sensor(known)
        profile = self.profile() if side == "sensor" else self.sensor.second_profile()
        return self._live[side].measure(profile, self.sensor.camera(), int(self.sensor.seed.value), moment)

    def _show(self, *, moving: bool) -> None:
        """moving: frames follow each other, so that a browser may be sent less than all there is."""
        view = View.of(self.client.camera) if moving and self._by_software else None
        one_in = self.look.thinning() or (self._pace.one_in if moving and view is None else 1)
        moment, sides = self._moment(), self.look.sides()
        shots: dict[str, Shot] = {}
        for side in sorted(set(sides), key=lambda side: side == "clean"):
            shots[side] = self._shot(side, moment, shots)
        style = self.look.style(moving_by_keys=self._by_keys, view=view)
        points = self.screen.show(sides, shots, one_in, style, self._drawn, moment.stamp)
        frames = tuple(shots[side] for side in sides)
        self.shown = Shown(frames, tuple(sides), moment.index, points, one_in, view is not None)
        self.status.figures(self._lines(moment, self.shown))

    def _drawn(self) -> None:
        """Wait until the frame before is drawn: of two that lie there at once, the browser draws the second alone."""
        self._echo.back(_DRAWN, 0)

    def _lines(self, moment: Moment, shown: Shown) -> list[str]:
        """What the page tells of what it shows."""
        camera = shown.shots[0].camera
        lines = [f"**{camera.name}** {camera.width}x{camera.height} · {moment.stamp - self._path.stamps[0]:.2f} s"]
        for side, shot in zip(shown.sides, shown.shots, strict=True):
            lines.append(f"{side}: {shot.figures}")
        thinned = "every point is shown" if shown.one_in == 1 else f"**1 point in {shown.one_in} is shown**"
        rate = f" · {self._pace.rate:.1f} frames/s" if self._pace.rate is not None else ""
        lines.append(f"{shown.points:,} points, {thinned}{rate}")
        if shown.pictured:
            lines.append("No GPU: while it plays, pictures of the view are sent, without the mesh.")
        if (air := self._air(moment)) is not None:
            lines.append(str(air))
        return lines
