"""Motors with gears by their nameplate, and models that they drive."""
