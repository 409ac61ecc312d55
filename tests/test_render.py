"""Pictures without a display: what is in view, how it is lit, and the files that come out."""

from __future__ import annotations

import importlib.util
from io import BytesIO

import numpy as np
import pytest

import sixpoint as sp
from body_rigs import family_skeleton
from sixpoint.body import rotations as rot
from sixpoint.body.surface.appearance import Texture, Texturing, halved
from sixpoint.body.surface.flesh import build_shape
from sixpoint.body.surface.shape import Shape
from sixpoint.cli import main
from sixpoint.errors import SixpointError
from sixpoint.jobs import render as job
from sixpoint.render.camera import FIELD, Camera
from sixpoint.render.colours import paint
from sixpoint.render.encoding import find_codec, lay_out
from sixpoint.render.light import find_key, of_hex, spread_over_sphere, to_linear, to_srgb
from sixpoint.render.painting import Painting
from sixpoint.render.surface import Surface

pytest.importorskip("embreex", reason="pictures need the extra [render]")
av = pytest.importorskip("av", reason="films need the extra [render]")
Image = pytest.importorskip("PIL.Image", reason="pictures need the extra [render]")

from sixpoint.render.picture import Body, _Shading  # noqa: E402
from sixpoint.render.stage import Actor, Stage  # noqa: E402
from sixpoint.render.tracing import Tracer  # noqa: E402

SIZE = (80, 96)


def actor_of(motion, figure, colours="sides", ghost=False):
    shape = build_shape(figure)
    return Actor(figure, motion, Surface(shape, paint(figure, shape, colours)), ghost)


@pytest.fixture(scope="module")
def figure():
    return sp.Figure.from_stature(1.75)


@pytest.fixture(scope="module")
def boxing(figure):
    return sp.make_sample("boxing", figure).sliced(slice(0, 30))


@pytest.fixture(scope="module")
def stage(figure, boxing):
    return Stage([actor_of(boxing, figure)], SIZE)


@pytest.fixture(scope="module")
def file(boxing, tmp_path_factory):
    path = tmp_path_factory.mktemp("motion") / "boxing.bvh"
    sp.save(boxing, path)
    return path


def draw(file, out, **options):
    return job.render(file, out, look=job.Look(size=SIZE, **options))


def figure_mask(picture):
    """Pixels that are coloured: background and floor are nearly grey."""
    spread = picture.max(axis=2).astype(int) - picture.min(axis=2)
    return spread > 40


def _first_frame(file):
    out = file.with_name("first.png")
    job.render(file, out, look=job.Look(size=SIZE, pictures=1), force=True)
    return out.read_bytes()


# --- camera and light ----------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(640, 360), (200, 700), (300, 300)])
def test_the_camera_has_all_points_in_view_and_is_as_near_as_can_be(size):
    """All points project into the picture with the margin, and some touch it on two opposite sides."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3)) * [0.5, 1.0, 0.4] + [3.0, 1.0, -2.0]
    for yaw, pitch in rng.uniform([-3, -0.5], [3, 1.0], (20, 2)):
        camera = Camera.framing(points, yaw, pitch, size, margin=1.1)
        share = np.abs(camera.project(points) / (np.array(size) / 2.0) - 1.0)
        assert share.max() < 1.0 / 1.1 + 1e-9
        off = camera.project(points) - np.array(size) / 2.0
        reach = np.array(size) / 2.0 / 1.1
        touched = [(np.abs(off[:, k]).max() > reach[k] - 1e-6) for k in (0, 1)]
        assert any(touched)
        k = touched.index(True)
        np.testing.assert_allclose([off[:, k].max(), -off[:, k].min()], reach[k], atol=1e-6)


def test_rays_pass_through_the_pixels_of_what_they_meet():
    """``project`` and ``cast`` are inverse to each other."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(100, 3))
    camera = Camera.framing(points, 0.7, 0.2, (640, 480))
    pixels = camera.project(points)
    rays = camera.cast(*pixels.T).astype(float)
    expected = points - camera.eye
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(rays, expected, atol=1e-6)
    assert np.degrees(2 * np.arctan(np.tan(FIELD / 2))) == pytest.approx(26.0)


def test_colours_survive_the_way_to_light_and_back():
    """From sRGB to linear light and back is the identity on bytes; middle grey is darker in linear light."""
    bytes_ = np.arange(256)
    np.testing.assert_array_equal(to_srgb(to_linear(bytes_ / 255.0)), bytes_)
    assert of_hex("#808080")[0] == pytest.approx(0.2158, abs=1e-3)
    assert np.linalg.norm(spread_over_sphere(200).mean(axis=0)) < 0.02


def test_rays_meet_triangles_where_geometry_says():
    """Distances and barycentric shares of a known triangle; what is in the way and what is beyond reach."""
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0]], np.float32)
    tracer = Tracer(corners, np.array([[0, 1, 2]]))
    start = np.array([[0.5, 0.25, 3.0], [5.0, 5.0, 3.0]], np.float32)
    ahead = np.tile(np.array([0, 0, -1], np.float32), (2, 1))
    hits = tracer.find_nearest(start, ahead)
    np.testing.assert_array_equal(hits.rays, [0])
    np.testing.assert_allclose(hits.shares @ corners, [[0.5, 0.25, 0.0]], atol=1e-6)
    assert hits.distances[0] == pytest.approx(3.0)
    assert tracer.find_blocked(start, ahead).tolist() == [True, False]
    assert tracer.find_blocked(start, ahead, 2.0).tolist() == [False, False]


# --- pictures ------------------------------------------------------------------------------------


def test_a_picture_shows_the_body_whole_before_a_bright_background(stage):
    """The body is there, not cut off, left and right in their colours; the corners are bright."""
    picture = stage.take(0)
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert picture.dtype == np.uint8
    mask = figure_mask(picture)
    assert 0.04 < mask.mean() < 0.5
    assert not mask[0].any()
    assert not mask[-1].any()
    assert not mask[:, [0, -1]].any()
    assert picture[:3, :3].min() > 225
    red, blue = picture[..., 0].astype(int), picture[..., 2].astype(int)
    assert (red - blue > 60).sum() > 20  # the right side
    assert (blue - red > 60).sum() > 20  # the left side


def test_pictures_are_deterministic(figure, boxing, stage):
    """A stage made anew takes the same picture to the byte, and so does one that took others before."""
    stage.take(20)
    again = Stage([actor_of(boxing, figure)], SIZE).take(7)
    np.testing.assert_array_equal(stage.take(7), again)


def test_soft_shadows_have_no_dots():
    """In a half shadow, light goes evenly from dark to bright: neighbours differ as those next but one do."""
    square = np.array([[-1.0, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]])
    roof = square * [0.35, 0.0, 0.35] + [-0.3, 0.8, 0.5]
    vertices = np.concatenate([square, roof]).astype(np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    up = np.tile(np.float32([0, 1, 0]), (8, 1))
    body = Body(vertices, up, triangles, np.full((8, 3), 0.5, np.float32))
    camera = Camera.framing(square, 0.3, 0.5, (240, 160))
    light = _Shading(body, camera, find_key(camera.axes[0], camera.axes[2])).run()[0][..., 1]
    inner = light[50:90, 60:180]
    assert inner.max() > 1.5 * inner.min()  # there is a shadow
    dots = inner[:, 1:-1] - (inner[:, :-2] + inner[:, 2:]) / 2
    assert np.abs(dots).max() < 0.05 * np.ptp(inner)


@pytest.mark.parametrize("view", ["front", "three-quarter", "side", "back"])
def test_views_are_from_where_the_body_faces(figure, view):
    """From the front the left side (teal) is on the right of the picture, from the back it is on its left."""
    still = figure.compute_motion(np.tile(rot.IDENTITY, (1, len(figure.skeleton), 1)), np.zeros((1, 3)), 30.0)
    turned = figure.compute_motion(
        np.concatenate(
            [
                rot.from_axis_angle(np.array([0.0, 1, 0]), np.array([[2.0]])),
                np.tile(rot.IDENTITY, (1, len(figure.skeleton) - 1, 1)),
            ],
            axis=1,
        ),
        np.zeros((1, 3)),
        30.0,
    )
    pictures = [Stage([actor_of(m, figure)], SIZE, view).take(0).astype(int) for m in (still, turned)]
    for picture in pictures:
        teal = np.argwhere(picture[..., 2] - picture[..., 0] > 60)[:, 1]
        orange = np.argwhere(picture[..., 0] - picture[..., 2] > 60)[:, 1]
        if view == "side":
            assert len(teal) > 3 * len(orange)
        else:
            assert (teal.mean() > orange.mean()) == (view != "back")
    assert np.abs(figure_mask(pictures[0]).mean() - figure_mask(pictures[1]).mean()) < 0.02


def test_the_floor_is_below_the_feet_and_darker_beside_them(figure):
    """Standing soles are on the floor within 5 mm wherever the origin is, and there is a shadow."""
    local = np.tile(rot.IDENTITY, (5, len(figure.skeleton), 1))
    for height in (0.0, -0.3, 0.05):
        pelvis = np.tile([0.0, figure.skeleton.offsets[0, 1] + height, 0.0], (5, 1))
        actor = actor_of(figure.compute_motion(local, pelvis, 30.0), figure)
        stage = Stage([actor], SIZE)
        assert stage.floor == pytest.approx(height, abs=0.005)
        floor_rows = stage.take(0)[-22:].astype(int).sum(axis=2)
        assert floor_rows.min() < 620 < floor_rows.max()


def test_a_body_in_the_air_does_not_carry_the_floor(figure):
    """Somebody who hangs a metre above the floor hangs above it."""
    local = np.tile(rot.IDENTITY, (3, len(figure.skeleton), 1))
    actor = actor_of(figure.compute_motion(local, np.tile([0.0, 2.0, 0.0], (3, 1)), 30.0), figure)
    assert Stage([actor], SIZE).floor == 0.0


def test_the_camera_follows_who_goes_far(figure):
    """A walk over ten metres stays in the middle and large; without following it is small."""
    frames = 90
    pelvis = np.stack([np.zeros(frames), np.full(frames, 1.03), np.linspace(0, 10, frames)], axis=-1)
    local = np.tile(rot.IDENTITY, (frames, len(figure.skeleton), 1))
    actor = actor_of(figure.compute_motion(local, pelvis, 30.0), figure)
    follows, stands = Stage([actor], SIZE, "side"), Stage([actor], SIZE, "side", follow=False)
    shares = [figure_mask(follows.take(k)).mean() for k in (0, 45, 89)]
    assert min(shares) > 0.5 * max(shares) > 0
    assert figure_mask(stands.take(45)).mean() < 0.3 * min(shares)


def test_a_ghost_is_seen_behind_and_changes_nothing_before(figure, boxing):
    """Where the ghost is the same motion nothing of it is seen; moved aside it darkens the background."""
    body = actor_of(boxing, figure)
    stage = Stage([body], SIZE)
    same = Stage([body, actor_of(boxing, figure, "ghost", ghost=True)], SIZE)
    one, two = stage.take(0).astype(int), same.take(0).astype(int)
    assert np.abs(one - two)[figure_mask(one.astype(np.uint8))].max() < 40  # edges blend
    aside = sp.Motion(boxing.skeleton, boxing.rotations, boxing.translations + [0.6, 0, 0], boxing.rate)
    both = Stage([body, actor_of(aside, figure, "ghost", ghost=True)], SIZE, follow=False)
    assert both.take(0).mean() < stage.take(0).mean() + 5
    assert len(both.take(0)) == SIZE[1]


def test_transparent_triangles_are_not_drawn(figure, boxing):
    """What is wholly transparent is left out; a shape of nothing else is an error."""
    shape = build_shape(figure)
    colours = paint(figure, shape)
    colours[np.unique(shape.triangles[shape.parts["trunk"]]), 3] = 0.0
    surface = Surface(shape, colours)
    assert len(surface.triangles) == len(shape.triangles) - (
        shape.parts["trunk"].stop - shape.parts["trunk"].start
    )
    with pytest.raises(SixpointError, match="nothing to draw"):
        Stage([Actor(figure, boxing, Surface(shape, colours * [1, 1, 1, 0]))], SIZE)


def test_smooth_normals_are_unit_and_point_outward(figure, boxing):
    """Normals of the placed mesh have unit length and lean to the side of their triangles."""
    surface = actor_of(boxing, figure).surface
    vertices, normals = surface.place(*(a[10] for a in boxing.transforms))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    faces = vertices[surface.triangles].astype(float)
    flat = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    lean = np.einsum("tc,tkc->tk", flat, normals[surface.triangles].astype(float)).min(axis=1)
    assert (lean > 0.3).mean() > 0.98


def test_any_rig_can_be_drawn():
    """A rig of other names and frames has a body in its picture."""
    figure = sp.Figure.from_skeleton(family_skeleton("unity"))
    motion = figure.compute_motion(
        np.tile(rot.IDENTITY, (1, len(figure.skeleton), 1)), np.zeros((1, 3)), 30.0
    )
    assert figure_mask(Stage([actor_of(motion, figure)], SIZE).take(0)).mean() > 0.04


# --- files ---------------------------------------------------------------------------------------


def test_a_film_has_the_frames_of_its_rate_and_real_speed(file, tmp_path):
    """Half a second of motion is 8 pictures at 15 Hz, H.264 or what there is, of the size asked for."""
    out = tmp_path / "film.mp4"
    done = draw(file, out, fps=15.0)
    with av.open(str(out)) as film:
        stream = film.streams.video[0]
        assert (stream.width, stream.height) == SIZE
        assert stream.average_rate == 15
        assert stream.pix_fmt == "yuv420p" or find_codec()[0] != "libx264"
        decoded = list(film.decode(stream))
        assert {frame.colorspace for frame in decoded} == {1}  # BT.709
        pictures = [frame.to_ndarray(format="rgb24", src_colorspace="ITU709") for frame in decoded]
    assert len(pictures) == done.pictures == 8
    assert figure_mask(pictures[3]).mean() > 0.03
    still = np.asarray(Image.open(BytesIO(_first_frame(file))).convert("RGB")).astype(int)
    assert np.abs(still - pictures[0]).mean() < 4


def test_another_codec_stands_in(monkeypatch):
    """Where FFmpeg lacks H.264 the next codec is taken; without any the error says so."""
    from sixpoint.render import encoding

    monkeypatch.setattr(encoding, "CODECS", (("no_such_codec", {}), ("mpeg4", {})))
    data = encoding.encode_film([np.full((32, 48, 3), 90, np.uint8)] * 3, 10.0)
    with av.open(BytesIO(data)) as film:
        assert sum(1 for _ in film.decode(video=0)) == 3
    monkeypatch.setattr(encoding, "CODECS", (("no_such_codec", {}),))
    with pytest.raises(SixpointError, match="write frames instead"):
        encoding.encode_film([], 10.0)


def test_frames_are_pngs_of_a_folder(file, tmp_path):
    """Numbered files, one per picture."""
    draw(file, tmp_path / "frames", fps=8.0)
    found = sorted((tmp_path / "frames").iterdir())
    assert [p.name for p in found] == [f"frame_{k:04d}.png" for k in range(4)]
    with Image.open(found[0]) as image:
        assert image.size == SIZE


@pytest.mark.parametrize(("count", "columns", "grid"), [(5, None, (5, 1)), (8, None, (4, 2)), (3, 2, (2, 2))])
def test_a_sheet_is_a_grid(file, tmp_path, count, columns, grid):
    """Pictures are in rows as even as can be, four pixels apart, with the last row filled up white."""
    done = draw(file, tmp_path / "sheet.png", pictures=count, columns=columns)
    assert done.pictures == count
    with Image.open(tmp_path / "sheet.png") as image:
        assert image.size == (grid[0] * (SIZE[0] + 4) - 4, grid[1] * (SIZE[1] + 4) - 4)
        rest = np.asarray(image)[-SIZE[1] :, (count - (grid[1] - 1) * grid[0]) * (SIZE[0] + 4) :]
    assert rest.size == 0 or (rest == 255).all()


def test_labels_are_written_in_the_corner():
    """A label changes pixels in the upper left corner only."""
    plain = np.full((96, 80, 3), 240, np.uint8)
    with_label = lay_out([plain], ["1.25 s"], 1)
    changed = np.argwhere((with_label != plain).any(axis=2))
    assert len(changed) > 10
    assert (changed.max(axis=0) < [24, 60]).all()


def test_a_single_frame_is_a_picture_without_a_label(file, tmp_path):
    """``--frames 10`` into a .png is that frame alone."""
    assert (
        main(["render", str(file), "-o", str(tmp_path / "a.png"), "--frames", "10", "--size", "80x96"]) == 0
    )
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == SIZE


# --- errors --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "film.gif"], "folder of frames"),
        (["-o", "boxing.mp4", "--size", "81x96"], "even in both"),
        (["-o", "a.png", "--size", "8x9"], "16 to 4096"),
        (["-o", "a.png", "--size", "large"], "640x720"),
        (["-o", "a.png", "--size", "4096x4096", "--pictures", "30"], "too much for a sheet"),
        (["-o", "a.png", "--colours", "pink"], "sides, clay"),
        (["-o", "a.mp4", "--fps", "0"], "0.1 to 240"),
        (["-o", "a.png", "--fps", "10"], "--fps: only for a film"),
        (["-o", "a.mp4", "--columns", "2"], "--columns: only for a contact sheet"),
        (["-o", "a.png", "--pictures", "0"], "at least one"),
        (["-o", "nowhere/a.png"], "does not exist"),
        (["-o", "a.png", "--frames", "900:"], "hold nothing"),
        (["-o", "a.png", "--over", "missing.bvh"], "missing.bvh"),
    ],
)
def test_what_cannot_be_drawn_is_said(file, tmp_path, monkeypatch, capsys, words, message):
    """Each wrong option ends in one line that names it, and no file is written."""
    monkeypatch.chdir(tmp_path)
    assert main(["render", str(file), *words]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_nothing_is_overwritten_without_force(file, tmp_path, capsys):
    """An existing file or a folder with files is kept, with --force it is replaced."""
    out, folder = tmp_path / "a.png", tmp_path / "frames"
    out.write_text("mine")
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    words = ["render", str(file), "--size", "80x96", "--frames", "0:2"]
    assert main([*words, "-o", str(out)]) == 2
    assert main([*words, "-o", str(folder)]) == 2
    assert "--force" in capsys.readouterr().err
    assert out.read_text() == "mine"
    assert main([*words, "-o", str(out), "--force"]) == 0
    assert main([*words, "-o", str(folder), "--force"]) == 0
    assert (folder / "notes.txt").read_text() == "mine"
    assert (folder / "frame_0000.png").exists()


def test_six_points_have_no_body(tmp_path, capsys):
    """Points are refused with the command that poses them."""
    figure = sp.Figure.from_stature(1.75)
    path = tmp_path / "points.csv"
    sp.save_targets(figure.targets(sp.make_sample("walk", figure).sliced(slice(0, 3))), path)
    assert main(["render", str(path), "-o", str(tmp_path / "a.png")]) == 2
    assert "sixpoint reconstruct" in capsys.readouterr().err


def test_missing_libraries_are_named_with_their_extra(file, tmp_path, monkeypatch, capsys):
    """Without Embree or PyAV the message says what to install, before anything is read."""
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name in ("av", "embreex") else found(name)
    )
    assert main(["render", str(file), "-o", str(tmp_path / "a.png")]) == 2
    message = capsys.readouterr().err
    assert "embreex, av (PyAV)" in message
    assert 'pip install "sixpoint[render]"' in message


def stripes(size=64):
    """A texture of black and white columns, one pixel each, and its smaller copies."""
    level = np.full((size, size, 4), 255, np.uint8)
    level[:, ::2, :3] = 0
    levels = [level]
    while len(levels[-1]) > 4:
        levels.append(halved(levels[-1]))
    return Texture(tuple(levels))


def test_a_texture_is_sampled_between_its_pixels():
    """In pixels' middles their own light; half-way the mean of neighbours; beyond the sides as asked."""
    texture = stripes()
    column = (np.arange(64) + 0.5) / 64
    found = texture.sample(np.column_stack([column, np.full(64, 0.3)]))
    np.testing.assert_allclose(found[:, 0], np.arange(64) % 2, atol=1e-12)
    between = texture.sample(np.array([[2 / 64, 0.5]]))
    np.testing.assert_allclose(between, [[0.5, 0.5, 0.5, 1.0]], atol=1e-12)
    beyond = np.column_stack([[-0.5 / 64, -1.5 / 64, 1.0 + 0.5 / 64], [0.5] * 3])
    for wrap, expected in (("repeat", [1, 0, 0]), ("clamp", [0, 0, 1]), ("mirror", [0, 1, 1])):
        shown = Texture(texture.levels, (wrap, wrap)).sample(beyond)
        np.testing.assert_allclose(shown[:, 0], expected, atol=1e-12, err_msg=wrap)


@pytest.mark.parametrize(("far", "contrast"), [(1e-4, 0.9), (10.0, 0.05)])
def test_textures_are_as_fine_as_the_picture(far, contrast):
    """Near, stripes are stripes; where a step of the picture covers many, they are an even grey."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    places = corners[:, :2]
    shape = Shape(
        corners,
        [[0, 1, 2], [0, 2, 3]],
        np.zeros((4, 1), int),
        np.ones((4, 1)),
        np.zeros((1, 3)),
        [[0, 0, 0, 1]],
    )
    texturing = Texturing((stripes(),), np.array([0, -1]), places, np.ones((4, 4)))
    painting = Painting(texturing, shape, np.arange(2))
    shares = np.random.default_rng(0).dirichlet(np.ones(3), 500).astype(np.float32)
    colours = np.full((500, 3), 7.0, np.float32)
    corner = np.tile(shape.triangles[0], (500, 1))
    painting.apply(colours, np.zeros(500, int), corner, shares, np.full(500, far))
    assert (np.ptp(colours) > contrast) == (far < 1.0)
    assert colours.mean() == pytest.approx(0.5, abs=0.03)  # as light from afar as from near
    plain = np.full((500, 3), 7.0, np.float32)
    painting.apply(plain, np.ones(500, int), corner, shares, np.full(500, far))
    assert np.all(plain == 7.0)
