"""Where agents act: robots, boxes, sensors, failures and tasks."""
