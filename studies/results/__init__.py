"""From rows to estimates: statistics and comparisons; nothing is drawn or printed here."""
