"""Isoparametric curves of surfaces, drawn as lines, tubes or ribbons."""
