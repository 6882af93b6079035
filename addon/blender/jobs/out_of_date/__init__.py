"""Records of what each bake has read, and their comparison with the scene as it is now."""
