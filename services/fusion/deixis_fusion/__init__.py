"""Deixis fusion: evidence to belief over the points of interest"""
