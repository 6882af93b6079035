"""What surfaces are made of."""
