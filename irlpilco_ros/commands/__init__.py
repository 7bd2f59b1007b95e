"""The subcommands of `irlpilco`, one file each, and what they share."""
