"""The deixis command"""
