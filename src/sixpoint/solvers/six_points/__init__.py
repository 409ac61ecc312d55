"""What all methods that pose a figure from six points share."""
