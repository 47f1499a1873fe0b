"""Deixis headpose: frames and tracks to head yaw"""
