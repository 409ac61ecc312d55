"""Arrays over time in, arrays over time out: velocities, foot contacts, swivel angles. Knows no skeleton."""
