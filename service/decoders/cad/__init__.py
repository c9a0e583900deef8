"""What files of CAD systems hold, whatever their format: parts, instances and a report."""
