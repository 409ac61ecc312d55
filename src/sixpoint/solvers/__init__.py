"""How a figure is posed: one folder or file per method, one protocol for all."""
