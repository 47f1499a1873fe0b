"""Deixis camera: devices, files and streams to frames"""
