"""Jobs: one file in, one file out. They join formats, figures, solvers and metrics, and print nothing.

The command line is a thin layer over them; batches call them directly. Long work is reported through a
callback (``jobs.progress``), everything else through what a job returns.
"""
