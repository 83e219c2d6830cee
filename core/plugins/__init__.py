"""How things of users get in: registries, settings, files, messages on what is wrong."""
