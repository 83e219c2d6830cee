"""What a wheel agent perceives: state variables and state spaces."""
