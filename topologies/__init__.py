"""Who is above whom: builders, specs, checks and pictures of hierarchies."""
