"""Deixis gesture: tracks to phases and pointing gestures"""
