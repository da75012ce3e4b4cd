"""Before the test day: what recordings with these settings will determine, and how surely."""
