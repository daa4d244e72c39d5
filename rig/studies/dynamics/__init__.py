"""The plate in time: taps that set it ringing, and presses under which it creeps."""
