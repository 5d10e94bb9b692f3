"""The adaptive attempt on a graphics processor, one member a thread."""
