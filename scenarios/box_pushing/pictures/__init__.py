"""Pictures and animations of recorded episodes."""
