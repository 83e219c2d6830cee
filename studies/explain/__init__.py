"""What a trained team has learned, in words and figures."""
