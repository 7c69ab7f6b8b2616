"""The robot as every command reaches it (`RobotAccess`): at this computer's port, or through a service."""
