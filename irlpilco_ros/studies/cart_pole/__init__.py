"""The thesis's first chapter: the swing-up of a cart-pole."""
