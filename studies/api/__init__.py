"""Python interface: running, loading, analyzing, drawing, reporting and planning studies."""
