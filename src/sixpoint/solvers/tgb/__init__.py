"""The analytic limb of Tolani, Goswami and Badler 2000, and TGBSIK: Sequential IK with such limbs."""
