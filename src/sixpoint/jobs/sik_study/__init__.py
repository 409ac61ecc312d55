"""``sixpoint study sik``: the figures of Unzueta et al. 2008."""
