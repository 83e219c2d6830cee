"""Games in which all agents are paid alike, played again and again."""
