"""Logs of robots: MCAP files and bags of ROS 2."""
