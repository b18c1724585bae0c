"""Bags: message definitions, batch serialisation, a writer with rosbag2's names, and the recorder of the live graph."""
