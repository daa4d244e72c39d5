"""The whole chain: a frame in, touches out."""
