"""Following markers: prioritized IK with FLEXT limbs on clusters of markers, frame by frame."""
