"""Named points over time, what their labels mean, and a figure that carries them."""
