"""What is posed: skeletons, motions, figures and the six targets. Plain data, no solving."""
