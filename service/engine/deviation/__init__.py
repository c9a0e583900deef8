"""How far a surface is from its mesh of equal divisions: certified, from second differences."""
