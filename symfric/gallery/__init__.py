"""The figures of the source papers, a script each, with what is compared and how far we are."""
