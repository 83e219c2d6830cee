"""Laws of growth with the team size: power laws, logistic curves, universal scalability law."""
