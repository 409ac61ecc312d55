"""Joins solvers, recordings and the viewer's page: what is dragged is solved, what is solved is shown.

with open_page([stand(Figure.from_stature(1.75))]) as page:
    print(page.address)
"""
