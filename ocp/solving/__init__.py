"""One solve of a problem on meshes, and where it starts."""
