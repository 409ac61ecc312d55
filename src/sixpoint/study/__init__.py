"""Measuring and comparing: metrics, comparison runs, plots and reports."""
