"""A bench with what is known of it: priors, identification from presses, uncertainty of touches."""
