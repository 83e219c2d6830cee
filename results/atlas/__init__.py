"""The atlas: who wins where, how it grows, and what small teams tell of large ones."""
