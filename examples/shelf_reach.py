"""Can people reach these items in a shelf? A small woman and a tall man try, with both feet planted.

    python examples/shelf_reach.py [--out FOLDER] [--force]

The right hand goes past a post into the shelf, for one item after the other. In order of importance: the feet
stay where they are; head, trunk and arms keep clear of boards and post; the centre of mass stays above the
feet; the palm goes to the item; the eyes look at it; the fingers point into the shelf; the rest relaxes.
Lengths are measured on the motion: the first at the item, the others at worst. A miss is where the solver
ended; "nothing alone": no task or limit alone holds it. Also written: motions (BVH), pictures, report.csv.
Metres, radians, seconds; Y up, people look along Z into the shelf, X is to their left.
"""

import argparse
import csv
import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

import sixpoint as sp
from sixpoint.body.masses import centre_of_mass, segment_masses
from sixpoint.body.rotations import IDENTITY
from sixpoint.formats.atomic import check_writable, write_files
from sixpoint.study.scene import MET, MISSED, Shot, Thing, draw_scene

# Statures [m] of US adults, 19 to 65 years. S. Pheasant, "Bodyspace", 2nd ed., Taylor & Francis, 1996.
PEOPLE = {"woman_p05": ("woman, 5th percentile", 1.52), "man_p95": ("man, 95th percentile", 1.87)}
FRONT = 0.50  # front edge of the shelf, from the middle of who stands before it [m]
BOARD, POST = sp.Box((0.70, 0.03, 0.40)), sp.Capsule(0.025, 1.90)
OBSTACLES = {f"board {y:.2f}": (BOARD, (-0.30, y, FRONT + 0.20)) for y in (0.70, 1.12, 1.72)}
OBSTACLES["post"] = POST, (-0.33, 0.975, FRONT - 0.03)
ITEMS = {"waist": (-0.24, 0.88, 0.68), "shoulder": (-0.24, 1.32, 0.64), "overhead": (-0.24, 1.98, 0.63)}
NEAR, CLEARANCE = 0.01, 0.015  # palm to a reached item; kept between flesh and obstacles [m]
RATE, HOLD = 60, 0.5  # [Hz], [s]
# Flesh around the bones (joint or site, joint or site): its radius as a share of the stature.
FLESH = {"head": ("skullbase", "skull_tip", 0.045), "trunk": ("vt6", "vt1", 0.060)}
for side, name in (("r", "right"), ("l", "left")):
    FLESH[f"{name} upper arm"] = (f"{side}_shoulder", f"{side}_elbow", 0.024)
    FLESH[f"{name} forearm"] = (f"{side}_elbow", f"{side}_wrist", 0.021)
    FLESH[f"{name} hand"] = (f"{side}_wrist", f"{side}_index_tip", 0.016)
    FLESH[f"{name} thigh"] = (f"{side}_hip", f"{side}_knee", 0.040)
    FLESH[f"{name} shank"] = (f"{side}_knee", f"{side}_ankle", 0.030)
LENGTHS = ("hand to item", "body to obstacles", "foot slip", "mass inside support")


@dataclass
class Reach:
    """One person's reach for one item."""

    item: str
    frame: int  # of the arrival
    path: np.ndarray  # where the hand should go (F, 3) [m]
    unmet: dict[str, str]  # task -> what it gave way to
    residuals: dict[str, float]  # task -> error at the arrival [m or rad]
    measured: dict[str, float]  # [m]


def find_places(figure, *poses):
    """Name of a joint or site -> its world positions (F, 3) [m]."""
    positions, world = sp.Motion.from_poses(list(poses), RATE).transforms
    places = np.concatenate([positions, figure.skeleton.compute_sites(positions, world)], axis=1)
    names = (*figure.skeleton.names, *figure.skeleton.site_names)
    found = dict(zip(names, places.swapaxes(0, 1), strict=True))
    return found | {"palm": 0.5 * (found["r_index1"] + found["r_pinky1"])}


def stand(figure):
    """The neutral pose with the soles on the floor."""
    pose = figure.neutral_pose
    return replace(
        pose, translations=pose.translations - [0.0, find_places(figure, pose)["l_heel"][0, 1], 0.0]
    )


def make_tasks(figure, stature):
    """What the body has to do, the most important first."""
    at, tasks = find_places(figure, figure.neutral_pose), []
    for foot in ("l_ankle", "r_ankle"):
        tasks += [sp.PositionTask(foot, level=0), sp.OrientationTask(foot, level=0)]
    for part, (joint, end, radius) in FLESH.items():
        points = [(joint, tuple(share * (at[end] - at[joint])[0])) for share in (0.25, 0.5, 0.75, 1.0)]
        keep = {"offset": points[0][1], "points": tuple(points[1:]), "margin": radius * stature + CLEARANCE}
        for name, (shape, place) in OBSTACLES.items():
            what = {"name": f"{part} off {name}", "shape": shape, "goal": place}
            tasks.append(sp.ObstacleTask(joint, level=1, **what, **keep))
    arm = {"root": "r_shoulder", "middle": "r_elbow", "offset": tuple((at["palm"] - at["r_wrist"])[0])}
    eye = (0.0, 0.04 * stature, 0.05 * stature)
    return [
        *tasks,
        sp.BalanceTask(level=2, margin=0.03),
        sp.FlextTask("r_wrist", level=3, drag=True, name="hand", **arm),
        sp.LookAtTask("skullbase", level=6, offset=eye, name="gaze", tolerance=0.02),
        sp.AlignTask("r_wrist", level=7, axis=(0, -1, 0), name="fingers", tolerance=0.03),
        sp.PostureTask(level=8),
    ]


def plan_hand(start, item, seconds):
    """Smooth path of the hand past the post to the item (F, 3) [m], and the share of the way (F, 1)."""
    t = np.linspace(0.0, 1.0, round(seconds * RATE) + 1)[:, None]
    s = 10 * t**3 - 15 * t**4 + 6 * t**5  # minimum jerk: Flash and Hogan 1985
    door = np.array([-0.17, item[1] + 0.08, FRONT - 0.18])  # bends the path round the post
    return (1 - s) ** 2 * start + 2 * s * (1 - s) * door + s**2 * item, s


def perform(name, stature, seconds):
    """Let one person reach for all items: the figure, its motion, and a ``Reach`` per item."""
    figure = sp.Figure.from_stature(stature)
    small = {"gain": 0.5, "max_angle": 0.05, "max_shift": 0.015, "rank_threshold": 0.05}  # contacts change
    solver = sp.PrioritizedIK(figure, make_tasks(figure, stature), dofs=figure.full_dofs(), **small)
    standing, feet = stand(figure), {}
    for foot in ("l_ankle", "r_ankle"):
        feet |= {foot: find_places(figure, standing)[foot][0], f"{foot} orientation": IDENTITY}
    ahead, down, forward = np.array([0.0, 0.93 * stature, 3.0]), np.array([0, -1, 0]), np.array([0, 0, 1])
    solution = solver.solve({**feet, "gaze": ahead, "fingers": down}, start=standing)
    for _ in range(100):  # settle into the relaxed posture; the hand has no goal yet
        solution = solver.solve({**feet, "gaze": ahead, "fingers": down}, solution)
    start, solved, reaches = find_places(figure, solution.pose)["palm"][0], [], []
    for item, place in ITEMS.items():
        path, share = plan_hand(start, np.array(place), seconds)
        out, first = [*range(len(path)), *[-1] * round(HOLD * RATE)], len(solved)
        for k in (*out, *range(len(path))[::-1]):
            gaze, fingers = ahead + share[k] * (place - ahead), down + share[k] * (forward - down)
            solution = solver.solve({**feet, "hand": path[k], "gaze": gaze, "fingers": fingers}, solution)
            solved.append(solution)
        arrived, poses = solved[first + len(out) - 1], [solution.pose for solution in solved[first:]]
        residuals = dict(zip(solver.names, map(float, arrived.residual), strict=True))
        unmet = {"hand": "nothing alone"} if residuals["hand"] > NEAR else {}
        unmet |= {task: ", ".join(held) for task, held in arrived.gave_way.items()}
        measured = measure(figure, stature, standing, poses, len(out) - 1, place)
        reaches.append(Reach(item, first + len(out) - 1, path, unmet, residuals, measured))
    motion = sp.Motion.from_poses([solution.pose for solution in solved], RATE)
    return figure, replace(motion, name=f"{name}, {stature:.2f} m"), reaches


def measure(figure, stature, standing, poses, arrival, item):
    """Lengths [m] measured on the poses of one reach alone."""
    at, planted, gaps = find_places(figure, *poses), find_places(figure, standing), []
    for a, b, radius in FLESH.values():
        points = at[a] + np.linspace(0.0, 1.0, 25)[:, None, None] * (at[b] - at[a])
        gaps += [distance(points, *obstacle).min() - radius * stature for obstacle in OBSTACLES.values()]
    soles = [f"{side}_{end}" for side in "lr" for end in ("heel", "toe_tip")]
    slip = [np.linalg.norm(at[sole] - planted[sole], axis=1).max() for sole in soles]
    edges = ConvexHull([planted[sole][0, [0, 2]] for sole in soles]).equations
    mass = centre_of_mass(segment_masses(figure), *sp.Motion.from_poses(poses, RATE).transforms)[:, [0, 2]]
    inside = -(mass @ edges[:, :2].T + edges[:, 2]).max()
    miss = np.linalg.norm(at["palm"][arrival] - item)
    return dict(zip(LENGTHS, map(float, (miss, min(gaps), max(slip), inside)), strict=True))


def distance(points, shape, place):
    """Distances of points (..., 3) to an upright box or capsule [m], negative inside."""
    p = np.abs(points - np.array(place))
    if isinstance(shape, sp.Box):
        q = p - 0.5 * np.array(shape.size)
        return np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(axis=-1), 0.0)
    p[..., 1] = np.maximum(p[..., 1] - 0.5 * shape.length, 0.0)
    return np.linalg.norm(p, axis=-1) - shape.radius


def draw(figure, motion, reaches, path):
    """Draw the arrival at every item, with the shelf and where the hand should have gone."""
    boards = [Thing.box(BOARD.size, place) for shape, place in OBSTACLES.values() if shape is BOARD]
    things, shots = [*boards, Thing.capsule(POST.radius, POST.length, OBSTACLES["post"][1])], []
    for reach in reaches:
        miss = reach.measured["hand to item"]
        said, colour = ("reached", MET) if miss <= NEAR else (f"missed by {100 * miss:.0f} cm", MISSED)
        caption = f"{reach.item}, {ITEMS[reach.item][1]:.2f} m: {said}"
        shots.append(Shot(reach.frame, caption, ((ITEMS[reach.item], colour),), reach.path))
    draw_scene(figure, motion, path, shots, things)


def report(results):
    """Markdown tables, and the text of a CSV with every residual."""
    rows = [["person", "item", "task", "residual [m or rad]", "gave way to"]]
    lines = ["| person | item | reached | " + " | ".join(LENGTHS) + " |", "|---" * 7 + "|"]
    failed = ["| person | item | unmet | error | gave way to |", "|---" * 5 + "|"]
    for motion, reaches in results.values():
        for r in reaches:
            said = "yes" if r.measured["hand to item"] <= NEAR else "**no**"
            cells = " | ".join(f"{1000 * value:.1f} mm" for value in r.measured.values())
            lines.append(f"| {motion.name} | {r.item} | {said} | {cells} |")
            for task, held in r.unmet.items():
                error = f"{r.residuals[task]:.3f} {'rad' if task in ('gaze', 'fingers') else 'm'}"
                failed.append(f"| {motion.name} | {r.item} | {task} | {error} | {held} |")
            errors = r.residuals.items()
            rows += [[motion.name, r.item, task, f"{e:.4f}", r.unmet.get(task, "")] for task, e in errors]
    csv.writer(table := io.StringIO(), lineterminator="\n").writerows(rows)
    return "\n".join([*lines, "", *failed]), table.getvalue()


def run(folder, force=False, seconds=2.0):
    """Write all files into a folder, one way of a reach taking so many seconds: key -> (motion, reaches)."""
    folder.mkdir(parents=True, exist_ok=True)
    names = ["report.md", "report.csv", *(f"{key}{end}" for key in PEOPLE for end in (".bvh", ".png"))]
    check_writable([folder / name for name in names], force)
    results = {}
    for key, (name, stature) in PEOPLE.items():
        figure, *results[key] = perform(name, stature, seconds)
        sp.save(results[key][0], folder / f"{key}.bvh", force=force)
        draw(figure, *results[key], folder / f"{key}.png")
    text, table = report(results)
    pictures = "\n\n".join(f"![{motion.name}]({key}.png)" for key, (motion, _) in results.items())
    page = f"# Who reaches what in the shelf\n\n{__doc__}\n{text}\n\n{pictures}\n"
    write_files({folder / "report.md": page.encode(), folder / "report.csv": table.encode()}, force)
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("shelf_reach"), help="folder to write")
    parser.add_argument("--force", action="store_true", help="overwrite existing files")
    given = parser.parse_args()
    try:
        print(report(run(given.out, given.force))[0])
    except (sp.SixpointError, OSError) as error:
        parser.exit(1, f"{error}\n")
