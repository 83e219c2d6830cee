"""Compiled kernels of the rule base: the same numbers as the NumPy definitions, fast.

Every kernel has a plain-NumPy reference implementation: firing strengths in
`core.rules.kernels.fuzzy`, features in `RuleBase.features`; values and temporal differences are
oracles of the tests. Nothing is compiled on import; each kernel is compiled at its first call and
cached on disk.

The dense kernels leave out rules if all of them that share all but the last two variables come to
less than `NEGLIGIBLE`: firing strengths sum to one, so that a value of the paper's rule base, with
its 5^5 such parts, changes by less than 1e-12 of the largest weight.
"""
