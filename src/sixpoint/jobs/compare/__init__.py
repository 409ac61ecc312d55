"""``sixpoint compare``: methods on clips, a results file, a report."""
