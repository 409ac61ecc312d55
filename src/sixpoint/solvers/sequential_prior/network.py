"""A small network in compiled code: a linear map and two layers on the same features, added."""

from sixpoint.kernels.jit import algebra, helper
from sixpoint.solvers.sequential_prior.packing import OUTPUTS

CLIP = 5.0  # standard deviations


@algebra
def product(row, values, count):
    """Row of a layer times values, with its bias."""
    total = 0.0
    for i in range(count):
        total += row[i] * values[i]
    return total + row[count]


@helper
def run(network, features, normal, hidden1, hidden2, out):
    """The network's outputs for features."""
    inputs, width = network.inputs, network.hidden1.shape[0]
    for i in range(inputs):
        normal[i] = min(max((features[i] - network.mean[i]) / network.spread[i], -CLIP), CLIP)
    for k in range(width):
        hidden1[k] = max(product(network.hidden1[k], normal, inputs), 0.0)
    for k in range(width):
        hidden2[k] = max(product(network.hidden2[k], hidden1, width), 0.0)
    for k in range(OUTPUTS):
        linear = product(network.linear[k], normal, inputs)
        out[k] = linear + product(network.hidden3[k], hidden2, width)


@helper
def think(network, thought):
    """The mean of what the network says of the features and of their mirror image: no side is preferred."""
    features, mirrored, out, other = thought.features, thought.mirrored, thought.out, thought.other
    hidden1, hidden2 = thought.hidden1, thought.hidden2
    run(network, features, thought.normal, hidden1, hidden2, out)
    run(network, mirrored, thought.normal, hidden1, hidden2, other)
    for k in range(0, OUTPUTS, 3):
        out[k] = 0.5 * (out[k] + other[k])
        out[k + 1] = 0.5 * (out[k + 1] - other[k + 1])
        out[k + 2] = 0.5 * (out[k + 2] - other[k + 2])


@helper
def point(layer, features, count):
    """The direction of an elbow or knee from the features of a limb."""
    return (
        product(layer[0], features, count),
        product(layer[1], features, count),
        product(layer[2], features, count),
    )
