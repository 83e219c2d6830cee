"""The commands of ``nested-agents``, one module each."""
