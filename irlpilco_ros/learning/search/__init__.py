"""Policy search: minimising the predicted cost."""
