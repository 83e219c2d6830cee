"""Many worlds stepped in one call, by several processes: Gymnasium vector environments."""
