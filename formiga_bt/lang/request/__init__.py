"""What a caller passes: params, aliases, profiles, and which tasks a task requests."""
