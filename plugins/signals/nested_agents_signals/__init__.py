"""Private signals of a common state: a scenario, scripted Bayesian agents and theory."""
