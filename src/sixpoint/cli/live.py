"""``sixpoint live``: trackers in, an avatar out."""

from __future__ import annotations

import queue
import sys
import threading
import time
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from sixpoint.cli.options import Force
from sixpoint.cli.screen import Screen
from sixpoint.cli.view import check_viser

KEYS = "p pause, r recentre, c calibrate, n begin anew, q quit (and Enter)"
WAIT = 3.0  # s, before a calibration begins


def live(
    *,
    vmc_in: Annotated[int | None, Parameter(help="Port to listen on for VMC; 39540 by default.")] = None,
    vrchat_in: Annotated[int | None, Parameter(help="Port to listen on for VRChat's OSC trackers.")] = None,
    plain_in: Annotated[
        int | None, Parameter(help="Port to listen on for JSON of your own trackers.")
    ] = None,
    host: Annotated[
        str, Parameter(help="Address to listen on; 0.0.0.0 lets any machine of the network send.")
    ] = "127.0.0.1",
    vmc_out: Annotated[
        list[str] | None, Parameter(help="Receivers of VMC, as 127.0.0.1:39539.", negative="")
    ] = None,
    vrchat_out: Annotated[
        list[str] | None, Parameter(help="Receivers of VRChat's trackers, as 127.0.0.1:9000.", negative="")
    ] = None,
    method: Annotated[str, Parameter(help="How to solve; see `sixpoint reconstruct --help`.")] = "sik+",
    stature: Annotated[float, Parameter(help="Of the person [m].")] = 1.75,
    rotations: Annotated[
        str | None,
        Parameter(help="Whose rotations are used too, once mounts are known: `all`, or pelvis,head,..."),
    ] = None,
    no_limits: Annotated[bool, Parameter(negative="", help="Do not keep joint limits.")] = False,
    smoothing: Annotated[
        Literal["off", "light", "strong"], Parameter(help="One Euro filter on what arrives.")
    ] = "off",
    posture: Annotated[
        Literal["standing", "sitting"], Parameter(help="Where legs without trackers are.")
    ] = "standing",
    rate: Annotated[
        float, Parameter(help="Poses a second that a timer keeps up where packets do not [Hz].")
    ] = 90.0,
    duration: Annotated[float | None, Parameter(help="Seconds; until stopped by default.")] = None,
    profile: Annotated[Path | None, Parameter(help="Profile of the person; --calibrate writes it.")] = None,
    calibrate: Annotated[
        bool, Parameter(negative="", help="Find roles, mounts and lengths first: stand still, then move.")
    ] = False,
    record: Annotated[Path | None, Parameter(help="Record all that arrives to this file.")] = None,
    view: Annotated[
        bool, Parameter(negative="", help="Show the body in the browser; needs sixpoint[viewer].")
    ] = False,
    force: Force = False,
) -> None:
    """Pose an avatar live from trackers that arrive over the network.

    A tracker whose serial is pelvis, head, l_wrist, r_wrist, l_ankle or r_ankle (or chest, l_elbow, r_elbow,
    l_knee, r_knee) plays that role; a headset is the head. What has no tracker is filled in. Solves as soon
    as a set of trackers is complete.

    For example:

    ```
    sixpoint live --vmc-in 39540 --vmc-out 127.0.0.1:39539
    sixpoint live --vmc-in 39540 --view
    sixpoint live --vrchat-in 9000 --vmc-out 39539 --smoothing light
    sixpoint live --plain-in 5005 --vrchat-out 9000 --record take.jsonl
    sixpoint live --vmc-in 39540 --vmc-out 39539 --profile me.toml --calibrate
    ```
    """
    from sixpoint.errors import SixpointError
    from sixpoint.jobs.live import (
        VMC_IN,
        VMC_OUT,
        VRCHAT_OUT,
        FitCheck,
        Live,
        parse_address,
    )
    from sixpoint.jobs.solving import parse_rotations
    from sixpoint.live.calibrating import Calibrating

    screen = Screen()
    inputs = {"vmc": vmc_in, "vrchat": vrchat_in, "plain": plain_in}
    chosen = {name: port for name, port in inputs.items() if port is not None} or {"vmc": VMC_IN}
    if len(chosen) > 1:
        raise SixpointError("listen to one protocol at a time: give one of --vmc-in, --vrchat-in, --plain-in")
    protocol, port = next(iter(chosen.items()))
    settings = Live(
        protocol=protocol,
        port=port,
        host=host,
        vmc_out=tuple(parse_address(text, VMC_OUT) for text in vmc_out or ()),
        vrchat_out=tuple(parse_address(text, VRCHAT_OUT) for text in vrchat_out or ()),
        method=method,
        stature=stature,
        rotations=parse_rotations(rotations or ""),
        limits=not no_limits,
        smoothing=smoothing,
        posture=posture,
        rate=rate,
        record=record,
        profile=profile,
    )
    if profile is None and calibrate:
        raise SixpointError("say with --profile FILE where to keep the calibration")
    if profile is not None and not calibrate and not profile.exists():
        raise SixpointError(f"{profile} does not exist; --calibrate makes it")
    if calibrate and profile is not None and profile.exists() and not force:
        raise SixpointError(f"{profile} exists; use --force to calibrate anew")
    loop = settings.make_loop()
    channel = loop.channels[0]
    page = None
    if view:
        check_viser()
        from sixpoint.jobs.live_view import LiveView

        page = LiveView(channel.session.figure)
        loop.watch = page.watch
        screen.say(f"look at {page.address[0]}")
    screen.say(f"listening for {protocol} on {host}:{channel.port}; {KEYS}")
    if host not in ("127.0.0.1", "localhost"):
        screen.note(f"{host} can be reached from other machines: anybody on the network may send trackers")
    if not channel.outputs:
        screen.note("nobody receives the poses: give --vmc-out or --vrchat-out")
    keys: queue.SimpleQueue[str] = queue.SimpleQueue()
    if sys.stdin is not None and sys.stdin.isatty():
        threading.Thread(target=_read_keys, args=(keys,), daemon=True).start()
    told = 0.0
    said = ""
    known = None if calibrate else settings.read_profile()
    check = None if known is None else FitCheck(known)
    if calibrate:
        channel.calibrating = Calibrating(time.perf_counter() + WAIT)

    def tick(elapsed: float) -> None:
        nonlocal told, check
        misfits = None if check is None else check.take(channel.session.seen)
        if misfits is not None:
            check = None
            for text in misfits:
                screen.note(f"the profile may not fit: {text}", "warning", "yellow")
        while not keys.empty():
            key = keys.get()
            if key == "p":
                channel.session.paused = not channel.session.paused
            elif key == "r":
                channel.session.recentre()
            elif key == "n":
                channel.session.forget()
            elif key == "c":
                channel.calibrating = Calibrating(time.perf_counter())
            elif key == "q":
                loop.stop()
        if channel.calibrating is not None:
            calibrate_on()
        if elapsed - told >= 5.0:
            told = elapsed
            screen.say(channel.statistics.line())

    def calibrate_on() -> None:
        nonlocal said
        going, now = channel.calibrating, time.perf_counter()
        assert going is not None
        line = going.say(now)
        if line.split("(")[0] != said:
            said = line.split("(")[0]
            screen.say(line)
        if not going.take(now, channel.session.seen):
            return
        channel.calibrating = None
        try:
            outcome = going.finish()
        except SixpointError as error:
            screen.note(str(error), "warning", "yellow")
            return
        for note in outcome.notes:
            screen.note(note)
        channel.session = settings.make_session(outcome.profile)
        channel.outputs = settings.make_outputs(channel.session)
        try:
            settings.keep_profile(outcome.profile, force=force)
            screen.say(f"calibrated: {profile}" if profile else "calibrated; --profile FILE would keep it")
        except SixpointError as error:
            screen.note(f"calibrated, but not kept: {error}", "warning", "yellow")

    try:
        loop.run(duration, tick)
    except KeyboardInterrupt:
        pass
    finally:
        loop.close()
        if page is not None:
            page.close()
        if loop.recorder is not None:
            loop.recorder.close()
    screen.say(channel.statistics.line())
    counts = {**channel.session.counts, **channel.statistics.counts}
    rows = [(what, str(n)) for what, n in sorted(counts.items()) if n]
    if rows:
        screen.rows(rows)


def _read_keys(keys: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        keys.put(line.strip().lower()[:1])
