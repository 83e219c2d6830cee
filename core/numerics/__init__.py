"""Arrays, compiled kernels, ties."""
