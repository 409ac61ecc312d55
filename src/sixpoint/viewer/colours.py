"""The colours of the page, those of the pictures in the report."""

INK, SOFT, GHOST = (34, 48, 60), (135, 147, 160), (190, 199, 208)
LEFT, RIGHT, TRUNK = (31, 138, 158), (224, 122, 63), (68, 84, 106)
LIMIT = (201, 55, 79)
"""A joint that is at its limit."""
WOOD = (205, 181, 143)
SIDES = {"left": LEFT, "right": RIGHT, "trunk": TRUNK}
PAPER, GRID, SECTION = (247, 248, 250), (226, 231, 236), (201, 208, 215)


def as_hex(colour: tuple[int, int, int]) -> str:
    """As CSS writes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
