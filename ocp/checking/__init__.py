"""What the model really does under an optimised control, and a mesh that follows from it."""
