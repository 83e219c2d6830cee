"""Private information: every agent has a noisy signal of a state that all must name."""
