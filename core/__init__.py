"""How agents fuzzify, predict, decide and learn, and what that costs."""
