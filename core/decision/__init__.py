"""How the values of actions become an action."""
