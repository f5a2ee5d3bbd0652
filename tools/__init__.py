"""What builds, packages and sets up; nothing here is shipped."""
