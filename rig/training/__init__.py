"""What the nets of a scene are trained, validated and scored on."""
