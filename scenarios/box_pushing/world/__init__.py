"""The physical world: robots on wheels, boxes, failures, infrared sensors."""
