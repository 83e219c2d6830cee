"""Plug-ins: registries, settings, files of users, and messages about mistakes."""
