"""Live merging of ROS 2 topics of the network, with no ROS installation."""
