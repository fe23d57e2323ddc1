"""RadioSLAM."""
