"""
The toolkit in a notebook
=========================

Your own hierarchy, a study of it for several numbers of robots, and a table of costs, in Python. A
cell that ends with ``study``, ``comparison`` or ``table`` shows it.
"""

# sphinx_gallery_thumbnail_path = "figures/scaling.png"
import sys

import nested_agents as na

OUT = sys.argv[1] if len(sys.argv) > 1 else "out/notebook"

# 1. A hierarchy of one's own: the left wheels lead, each above its own robot's right wheel.
agents = na.BoxPushingSettings(robots=2).build().agents
leaders = na.Hierarchy(
    agents, [(agents[0], agents[2]), *zip(agents[::2], agents[1::2], strict=True)]
)
print(leaders)

# 2. It against the chain, by the number of robots: what will it take, what can it find?
short = {"seeds": 2, "episodes": 1, "steps": 12, "evaluation": 2, "preset": "own-value"}
spec = na.Spec(study="scaling", sweep={"scenario.robots": [1, 2]}, **short)
print(na.plan(spec, jobs=1, timed=False))
study = na.run(spec, OUT, jobs=1)
print(study.table(["evaluation success", "decision time [ms]"]))
comparison = study.compare(by="robots", measure="steps")
print(comparison)
study.figure().savefig(f"{OUT}/scaling.pdf")
own = na.run(na.Spec(study="scaling", topology=leaders, **short), f"{OUT}-own", jobs=1)
print(na.load(OUT, f"{OUT}-own").where("robots == 2").compare(measure="decision_ms"))
print(own.report(), own.replay().path)

# 3. What it costs, by the formulas of the paper, as a table for a paper.
table = na.cost_table(["chain", "teams"], agents=[2, 4, 8])
print(table)
print(table.latex)
