"""A planar arm whose joints are agents: they bring its tip to a goal."""
