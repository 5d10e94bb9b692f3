"""What everything stands on: numbers, parameters, files, how a solve ended, empty panels."""
