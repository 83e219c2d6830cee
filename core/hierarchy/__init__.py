"""Who decides after whom: hierarchies, and what fails of their messages."""
