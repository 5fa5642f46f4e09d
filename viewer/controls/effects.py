"""A folder for each effect of the registry: a switch, and a slider for each parameter with its unit and its bounds."""

from collections.abc import Callable
from typing import Any

import viser

from depthsim.materials import Material, Materials
from depthsim.sensor.effect import Effect, Stage, effect_class, effect_ids, parameters_of
from depthsim.sensor.parameter import learned_of
from viewer.controls.handles import put
from viewer.controls.ranges import Range, parameter_range

_STAGES = {
    Stage.POSE: "Pose",
    Stage.OPTICS: "Optics",
    Stage.DISPARITY: "Errors of the disparity",
    Stage.NOISE: "Noise",
    Stage.MIXING: "Between surfaces",
    Stage.HOLES: "Holes",
    Stage.PROCESSING: "Processing",
}


class EffectFolder:
    """The controls of one effect."""

    def __init__(
        self,
        gui: viser.GuiApi,
        kind: type[Effect],
        tags: tuple[str, ...],
        materials: Materials,
        changed: Callable[[], None],
    ) -> None:
        self.kind, self._tags, self._materials = kind, tags, materials
        self._changed, self._filling = changed, False
        self._sliders: dict[str, tuple[Any, Range]] = {}
        self._by_tag: dict[str, dict[str, tuple[Any, Range]]] = {}
        self._chosen: dict[str, dict[str, float]] = {}
        self._learned: dict[str, Any] = {}
        self._folder = gui.add_folder(kind.id, expand_by_default=_of_the_scene(kind))
        with self._folder:
            about = " ".join((kind.__doc__ or "").split())
            self._switch = gui.add_checkbox("on", False, hint=f"{about} Source: {kind.source}.")
            self._switch.on_update(self._moved)
            for name, one in parameters_of(kind).items():
                unit = f" [{one.unit}]" if one.unit not in ("", "1") else ""
                source = f" Source: {one.source}." if one.source else ""
                told = f"{one.about}, {{low:g}} to {{high:g}}{unit}.{source}"
                if one.by_material:
                    self._add_by_tag(gui, name, unit, told)
                else:
                    span = parameter_range(kind, name)
                    hint = told.format(low=span.low, high=span.high)
                    slider = gui.add_slider(name + unit, span.low, span.top, span.step, span.default, hint=hint)
                    self._sliders[name] = slider, span
                    slider.on_update(self._moved)

    def _add_by_tag(self, gui: viser.GuiApi, name: str, unit: str, told: str) -> None:
        """A slider for each material of the scene. What is not moved is left to materials.yaml."""
        span = parameter_range(self.kind, name)
        self._by_tag[name], self._chosen[name] = {}, {}
        for tag in self._tags:
            usual = float(getattr(self._materials[tag], name, span.default))
            hint = f"{tag}: " + told.format(low=span.low, high=span.high)
            slider = gui.add_slider(f"{name} {tag}{unit}", span.low, max(span.top, usual), span.step, usual, hint=hint)
            self._by_tag[name][tag] = slider, span

            def moved(_: object, name: str = name, tag: str = tag, slider: Any = slider) -> None:
                if not self._filling:
                    self._chosen[name][tag] = float(slider.value)
                    self._moved()

            slider.on_update(moved)

    def _moved(self, event: Any = None) -> None:
        if self._filling:
            return
        if event is not None and event.target is not self._switch and not self._switch.value:
            put(self._switch, True)  # whoever moves a slider wants to see what it does
        for slider, span in self._all_sliders():
            if slider.value >= slider.max and slider.max < span.high:
                slider.max = min(span.high, 4 * slider.max)  # the slider grows until the bound
        self._mark()
        self._changed()

    def _all_sliders(self) -> list[tuple[Any, Range]]:
        return [*self._sliders.values(), *(pair for by_tag in self._by_tag.values() for pair in by_tag.values())]

    def _mark(self) -> None:
        label = f"● {self.kind.id}" if self._switch.value else self.kind.id
        if self._folder.label != label:
            self._folder.label = label

    @property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that have controls here."""
        return (*self._sliders, *self._by_tag)

    def fill(self, effect: Effect | None) -> None:
        """Show an effect's values; None switches it off and leaves the values."""
        self._filling = True
        try:
            put(self._switch, effect is not None)
            if effect is not None:
                self._learned = {name: getattr(effect, name) for name in learned_of(self.kind)}
                for name, (slider, span) in self._sliders.items():
                    self._put(slider, span, getattr(effect, name))
                for name, by_tag in self._by_tag.items():
                    given = getattr(effect, name)
                    self._chosen[name] = dict(given)
                    for tag, (slider, span) in by_tag.items():
                        usual = float(getattr(self._materials[tag], name, span.default))
                        self._put(slider, span, given.get(tag, usual))
            self._mark()
        finally:
            self._filling = False

    @staticmethod
    def _put(slider: Any, span: Range, value: float) -> None:
        if value > slider.max:
            slider.max = min(span.high, 2 * value) if span.high > value else value
        if value < slider.min:
            slider.min = span.low
        slider.value = value

    def effect(self) -> Effect | None:
        """The effect as it is set, None while it is off."""
        if not self._switch.value:
            return None
        values: dict[str, Any] = {name: span.within(slider.value) for name, (slider, span) in self._sliders.items()}
        values.update({name: dict(chosen) for name, chosen in self._chosen.items()})
        return self.kind(**values, **self._learned)


def _of_the_scene(kind: type[Effect]) -> bool:
    """Whether its controls show what materials.yaml has of the scene's materials."""
    return any(one.by_material and name in Material.model_fields for name, one in parameters_of(kind).items())


class EffectControls:
    """All effects, in the order in which they act."""

    def __init__(
        self, gui: viser.GuiApi, tags: tuple[str, ...], materials: Materials, changed: Callable[[], None]
    ) -> None:
        self.folders: dict[str, EffectFolder] = {}
        self._repeated: tuple[Effect, ...] = ()
        stage = None
        for effect_id in effect_ids():
            kind = effect_class(effect_id)
            if kind.stage != stage:
                stage = kind.stage
                gui.add_markdown(f"**{_STAGES[stage]}**")
            self.folders[effect_id] = EffectFolder(gui, kind, tags, materials, changed)

    def fill(self, effects: tuple[Effect, ...]) -> None:
        """Show a profile's effects. One that stands in it a second time has no controls, and stays as it is."""
        first: dict[str, Effect] = {}
        repeated = []
        for effect in effects:
            if effect.id in first:
                repeated.append(effect)
            first.setdefault(effect.id, effect)
        self._repeated = tuple(repeated)
        for effect_id, folder in self.folders.items():
            folder.fill(first.get(effect_id))

    def effects(self) -> tuple[Effect, ...]:
        """What is switched on."""
        chosen = [effect for folder in self.folders.values() if (effect := folder.effect()) is not None]
        return (*chosen, *self._repeated)
