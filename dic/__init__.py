"""Digital image correlation: images in; displacement, strain, quality and uncertainty out."""
