"""The viewer's page in headless Chromium, with a real mouse; the server's state is what is checked."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp

pytest.importorskip("viser", reason="viser is not installed: pip install 'sixpoint[viewer]'")
sync_api = pytest.importorskip(
    "playwright.sync_api", reason="Playwright is not installed: pip install playwright"
)

from sixpoint.jobs.view.clips import sample_clips  # noqa: E402
from sixpoint.jobs.view.job import Page, open_page  # noqa: E402
from sixpoint.jobs.view.session import Session  # noqa: E402

QUIET = (
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
L_WRIST = 2


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Headless Chromium: the system's, or Playwright's own."""
    with sync_api.sync_playwright() as playwright:
        found = (
            shutil.which("chromium") or shutil.which("google-chrome") or playwright.chromium.executable_path
        )
        if not Path(found).is_file():
            pytest.skip("no Chromium: install it, or run `playwright install chromium`")
        browser = playwright.chromium.launch(executable_path=found, args=[*QUIET])
        yield browser
        browser.close()


@pytest.fixture
def page() -> Iterator[Page]:
    """The viewer on two built-in motions."""
    with open_page(sample_clips(["walk", "reach"])) as page:
        yield page


def wait_for(condition: Callable[[], Any], tab: Any, seconds: float = 30.0) -> None:
    """Wait until something is so, while the browser goes on."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        tab.wait_for_timeout(50)


def look(browser: Any, page: Page, width: int = 1000, height: int = 640) -> Any:
    """A tab that shows the page, from where it should be looked at."""
    tab = browser.new_page(viewport={"width": width, "height": height})
    before = set(page.server.get_clients())
    tab.goto(page.address)
    wait_for(lambda: set(page.server.get_clients()) - before, tab, 60)
    camera = page.server.get_clients()[max(page.server.get_clients())].camera
    wait_for(lambda: np.allclose(camera.look_at, page.server.initial_camera.look_at, atol=1e-3), tab)
    return tab


def on_screen(page: Page, point: np.ndarray) -> tuple[float, float]:
    """Where the newest browser shows a point of the world, by a pinhole camera [pixel]."""
    camera = page.server.get_clients()[max(page.server.get_clients())].camera
    x, y, z = Rotation.from_quat(camera.wxyz[[1, 2, 3, 0]]).inv().apply(point - camera.position)
    focal = camera.image_height / 2 / np.tan(camera.fov / 2)
    return focal * x / z + camera.image_width / 2, focal * y / z + camera.image_height / 2


def drag(tab: Any, start: tuple[float, float], by: tuple[float, float], drop: bool = True) -> None:
    """Drag with the mouse in a dozen steps."""
    x, y = start
    tab.mouse.move(x, y)
    tab.wait_for_timeout(600)  # the page finds out what is under the mouse once a frame
    tab.mouse.down()
    for k in range(1, 13):
        tab.mouse.move(x + by[0] * k / 12, y + by[1] * k / 12)
        tab.wait_for_timeout(60)
    if drop:
        tab.mouse.up()


def wrist(session: Session) -> np.ndarray:
    """The left wrist of the pose that is shown, by forward kinematics."""
    motion = sp.Motion.from_poses([session.pose], 60.0)
    return session.clip.figure.targets(motion).positions[0, L_WRIST]


def test_the_page_asks_nobody_else(browser, page):
    """All that the page loads, sockets included, comes from its own server."""
    tab = browser.new_page()
    asked: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("websocket", lambda opened: asked.append(opened.url))
    tab.goto(page.address)
    tab.get_by_text("six points").wait_for(timeout=60_000)
    tab.wait_for_timeout(2000)
    tab.close()
    own = urlsplit(page.address).netloc
    outside = [
        url
        for url in asked
        if not url.startswith("data:") and urlsplit(url.removeprefix("blob:")).netloc != own
    ]
    assert asked
    assert outside == []


def test_the_wrist_follows_the_mouse(browser, page):
    """The handle of the left wrist is dragged with the mouse, and the wrist is where it was dropped."""
    tab, session = look(browser, page), page.session
    before = wrist(session)
    start = on_screen(page, session.points[L_WRIST])
    drag(tab, start, (45.0, -60.0))
    wait_for(lambda: session.solution is not None, tab)
    wait_for(lambda: np.abs(session.points - session.goals).max() < 1e-4, tab)
    tab.wait_for_timeout(800)
    assert np.linalg.norm(wrist(session) - before) > 0.1
    assert np.linalg.norm(wrist(session) - session.goals[L_WRIST]) < 0.01
    seen = on_screen(page, wrist(session))
    assert np.hypot(seen[0] - start[0] - 45.0, seen[1] - start[1] + 60.0) < 15.0
    tab.close()


def test_the_method_is_switched_and_a_recording_scrubbed(browser, page):
    """A method is chosen from the list, and the frame is set by its number and by the slider."""
    tab, session = look(browser, page), page.session
    tab.get_by_role("textbox", name="method").or_(tab.locator("input[value='sik+']")).first.click()
    tab.get_by_role("option", name="kma", exact=True).click()
    wait_for(lambda: session.posing.method == "kma", tab)
    number = tab.locator(".mantine-NumberInput-input").first
    number.fill("33")
    number.press("Enter")
    wait_for(lambda: session.frame == 33, tab)
    expected = sp.KulpaMultonArnaldi(session.clip.figure).solve_motion(session.clip.targets).pose(33)
    np.testing.assert_array_equal(session.pose.rotations, expected.rotations)
    box = tab.locator(".mantine-Slider-track").first.bounding_box()
    tab.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + box["height"] / 2)
    frames = len(session.clip.targets)
    wait_for(lambda: abs(session.frame - 0.75 * frames) < 0.1 * frames, tab)
    tab.close()


def test_five_browsers_and_one_that_closes_while_dragging(browser, page):
    """Five tabs see the page; one is closed in the middle of a drag, and the others go on."""
    first, session = look(browser, page), page.session
    drag(first, on_screen(page, session.points[L_WRIST]), (40.0, -40.0), drop=False)
    wait_for(lambda: session.solution is not None, first)
    others = [look(browser, page), *(look(browser, page, 160, 120) for _ in range(3))]
    assert len(page.server.get_clients()) == 5
    first.close()
    for small in others[1:]:
        small.close()
    wait_for(lambda: len(page.server.get_clients()) == 1, others[0])
    others[0].get_by_role("button", name="Reset").click()
    wait_for(lambda: session.solution is None, others[0])
    others[0].get_by_role("button", name="Play").click()
    wait_for(lambda: session.playing and session.frame > 5, others[0])
    others[0].close()
