"""What one trial is, and what is measured of its episodes."""
