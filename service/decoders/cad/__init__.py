"""The content of files of CAD systems, whatever their format: parts, instances and a report."""
