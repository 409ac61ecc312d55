"""Studies that ship with sixpoint, as TOML: ``sixpoint compare --study NAME``."""
