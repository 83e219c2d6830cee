"""Peers: learners of other libraries, which train by themselves, as conditions of a study.

A peer acts for all agents of a scenario. It sees the same state variables, gets the same rewards
and meets the same worlds as a hierarchy of fuzzy agents does; it has no predictor. The hierarchy
says who the agents are (wheels, robots, or one for all), and no more. Peers need the extra
``peers``: stable-baselines3 and PyTorch, imported when one is built.
"""
