"""Arrays, linear algebra and threads."""
