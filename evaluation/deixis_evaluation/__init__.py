"""Scores Deixis on labelled clips"""
