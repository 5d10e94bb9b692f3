"""What lies in an output folder: C, test vectors, unit test, build files, loaders, manifest."""
