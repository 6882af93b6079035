"""From one receiver under its light to the layers of a texture."""
