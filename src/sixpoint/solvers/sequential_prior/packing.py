"""How a fitted prior crosses into compiled code: one table of numbers, and working memory."""

from typing import NamedTuple

import numpy as np

from sixpoint.kernels.jit import helper

OUTPUTS = 21  # rotation vectors of the pelvis, five spine joints and the head
POINTS = 34  # features of the points
TURNED = 30  # of the measured rotations of head, wrists and ankles
MASKS = 5  # which of them there are
LIMB, END = 14, 6  # features of a limb, and of its measured extremity
STATIONS = 7


class Network(NamedTuple):
    """One fitted prior. Rows of layers are wider than they need be; the number after the inputs is the bias.

    Attributes:
        inputs: Number of features N.
        limb: Number of features of a limb M.
        mean: (N,) of the features.
        spread: (N,) standard deviation of the features.
        linear: (21, N + 1).
        hidden1: (H, N + 1).
        hidden2: (H, H + 1).
        hidden3: (21, H + 1).
        arm: (3, M + 1) features of an arm -> direction of the elbow.
        leg: (3, M + 1) features of a leg -> direction of the knee.
    """

    inputs: int
    limb: int
    mean: np.ndarray
    spread: np.ndarray
    linear: np.ndarray
    hidden1: np.ndarray
    hidden2: np.ndarray
    hidden3: np.ndarray
    arm: np.ndarray
    leg: np.ndarray


LAYERS = Network._fields[2:]


def pack_network(layers):
    """Layers by name -> a table (R, W): one under the other, padded with zeros."""
    rows = [np.atleast_2d(np.asarray(layers[name], float)) for name in LAYERS]
    width = max(layer.shape[1] for layer in rows)
    return np.vstack([np.pad(layer, ((0, 0), (0, width - layer.shape[1]))) for layer in rows])


@helper
def unpack_network(table, inputs, limb):
    """The network as slices."""
    hidden = (table.shape[0] - 2 - 2 * OUTPUTS - 6) // 2
    a = 2 + OUTPUTS
    b, c = a + hidden, a + 2 * hidden
    d = c + OUTPUTS
    return Network(
        inputs,
        limb,
        table[0],
        table[1],
        table[2:a],
        table[a:b],
        table[b:c],
        table[c:d],
        table[d : d + 3],
        table[d + 3 : d + 6],
    )


class Facts(NamedTuple):
    """What the features need of a figure.

    Attributes:
        height: Its height, the unit of lengths [m].
        whole: Length of the stretched trunk [m].
        middle: (3,) middle of the hips from the pelvis [m].
        proportions: (7,) lengths over the height.
        stations: (S,) of the trunk joints, see ``SpineChain.stations``.
    """

    height: float
    whole: float
    middle: np.ndarray
    proportions: np.ndarray
    stations: np.ndarray


def pack_facts(facts):
    """Facts -> one array."""
    return np.concatenate([[facts.height, facts.whole], facts.middle, facts.proportions, facts.stations])


@helper
def unpack_facts(numbers):
    """The facts as slices."""
    return Facts(numbers[0], numbers[1], numbers[2:5], numbers[5:12], numbers[12:])


class Thought(NamedTuple):
    """Working memory of a prior.

    Attributes:
        features: (69,) at most.
        mirrored: (69,) the same with left and right exchanged.
        normal: (69,) either, normalised.
        hidden1: (H,).
        hidden2: (H,).
        out: (21,).
        other: (21,) the same of the mirrored features.
        course: (7, 4) rotation of the trunk at each station against the pelvis.
    """

    features: np.ndarray
    mirrored: np.ndarray
    normal: np.ndarray
    hidden1: np.ndarray
    hidden2: np.ndarray
    out: np.ndarray
    other: np.ndarray
    course: np.ndarray


ROOM = POINTS + TURNED + MASKS


def thought_size(hidden):
    """Numbers of working memory for layers of ``hidden`` at most; the course is apart."""
    return 3 * ROOM + 2 * OUTPUTS + 2 * hidden


@helper
def unpack_thought(numbers, course):
    """Working memory as slices."""
    hidden = (numbers.shape[0] - 3 * ROOM - 2 * OUTPUTS) // 2
    a = 3 * ROOM
    b, c = a + hidden, a + 2 * hidden
    d = c + OUTPUTS
    return Thought(
        numbers[:ROOM],
        numbers[ROOM : 2 * ROOM],
        numbers[2 * ROOM : a],
        numbers[a:b],
        numbers[b:c],
        numbers[c:d],
        numbers[d:],
        course,
    )
