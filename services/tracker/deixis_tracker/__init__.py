"""Deixis tracker: frames to face and hand tracks"""
