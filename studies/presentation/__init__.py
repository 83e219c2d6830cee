"""Presentation of estimates as figures, tables and files, without any computation."""
