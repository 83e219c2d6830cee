"""A controller that knows the whole situation: what it solves shows what can be solved."""
