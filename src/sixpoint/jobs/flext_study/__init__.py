"""``sixpoint study flext``: the experiments of Boulic and Raunhardt 2009."""
