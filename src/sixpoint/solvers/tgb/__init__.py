"""The analytic limb of Tolani, Goswami and Badler 2000: every posture that reaches, by its swivel angle."""
