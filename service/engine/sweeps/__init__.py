"""What is swept along curves: tubes and ribbons."""
