"""Forward models: touches in; what a bench would measure, with its derivatives, out."""
