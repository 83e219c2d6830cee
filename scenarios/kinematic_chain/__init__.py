"""Planar arm with one agent per joint, which brings its tip to a goal."""
