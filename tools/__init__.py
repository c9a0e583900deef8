"""Programs for developers: they measure, attack and judge the service, draw pictures, and generate
files."""
