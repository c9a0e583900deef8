"""Programs for those who work on the service: they measure, attack, judge, draw and generate."""
