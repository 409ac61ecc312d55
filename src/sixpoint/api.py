"""All that ``import sixpoint as sp`` offers; the package imports it when something of it is asked for."""

from sixpoint.body.dofs import Ball, Dofs, Fixed, Hinges, SwingTwist
from sixpoint.body.figure import Figure
from sixpoint.body.joint_angles import JointAngles, compute_joint_angles
from sixpoint.body.limits import Limits
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Event, Markers
from sixpoint.body.markers.roles import MarkerRoles, find_marker_roles
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.surface.appearance import Appearance
from sixpoint.body.surface.flesh import build_shape
from sixpoint.body.surface.shape import Shape
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.calibration.calibrate import calibrate
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.calibration.mounts import Calibration, Mount
from sixpoint.errors import FigureError, FormatError, SixpointError, SkeletonError, TargetError
from sixpoint.formats import (
    Avatar,
    load,
    load_avatar,
    load_markers,
    load_shape,
    load_targets,
    save,
    save_angles,
    save_markers,
    save_targets,
)
from sixpoint.jobs.marker_models import load_marker_model, save_marker_model
from sixpoint.jobs.retarget import retarget, retarget_pose
from sixpoint.samples import SAMPLES, make_sample
from sixpoint.solvers.base import MotionSolution, Solution, Solver, Status
from sixpoint.solvers.ccd.solver import CyclicCoordinateDescent
from sixpoint.solvers.hybrid.solver import HybridIK
from sixpoint.solvers.jacobian.solver import JacobianIK
from sixpoint.solvers.kma.solver import KulpaMultonArnaldi
from sixpoint.solvers.prioritized.solver import PrioritizedIK
from sixpoint.solvers.prioritized.tasks import (
    AlignTask,
    BalanceTask,
    Box,
    Capsule,
    CouplingTask,
    FlextTask,
    HalfSpace,
    LookAtTask,
    Mesh,
    ObstacleTask,
    OrientationTask,
    PlaneTask,
    PositionTask,
    PostureTask,
    Sphere,
)
from sixpoint.solvers.registry import SOLVERS, make_solver
from sixpoint.solvers.sequential.solver import SequentialIK
from sixpoint.solvers.sequential_plus.solver import Habits, SequentialIKPlus
from sixpoint.solvers.sequential_prior.solver import SequentialIKPrior
from sixpoint.solvers.six_points.solver import FIGHTING, WALKING
from sixpoint.solvers.tgb.limb import AnalyticLimb
from sixpoint.solvers.tgb.solver import TGBSequentialIK
from sixpoint.solvers.tracking.limits import widen_limits
from sixpoint.solvers.tracking.solver import MarkerTracker, TrackedFrame, TrackedMotion
from sixpoint.study.metrics import Errors, compute_errors

__all__ = [
    "EFFECTORS",
    "FIGHTING",
    "SAMPLES",
    "SOLVERS",
    "WALKING",
    "AlignTask",
    "AnalyticLimb",
    "Appearance",
    "Avatar",
    "BalanceTask",
    "Ball",
    "Box",
    "Calibration",
    "Capsule",
    "CouplingTask",
    "CyclicCoordinateDescent",
    "Dofs",
    "Errors",
    "Event",
    "Figure",
    "FigureError",
    "Fixed",
    "FlextTask",
    "FormatError",
    "Habits",
    "HalfSpace",
    "Hinges",
    "HybridIK",
    "JacobianIK",
    "JointAngles",
    "KulpaMultonArnaldi",
    "Limits",
    "LookAtTask",
    "MarkerModel",
    "MarkerRoles",
    "MarkerTracker",
    "Markers",
    "Mesh",
    "Motion",
    "MotionSolution",
    "Mount",
    "ObstacleTask",
    "OrientationTask",
    "PlaneTask",
    "Pose",
    "PositionTask",
    "PostureTask",
    "PrioritizedIK",
    "SequentialIK",
    "SequentialIKPlus",
    "SequentialIKPrior",
    "Shape",
    "SixpointError",
    "Skeleton",
    "SkeletonError",
    "Solution",
    "Solver",
    "Sphere",
    "Status",
    "SwingTwist",
    "TGBSequentialIK",
    "TargetError",
    "Targets",
    "TrackedFrame",
    "TrackedMotion",
    "build_shape",
    "calibrate",
    "calibrate_markers",
    "compute_errors",
    "compute_joint_angles",
    "find_marker_roles",
    "load",
    "load_avatar",
    "load_marker_model",
    "load_markers",
    "load_shape",
    "load_targets",
    "make_sample",
    "make_solver",
    "retarget",
    "retarget_pose",
    "save",
    "save_angles",
    "save_marker_model",
    "save_markers",
    "save_targets",
    "widen_limits",
]
