"""Studies that answer one question each, by names of files."""
