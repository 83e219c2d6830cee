"""How estimates look: figures, tables, files; nothing is computed here."""
