"""Deixis and ROS 2, which speak to each other through rmw_zenoh's keys and CDR; ROS need not be installed here."""
