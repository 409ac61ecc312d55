"""Standing at ease: where methods start, or are drawn to, that a straight limb would get stuck.

Reference: Unzueta et al. 2008, section 9, "a standing pose in which the arms and legs are slightly bent; the
elbows backwards and the knees forward". The angles are ours.
"""

import numpy as np

ELBOW, SHOULDER_BACK, SHOULDER_OUT, KNEE, HIP = np.radians([20.0, 10.0, 10.0, 15.0, 8.0])
