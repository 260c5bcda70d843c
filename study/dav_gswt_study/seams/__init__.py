"""Seams measured: does a crop on a border, or on a cut, still look like something that occurs in the exemplar?"""
