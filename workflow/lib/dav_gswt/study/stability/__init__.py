"""How numbers behave at the extremes: every formula against float64, and the whole workflow at the ends of its range.

`registry` lists the formulas, `measure` compares them; `extremes` lists the runs, `running` makes one. `page` tells it.
"""
