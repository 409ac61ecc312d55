"""The controls beside the scene: told what methods and options there are, it reports what is chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import viser

from sixpoint.viewer.colours import BRAND
from sixpoint.viewer.curve import Curve
from sixpoint.viewer.scene import OBSTACLES, Report

SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "4x")
TRUTHS = ("over", "beside", "hidden")
UP, DOWN, ON, OFF = "▲", "▼", "on", "off"


@dataclass(frozen=True)
class Choice:
    """One of several values."""

    options: tuple[str, ...]


@dataclass(frozen=True)
class Setting:
    """A value that the user may set.

    Attributes:
        name: By which it is reported, as ``("setting", (name, value))``.
        label: What the page calls it.
        value: bool, number, or one of a choice.
        domain: Least and largest number, or a choice; None for a bool.
        hint: Shown when the mouse rests on it.
        folder: Name of a closed folder in which it is found; empty for none.
    """

    name: str
    label: str
    value: bool | float | str
    domain: tuple[float, float] | Choice | None = None
    hint: str | None = None
    folder: str = ""


class Panel:
    """The controls.

    Reports ``"clip"`` (name), ``"play"``, ``"frame"`` (number), ``"speed"`` (factor), ``"truth"`` (one of
    ``TRUTHS``), ``"method"`` (name), ``"setting"`` (name, value), ``"task"`` (row, one of the four signs),
    ``"show obstacle"`` (number, bool), ``"reset"``, ``"save pose"`` and ``"save motion"`` (name of a file).

    Args:
        server: Where.
        report: Told what is chosen, on the server's thread.
        clips: Names of recordings; of several one is chosen.
        methods: Their names.
        method: The one at the beginning.
        saves: Whether poses and motions may be saved.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        report: Report,
        clips: Sequence[str],
        methods: Sequence[str],
        method: str,
        saves: bool,
    ) -> None:
        self._report = report
        gui: Any = server.gui  # its values are typed in a way that mypy takes for read-only
        self._gui = gui
        gui.configure_theme(
            show_logo=False, show_share_button=False, brand_color=BRAND, control_width="medium"
        )
        gui.set_panel_label("sixpoint")
        self._status = gui.add_html("")
        with gui.add_folder("Motion") as self._motion:
            self._clip = gui.add_dropdown("recording", tuple(clips) or ("-",), visible=len(clips) > 1)
            self._frame = gui.add_slider("frame", 0, 1, 1, 0)
            self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
            self._speed = gui.add_dropdown("speed", SPEEDS, initial_value="1x")
            self._truth = gui.add_dropdown(
                "truth", TRUTHS, initial_value="over", hint="The recording, in grey"
            )
        self._motion.visible = False
        self.curve = Curve(gui)
        self._method = gui.add_dropdown("method", tuple(methods), initial_value=method)
        self._settings_folder = gui.add_folder("Options", expand_by_default=True)
        self._settings: list[Any] = []
        self._tasks_folder = gui.add_folder("Priorities", visible=False)
        self._tasks: list[Any] = []
        with gui.add_folder("Obstacles", expand_by_default=False):
            self._obstacles = [gui.add_checkbox(name, False) for name in OBSTACLES]
        self._reset = gui.add_button("Reset", icon=viser.Icon.REFRESH)
        with gui.add_folder("Save", expand_by_default=False, visible=saves):
            self._name = gui.add_text("name", "pose")
            self._save_pose = gui.add_button("Save pose")
            self._save_motion = gui.add_button("Save motion")
        self._connect()

    def _connect(self) -> None:
        def tell(
            name: str, value: Callable[[Any], Any] = lambda target: target.value
        ) -> Callable[[Any], Any]:
            async def callback(event: Any) -> None:
                if event.client_id is not None:  # else it was set from here
                    self._report(name, value(event.target))

            return callback

        self._clip.on_update(tell("clip"))
        self._frame.on_update(tell("frame"))
        self._speed.on_update(tell("speed", lambda target: float(target.value[:-1])))
        self._truth.on_update(tell("truth"))
        self._method.on_update(tell("method"))
        for number, box in enumerate(self._obstacles):
            box.on_update(tell("show obstacle", partial(_numbered, number)))
        self._play.on_click(tell("play"))
        self._reset.on_click(tell("reset"))
        self._save_pose.on_click(tell("save pose", lambda _: self._name.value))
        self._save_motion.on_click(tell("save motion", lambda _: self._name.value))
        self._tell = tell

    # --- what is shown -----------------------------------------------------------------------------

    def set_clip(self, name: str, frames: int, has_truth: bool) -> None:
        """A recording of so many frames; 1 and less for none, which hides its controls."""
        self._motion.visible = frames > 1
        self._truth.visible = has_truth
        if frames > 1:
            self._frame.value = 0
            self._frame.max = frames - 1
        if name in self._clip.options:
            self._clip.value = name

    def set_frame(self, frame: int) -> None:
        """Move the scrubber."""
        self._frame.value = frame

    def set_playing(self, playing: bool) -> None:
        """What the button does next."""
        self._play.label = "Pause" if playing else "Play"
        self._play.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY

    def set_method(self, name: str) -> None:
        """Which method is chosen."""
        self._method.value = name

    def set_settings(self, settings: Sequence[Setting]) -> None:
        """Put others in place of the options."""
        for control in self._settings:
            control.remove()
        self._settings, folders = [], {}
        with self._settings_folder:
            for setting in settings:
                if not setting.folder:
                    self._settings.append(self._add_setting(setting))
                    continue
                if setting.folder not in folders:
                    folders[setting.folder] = self._gui.add_folder(setting.folder, expand_by_default=False)
                with folders[setting.folder]:
                    self._add_setting(setting)
        self._settings += folders.values()
        self._settings_folder.visible = bool(settings)

    def _add_setting(self, setting: Setting) -> Any:
        gui, domain = self._gui, setting.domain
        control: Any
        if isinstance(domain, Choice):
            control = gui.add_dropdown(
                setting.label, domain.options, initial_value=str(setting.value), hint=setting.hint
            )
        elif domain is None:
            control = gui.add_checkbox(setting.label, bool(setting.value), hint=setting.hint)
        else:
            whole = isinstance(setting.value, int)
            step = 1 if whole else round((domain[1] - domain[0]) / 200, 6)
            low, high = (int(domain[0]), int(domain[1])) if whole else domain
            control = gui.add_slider(setting.label, low, high, step, setting.value, hint=setting.hint)
        control.on_update(self._tell("setting", lambda target: (setting.name, target.value)))
        return control

    def set_tasks(self, rows: Sequence[tuple[str, bool]]) -> None:
        """Tasks of prioritized IK from the most important: what each row says, and whether it is on."""
        while len(self._tasks) > len(rows):
            self._tasks.pop().remove()
        with self._tasks_folder:
            while len(self._tasks) < len(rows):
                row = len(self._tasks)
                group = self._gui.add_button_group("", (UP, DOWN, ON))
                group.on_click(self._tell("task", partial(_numbered, row)))
                self._tasks.append(group)
        for group, (label, on) in zip(self._tasks, rows, strict=True):
            group.label = label
            group.options = (UP, DOWN, ON if on else OFF)
        self._tasks_folder.visible = bool(rows)

    def say(self, html: str) -> None:
        """The lines on top, as HTML: the caller escapes what is not its own."""
        if self._status.content != html:
            self._status.content = html


def _numbered(number: int, control: Any) -> tuple[int, Any]:
    return number, control.value
