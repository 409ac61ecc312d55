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
def think(network, features, hidden1, hidden2, out):
    """The network's 21 outputs; the features are normalised in place."""
    inputs, width = network.inputs, network.hidden1.shape[0]
    for i in range(inputs):
        features[i] = min(max((features[i] - network.mean[i]) / network.spread[i], -CLIP), CLIP)
    for k in range(width):
        hidden1[k] = max(product(network.hidden1[k], features, inputs), 0.0)
    for k in range(width):
        hidden2[k] = max(product(network.hidden2[k], hidden1, width), 0.0)
    for k in range(OUTPUTS):
        linear = product(network.linear[k], features, inputs)
        out[k] = linear + product(network.hidden3[k], hidden2, width)


@helper
def point(layer, features, count):
    """The direction of an elbow or knee from the features of a limb."""
    return (
        product(layer[0], features, count),
        product(layer[1], features, count),
        product(layer[2], features, count),
    )
