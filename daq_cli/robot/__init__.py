"""Access to the robot for every command (`RobotAccess`): at this computer's port, or through a service."""
